//! The aircraft and the ground as they are deployed: a router each, and between them a narrow link with
//! certificates, which is cut, narrowed and attacked.

mod access;
mod bad_credentials;
mod certificates;
mod cuts;
mod narrow;
mod routers;
mod world;

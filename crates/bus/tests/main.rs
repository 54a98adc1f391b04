//! Nodes over real routers, direct links and foreign clients.

mod contract;
mod foreign;
mod over_zenoh;

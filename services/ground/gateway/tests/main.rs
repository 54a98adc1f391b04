//! The gateway from outside: over HTTP, on sockets, and in a flight with all services.

mod contract;
mod http;
mod orders;
mod sockets;
mod unread;
mod world;

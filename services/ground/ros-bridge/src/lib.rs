//! A vehicle of a gateway as a ROS 2 node: topics, services and an action as `rmw_zenoh` lays them out, without ROS installed.
//!
//! The bridge is a client of the gateway like any other: what it shows is the gateway's document, and what ROS orders is an order under the
//! roles of the bridge's token. It decides nothing. This crate is pure: documents and requests in, messages and replies out. Its
//! caller carries them over HTTP and Zenoh.

mod bridge;
mod cdr;
mod goal;
mod messages;
pub mod names;
mod stamp;

#[cfg(test)]
mod tests;

pub use bridge::{Bridge, Effect, Order, Orders};
pub use names::{Names, Service, Topic};
pub use stamp::Stamp;

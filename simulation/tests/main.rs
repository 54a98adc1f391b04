//! Whole flights on a virtual clock, with all seven services. One program, so that they share the machine's processors.

mod adversary;
mod airspace;
mod blocked_landing;
mod busy;
mod contract;
mod energy;
mod flights;
mod frozen;
mod imported;
mod land_detector;
mod landing;
mod leaving;
mod operator;
mod pairs;
mod permission_protocol;
mod responses;
mod support;
mod survey;
mod trouble;

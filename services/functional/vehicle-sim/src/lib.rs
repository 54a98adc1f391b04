//! vehicle-sim

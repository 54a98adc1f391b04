//! What a leaf's author writes against: ports, their declarations, the registry.

pub(crate) mod declaration;
pub(crate) mod port_error;
pub(crate) mod ports;
pub(crate) mod registry;
pub(crate) mod spec;

//! control-tower

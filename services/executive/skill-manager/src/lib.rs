//! skill-manager

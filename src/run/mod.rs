//! What a process of the system is made of while it runs: its service on the bus or its router, what ends it, what watches
//! it, and what it leaves behind.

pub mod end;
pub mod first_start;
pub mod inputs;
mod life_lock;
mod notify_socket;
pub mod persisted;
pub mod process;
pub(crate) mod px4_port;
pub mod router;
pub mod run_file;
pub mod state_folder;
pub mod tower_key;
pub mod watchdog;
pub mod writer;

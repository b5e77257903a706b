//! Integration tests of the crate, one program.

mod bad_controller;
mod codec;
mod common;
mod in_process;
mod missed_cycles;
mod odd_controller;
mod session;
mod udp;
mod wrench;

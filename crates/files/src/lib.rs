#![doc = include_str!("../README.md")]

mod beside;
mod new_file;
mod same;

pub use beside::Beside;
pub use new_file::{NewFile, write};
pub use same::same_file;

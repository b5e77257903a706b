#![doc = include_str!("../README.md")]

mod beside;
mod new_file;
mod same;
mod table;

pub use beside::Beside;
pub use new_file::{NewFile, write};
pub use same::same_file;
pub use table::{Row, Table, TableError};

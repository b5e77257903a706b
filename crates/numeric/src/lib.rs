#![doc = include_str!("../README.md")]

pub mod check;
pub mod dense;

pub use check::ArgumentError;

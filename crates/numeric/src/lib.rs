#![doc = include_str!("../README.md")]

pub mod check;
pub mod dense;
pub mod parallel;

pub use check::ArgumentError;

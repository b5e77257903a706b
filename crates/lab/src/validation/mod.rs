//! validation

pub mod bip;
pub mod perception;
pub mod tables;
pub mod texture;

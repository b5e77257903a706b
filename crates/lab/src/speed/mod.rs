//! speed

pub mod bip;
pub mod contact;
pub mod fusion;
pub mod knobs;
pub mod multiples;
pub mod reach;
pub mod roughness;
pub mod scene;
pub mod tables;
pub mod texture;

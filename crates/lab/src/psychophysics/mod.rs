//! psychophysics

pub mod analyse;
pub mod design;
pub mod figures;
pub mod power;

//! The three commands of the example `psychophysics`, and the figures of a study.

pub mod analyse;
pub mod design;
pub mod figures;
pub mod power;

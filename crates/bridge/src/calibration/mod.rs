//! The pose of the headset's space, from corners of the board that a person touches.

mod face;
mod fit;
mod procedure;

pub use fit::{CHECK_BOUND_M, Calibration, CalibrationError, FIT_BOUND_M};
pub(crate) use procedure::{Procedure, Served, Step};

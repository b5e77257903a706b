//! The cost of predicting joints instead of points: the dissertation's end-to-end response compared with a predicted point and
//! exact inverse kinematics.

pub mod candidate;
pub mod document;
mod ends;
pub mod study;
mod touches;

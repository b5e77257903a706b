//! The cost of predicting joints instead of points: the dissertation's end-to-end response compared with a predicted point and
//! exact inverse kinematics.

pub mod document;
pub mod study;

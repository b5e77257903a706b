//! What it costs to lead an arm by joints instead of places: the dissertation's end-to-end response beside a predicted point with
//! exact inverse kinematics.

pub mod candidate;
pub mod document;
mod ends;
pub mod study;
mod touches;

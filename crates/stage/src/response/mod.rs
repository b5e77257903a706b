//! What moves under forces that are given row by row: an arm, or an object with one degree of freedom.

pub mod arm_motion;
pub mod object_motion;
pub mod torque_rows;

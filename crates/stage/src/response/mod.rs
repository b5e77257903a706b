//! Motion under forces given row by row: of an arm, or of an object with one degree of freedom.

pub mod arm_motion;
pub mod object_motion;
pub mod torque_rows;

//! How far an arm comes at most.

use hwall_kinematics::SrsArm;

/// The tool point is never further from the base than this, m.
pub(crate) fn longest_m(arm: &SrsArm) -> f64 {
    let g = arm.geometry();
    let tool_m = g.d_wf_m.abs() + arm.flange_from_tool().position_m().length();
    g.d_bs_m.abs() + g.d_se_m + g.d_ew_m + tool_m
}

//! How far an arm comes at most.

use hwall_kinematics::{ArmKinematics, JointPositions};

/// The tool point of an arm of turning joints is never further from the base than this, m.
pub(crate) fn longest_m(arm: &dyn ArmKinematics) -> f64 {
    if let Some(arm) = arm.closed_form() {
        let g = arm.geometry();
        let tool_m = g.d_wf_m.abs() + arm.flange_from_tool().position_m().length();
        return g.d_bs_m.abs() + g.d_se_m + g.d_ew_m + tool_m;
    }
    let body = arm.body_points(&JointPositions::default());
    let links = body.points_m().windows(2);
    links.map(|link| link[0].distance(link[1])).sum()
}

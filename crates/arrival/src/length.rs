//! Upper bound of the reach of an arm.

use hwall_kinematics::{ArmKinematics, JointPositions, MOST_JOINTS};

/// Upper bound of the distance of the tool point from the base, m.
pub(crate) fn longest_m(arm: &dyn ArmKinematics) -> f64 {
    if let Some(arm) = arm.closed_form() {
        let g = arm.geometry();
        let tool_m = g.d_wf_m.abs() + arm.flange_from_tool().position_m().length();
        return g.d_bs_m.abs() + g.d_se_m + g.d_ew_m + tool_m;
    }
    /// Points of a body closer than this are merged, m.
    const MERGED_M: f64 = 1e-3;
    let rest = JointPositions::default();
    let body = arm.body_points(&rest);
    let links = body.points_m().windows(2);
    let links_m: f64 = links.map(|link| link[0].distance(link[1])).sum();
    let slides = arm.limits().iter().zip(turning(arm));
    let slides_m = slides.filter(|(_, turns)| !turns);
    let slides_m: f64 = slides_m
        .map(|(limit, _)| limit.min_rad.abs().max(limit.max_rad.abs()))
        .sum();
    links_m + slides_m + MERGED_M * MOST_JOINTS as f64
}

/// Which joints are revolute; the others are prismatic or unused.
pub(crate) fn turning(arm: &dyn ArmKinematics) -> [bool; MOST_JOINTS] {
    let jacobian = arm.jacobian(&JointPositions::default());
    jacobian.angular.map(|axis| axis.length_squared() > 0.5)
}

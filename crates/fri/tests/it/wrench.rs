//! Which wrenches the controller accepts.

use crate::common::bench::{Bench, config, start, torque_arm};
use hwall_fri::LimitViolation;
use hwall_fri::codec::ClientCommandMode;
use hwall_fri::controller::{ControllerConfig, EndReason, LinkConfig};
use hwall_kinematics::glam::DVec3;
use hwall_kinematics::{SrsArm, Wrench};

/// Why commanding ended after this wrench, in wire order.
fn ended(wrench: [f64; 6]) -> Option<EndReason> {
    let config = config(ClientCommandMode::Wrench);
    let mut bench = Bench::new(torque_arm(), config, LinkConfig::default());
    bench.run(1.0, |_, _, _| {});
    bench.run(0.01, |_, _, data| data.wrench = Some(wrench));
    bench.controller.ended()
}

fn is_torque(ended: Option<EndReason>) -> bool {
    matches!(ended, Some(EndReason::Limit(LimitViolation::Torque { .. })))
}

/// It acts, and is checked, along the axes of the tool.
#[test]
fn a_wrench_is_judged_where_it_acts() {
    let (q, arm) = (start(), SrsArm::iiwa7());
    let limits = ControllerConfig::default().max_overlay_torque_n_m;
    let mut found = [false; 3];
    for (axis, direction) in DVec3::AXES.into_iter().enumerate() {
        let wrench = Wrench {
            force_n: arm.forward(&q).transform_vector(300.0 * direction),
            ..Wrench::default()
        };
        let torques = arm.jacobian(&q).torques(&wrench).0;
        found[axis] = torques.iter().zip(limits).any(|(t, most)| t.abs() > most);
        let [x, y, z] = (300.0 * direction).to_array();
        let ended = ended([x, y, z, 0.0, 0.0, 0.0]);
        let expected = found[axis];
        assert_eq!(is_torque(ended), expected, "{axis}: {torques:?} {ended:?}");
    }
    assert!(found.contains(&true) && found.contains(&false), "{found:?}");
}

/// Its torques overflow.
#[test]
fn a_wrench_beyond_all_numbers_ends_commanding() {
    for wrench in [
        [1.7e308, -1.7e308, 1.7e308, 0.0, 0.0, 0.0],
        [1.7e308, 1.7e308, -1.7e308, 1.7e308, -1.7e308, 1.7e308],
        [0.0, 0.0, 0.0, f64::MAX, f64::MAX, f64::MIN],
    ] {
        let ended = ended(wrench);
        assert!(is_torque(ended), "{wrench:?}: {ended:?}");
    }
}

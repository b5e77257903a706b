//! Shared code of the tests of simulated people.

pub(crate) mod chain;
pub(crate) mod motion;
pub(crate) mod torque;

use glam::DVec3;
use hwall_sim::{Person, PersonConfig, ReachPlan, TouchPlan, TouchSequence, TouchTruth};
use hwall_testkit::Sampler;

/// Touches of slanted walls in a box, m; with `shelves`, one in four on a shelf top.
pub(crate) fn touches_in(
    [low_m, high_m]: [DVec3; 2],
    shelves: bool,
    seed: u64,
    count: usize,
) -> Vec<TouchPlan> {
    let mut sampler = Sampler::new(seed);
    let one = |_| {
        let target_m = sampler.point_in_box(low_m, high_m);
        let tilt = sampler.point_in_box(DVec3::splat(-0.2), DVec3::splat(0.2));
        let normal = if shelves && sampler.index(4) == 0 {
            DVec3::Z
        } else {
            DVec3::X + tilt
        };
        TouchPlan { target_m, normal }
    };
    (0..count).map(one).collect()
}

/// Distance of a point in front of the touched surface, m.
pub(crate) fn height(touch: &TouchTruth, point_m: DVec3) -> f64 {
    (point_m - touch.target_m).dot(touch.normal)
}

/// Walls and slanted panels, far enough from the scattered rest positions of the hand.
pub(crate) fn plan(seed: u64, count: usize) -> Vec<TouchPlan> {
    let box_m = [DVec3::new(0.4, -0.4, 0.2), DVec3::new(0.6, 0.4, 0.9)];
    touches_in(box_m, false, seed, count)
}

pub(crate) fn sequence(config: PersonConfig, seed: u64, count: usize) -> TouchSequence {
    let person = Person::new(config, seed).expect("valid");
    person.plan(&plan(seed, count)).expect("within reach")
}

/// Everyone starts towards the previous target before a change of mind.
pub(crate) fn changing(config: PersonConfig, seed: u64, count: usize) -> TouchSequence {
    let touches = plan(seed, count + 1);
    let pair = |two: &[TouchPlan]| ReachPlan {
        touch: two[1],
        meant_first: Some(two[0]),
    };
    let reaches: Vec<ReachPlan> = touches.windows(2).map(pair).collect();
    let person = Person::new(config, seed).expect("valid");
    person.plan_reaches(&reaches).expect("within reach")
}

//! What the steps of redirection cost, beside the questions to the arm.

use crate::environment::journey::Journey;
use crate::environment::modes::{Mode, Placed, heading_ahead, placed};
use glam::DVec3;
use hwall_haptics::board_pose;
use hwall_kinematics::JointPositions;
use hwall_redirection::{
    AvatarTurn, PersonMotion, ReachFrame, ReachShift, ReachThresholds, RedirectedReach,
    SampledOrientations, TurnConfig,
};
use hwall_scene::Scene;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::run::judged::least_time::LeastTime;
use hwall_testkit::{Sampler, Timing, time_batches, time_each};

/// Measured one after the other, with touches of the journey.
pub(super) fn costs(
    scene: &Scene,
    journey: &Journey,
    arm: &BoardArm,
    least: &LeastTime<'_>,
    waiting: JointPositions,
) -> anyhow::Result<Vec<(&'static str, Timing)>> {
    let orientations = SampledOrientations::default();
    let touches = placed(scene, journey, &orientations, Mode::Exact)?;
    let count = touches.len();
    let mut turn = AvatarTurn::new(TurnConfig::default())?;
    let motion = PersonMotion {
        turn_rad_per_s: 0.1,
        speed_m_per_s: 0.1,
        steered_turn_rad_per_s: 0.4,
        steered_speed_m_per_s: 1.2,
    };
    let snap = time_batches(200, 1000, |i| {
        let seen = orientations.snap(i as f64 * 0.01);
        seen.and_then(|s| turn.step(s.turn_rad, &motion, 1e-3))
    });
    let thresholds = ReachThresholds::default();
    let start = DVec3::new(0.95, 0.15, 0.7);
    let goal = DVec3::new(0.6, 0.0, 0.6);
    let shift = ReachShift {
        horizontal_rad: thresholds.horizontal_rad,
        vertical_rad: 0.0,
        gain: 0.95,
    };
    let board = ReachFrame::new(start, goal)?.real_goal_m(&shift);
    let reach = RedirectedReach::new(start, goal, board, DVec3::X, &thresholds)?;
    let on_way = time_batches(200, 1000, |i| {
        reach.virtual_hand(start.lerp(board, (i % 1000) as f64 * 1e-3))
    });
    // Off the way, where all of the shift would be noticed.
    let mut sampler = Sampler::new(1);
    let drawn = (0..20_000)
        .map(|_| start.lerp(board, sampler.uniform(0.3, 1.0)) + sampler.unit_vector() * 0.2);
    let limited = |hand: &DVec3| reach.virtual_hand(*hand).is_ok_and(|shown| shown.limited);
    let off_way: Vec<DVec3> = drawn.filter(limited).collect();
    let beside = time_batches(200, 100, |i| {
        reach.virtual_hand(*off_way.get(i % off_way.len().max(1)).unwrap_or(&board))
    });
    let encounters = journey.encounters.iter();
    let instants: Vec<_> = encounters.flat_map(|e| &e.instants).collect();
    let rays = time_batches(100, 200, |i| {
        heading_ahead(scene, journey.floor_m, instants[i % instants.len()])
    });
    let mut costs = vec![
        ("snap an orientation and turn the avatar, one step", snap),
        ("shift the hand, on its way", on_way),
        ("shift the hand, off its way, where less is shown", beside),
        ("find the wall ahead, one ray", rays),
    ];
    if let Some(srs) = arm.closed_form() {
        let pose = |t: &Placed| board_pose(t.point_m, t.normal, 0.0);
        let poses = touches.iter().map(pose).collect::<Result<Vec<_>, _>>()?;
        let verdict = time_batches(200, 200, |i| srs.is_reachable(&poses[i % count]));
        costs.push(("exact verdict of one board pose", verdict));
    }
    let ways = time_each(count.min(60), |i| {
        least.to_touch(touches[i].point_m, touches[i].normal, &[waiting])
    });
    costs.push(("least time to a touch, brute force (study only)", ways));
    Ok(costs)
}

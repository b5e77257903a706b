//! Where the base of the arm stands best for touches in a scene: a search by arrival times, then rehearsals.

use crate::input::arms::BoardArm;
use crate::input::floor_pose::FloorPose;
use crate::person::kinds::PersonKind;
use crate::person::participants;
use crate::person::predictors::{Predictors, TrainingPeople};
use crate::report::summary::Summary;
use crate::run::people::{self, Stage};
use crate::run::simulated_arm::ArmLevel;
use anyhow::{Context, bail};
use hwall::arrival::reachability::{PlacementConfig, Steps};
use hwall::arrival::{
    ArrivalPlacement, ArrivalPlacementConfig, BoardExtent, place_base_by_arrival,
};
use hwall::haptics::Board;
use hwall::scene::Scene;
use hwall::{LikelyTouches, facets_of};
use hwall_motion::{MotionConfig, MotionLimits};

/// How far the base may be moved from the origin of the scene along each axis, m, and in which steps, m.
const RANGE_M: f64 = 0.2;
const STEP_M: f64 = 0.1;
const STEPS: usize = 5;
/// And turned, degrees.
const HEADINGS_DEG: [f64; 3] = [-15.0, 0.0, 15.0];

/// Places of the search that are rehearsed, besides the origin.
const REHEARSED: usize = 4;
/// Touches of a rehearsal, by people whom nobody meets again.
const TOUCHES: usize = 240;
const REHEARSAL_SEED: u64 = 0x7265_6865_6172_7365;
const PERIOD_S: f64 = 1e-3;

/// The place near the origin of the scene from which most boards are in time, in the frame of the scene.
///
/// The arrival times of straight ways choose a few places; at each of them and at the origin the whole loop is run with
/// simulated people, because what bent ways and late predictions cost is not in those times.
///
/// # Errors
/// An arm without a closed form, a scene without walls, nothing within reach from anywhere.
pub fn base_by_arrival(
    scene: &Scene,
    arm: &BoardArm,
    board: &Board,
    touches: &LikelyTouches,
    kind: PersonKind,
) -> anyhow::Result<FloorPose> {
    eprintln!("looking for a place for the base, then rehearsing: a minute or two");
    let mut places = places_by_arrival(scene, arm, board, touches)?;
    places.insert(0, FloorPose::ORIGIN);
    // One after the other on each half: a rehearsal takes seconds.
    let (even, odd) = std::thread::scope(|scope| {
        let shares = |first: usize| -> Vec<anyhow::Result<f64>> {
            let of_half = places.iter().skip(first).step_by(2);
            of_half
                .map(|place| rehearsed_share(scene, arm, board, kind, *place))
                .collect()
        };
        let other = scope.spawn(move || shares(1));
        let even = shares(0);
        other.join().map(|odd| (even, odd))
    })
    .map_err(|_| anyhow::anyhow!("--base-from arrival: a rehearsal broke off"))?;
    let (mut even, mut odd) = (even.into_iter(), odd.into_iter());
    let mut best: Option<(FloorPose, f64)> = None;
    for (i, place) in places.iter().enumerate() {
        let next = if i % 2 == 0 { even.next() } else { odd.next() };
        // A place from which these people cannot be served is none.
        if let Some(Ok(share)) = next
            && best.is_none_or(|(_, most)| share > most)
        {
            best = Some((*place, share));
        }
    }
    best.map(|(place, _)| place)
        .context("--base-from arrival: nobody can be served from anywhere")
}

/// Share of the touches within reach at which the board is in place in time, with the base at a place.
fn rehearsed_share(
    scene: &Scene,
    arm: &BoardArm,
    board: &Board,
    kind: PersonKind,
    base: FloorPose,
) -> anyhow::Result<f64> {
    let scene = &base.scene_seen(scene)?;
    let cast = participants::simulated_at(base, scene, arm, kind, TOUCHES, REHEARSAL_SEED)?;
    let likely = participants::likely_touches(scene, arm, &cast);
    let (predictors, _) = Predictors::train(scene, arm, &TrainingPeople::default(), None)?;
    let walls = arm.walls_of(scene, board, likely, true)?;
    let stage = Stage {
        arm,
        board,
        scene,
        walls: &walls,
        predictors: &predictors,
        textured: true,
        level: ArmLevel::Servo,
        period_s: PERIOD_S,
    };
    let summary = Summary::new(&people::run(&stage, &cast, |_| {})?);
    Ok(summary.in_place as f64 / summary.reachable.max(1) as f64)
}

/// The places from which most of the touches are reached in time by straight ways, best first.
fn places_by_arrival(
    scene: &Scene,
    arm: &BoardArm,
    board: &Board,
    touches: &LikelyTouches,
) -> anyhow::Result<Vec<FloorPose>> {
    let srs = arm
        .closed_form()
        .context("--base-from arrival: needs an arm with a closed form, such as iiwa7")?;
    let LikelyTouches::Such(targets) = touches else {
        bail!("--base-from arrival: nobody can touch a wall of this scene");
    };
    let steps = Steps::new(-RANGE_M, STEP_M, STEPS)?;
    let extent = BoardExtent {
        half_width_m: board.half_width_m,
        half_height_m: board.half_height_m,
    };
    let limits = MotionLimits::of_arm(srs, &MotionConfig::default())?;
    let config = ArrivalPlacementConfig {
        best: REHEARSED,
        ..ArrivalPlacementConfig::new(PlacementConfig {
            headings_rad: HEADINGS_DEG.map(f64::to_radians).to_vec(),
            ..PlacementConfig::new(steps, steps, 0.0)
        })
    };
    let found = place_base_by_arrival(srs, targets, &facets_of(scene), extent, &limits, &config)?;
    let place = |found: &ArrivalPlacement| FloorPose {
        origin_m: found.room_from_base.position_m(),
        yaw_rad: found.heading_rad,
    };
    Ok(found.best.iter().map(place).collect())
}

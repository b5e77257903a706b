//! The best base of the arm for the touches in a scene: a search by arrival times, then simulated trials.

use crate::input::arms::BoardArm;
use crate::input::floor_pose::FloorPose;
use crate::person::kinds::PersonKind;
use crate::person::participants;
use crate::person::predictors::{Predictors, TrainingPeople};
use crate::person::responses::Scenery;
use crate::report::summary::Summary;
use crate::run::people;
use crate::run::stage::Stage;
use anyhow::{Context, bail};
use hwall::arrival::reachability::{PlacementConfig, Steps};
use hwall::arrival::{
    ArrivalError, ArrivalPlacement, ArrivalPlacementConfig, BoardExtent, WeightedTarget,
    place_base_by_arrival,
};
use hwall::scene::Scene;
use hwall::{LikelyTouches, facets_of};
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_numeric::parallel;

/// Range of the base around the origin of the scene along each axis, m, and step, m.
const RANGE_M: f64 = 0.2;
const STEP_M: f64 = 0.1;
const STEPS: usize = 5;
/// Heights of the base, m. No rotation: it would only shift the first joint, which is far from its limits.
const HEIGHTS_M: [f64; 2] = [0.0, 0.1];

/// Number of candidates tried in simulation, besides the origin.
const REHEARSED: usize = 4;
/// Touches of a trial, by people used only here.
const TOUCHES: usize = 240;
const REHEARSAL_SEED: u64 = 0x7265_6865_6172_7365;
const PERIOD_S: f64 = 1e-3;

/// The place near the origin of the scene, on the floor or raised, from which the board is most often in time, in the frame of the
/// scene.
///
/// Arrival times of straight paths select a few candidates. At each of them and at the origin the whole loop is simulated
/// with people, because arrival times do not include the cost of bent paths and late predictions. People choose new touches
/// within reach of the arm at each place. The share in time is therefore multiplied by the share of likely touches that the arm
/// reaches, so that a smaller reach is no advantage.
///
/// # Errors
/// An arm without a closed form, a scene without walls, nothing within reach from anywhere.
pub fn base_by_arrival(
    scene: &Scene,
    arm: &BoardArm,
    touches: &LikelyTouches,
    kind: PersonKind,
) -> anyhow::Result<FloorPose> {
    let mut places = places_by_arrival(scene, arm, touches)?;
    places.insert(0, FloorPose::ORIGIN);
    let shares = parallel::map(places.len(), |i| {
        rehearsed_share(scene, arm, kind, places[i])
    });
    let mut best: Option<(FloorPose, f64)> = None;
    for (place, share) in places.into_iter().zip(shares) {
        // Skip a place from which these people cannot be served.
        let Ok(in_place) = share else { continue };
        let served = in_place * reached_share(arm, touches, place)?;
        if best.is_none_or(|(_, most)| served > most) {
            best = Some((place, served));
        }
    }
    best.map(|(place, _)| place)
        .context("--base-from arrival: nobody can be served from anywhere")
}

/// Share of the touches within reach at which the board is in place in time, with the base at a place.
fn rehearsed_share(
    scene: &Scene,
    arm: &BoardArm,
    kind: PersonKind,
    base: FloorPose,
) -> anyhow::Result<f64> {
    let scene = &base.scene_seen(scene)?;
    let config = |_, seed| kind.config(seed);
    let cast = participants::simulated_as(config, base, scene, arm, TOUCHES, REHEARSAL_SEED)?;
    let likely = participants::likely_touches(scene, arm, &cast);
    let people = &TrainingPeople::default().seen_from(base);
    let (predictors, _) = Predictors::train(scene, arm, people, None)?;
    let walls = arm.walls_of(scene, likely, true)?;
    let scenery = Scenery::of(scene, arm, &walls, people);
    let stage = Stage::of(&scenery, &predictors, PERIOD_S);
    let summary = Summary::new(&people::run(&stage, &cast, |_| {})?);
    Ok(summary.in_place as f64 / summary.reachable.max(1) as f64)
}

/// Share of the likely touches, by weight, that the arm can reach with the base at a place.
fn reached_share(arm: &BoardArm, touches: &LikelyTouches, base: FloorPose) -> anyhow::Result<f64> {
    let base_from_scene = base.outer_from_here().inverse();
    let (mut reached, mut all) = (0.0, 0.0);
    for WeightedTarget { target, weight, .. } in such(touches)? {
        let point_m = base_from_scene.transform_point3(target.point_m);
        let normal = base_from_scene.transform_vector3(target.normal);
        all += weight;
        if arm.unreachable(point_m, normal)?.is_none() {
            reached += weight;
        }
    }
    Ok(if all > 0.0 { reached / all } else { 0.0 })
}

fn such(touches: &LikelyTouches) -> anyhow::Result<&[WeightedTarget]> {
    let LikelyTouches::Such(targets) = touches else {
        bail!("--base-from arrival: nobody can touch a wall of this scene");
    };
    Ok(targets)
}

/// The places from which most touches are reached in time on straight paths, best first.
fn places_by_arrival(
    scene: &Scene,
    arm: &BoardArm,
    touches: &LikelyTouches,
) -> anyhow::Result<Vec<FloorPose>> {
    let srs = arm
        .closed_form()
        .context("--base-from arrival: needs an arm with a closed form, such as iiwa7")?;
    let targets = such(touches)?;
    let steps = Steps::new(-RANGE_M, STEP_M, STEPS)?;
    let extent = BoardExtent {
        half_width_m: arm.board().half_width_m,
        half_height_m: arm.board().half_height_m,
    };
    let limits = MotionLimits::of_arm(srs, &MotionConfig::default())?;
    let facets = facets_of(scene);
    let at_height = |z_m: f64| {
        let config = ArrivalPlacementConfig {
            best: REHEARSED,
            ..ArrivalPlacementConfig::new(PlacementConfig {
                headings_rad: vec![0.0],
                ..PlacementConfig::new(steps, steps, z_m)
            })
        };
        match place_base_by_arrival(srs, targets, &facets, extent, &limits, &config) {
            Ok(places) => Ok(places.best),
            Err(ArrivalError::OutOfReach { .. }) => Ok(Vec::new()),
            Err(error) => Err(anyhow::Error::from(error)),
        }
    };
    let at_heights = parallel::map(HEIGHTS_M.len(), |height| at_height(HEIGHTS_M[height]));
    let found = at_heights.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut found: Vec<ArrivalPlacement> = found.concat();
    found.sort_by(|a, b| b.in_time_share.total_cmp(&a.in_time_share));
    found.truncate(REHEARSED);
    let place = |found: &ArrivalPlacement| FloorPose {
        origin_m: found.room_from_base.position_m(),
        yaw_rad: found.heading_rad,
    };
    Ok(found.iter().map(place).collect())
}

//! Participants of a run: a recorded hand, or simulated people.

use crate::input::arms::BoardArm;
use crate::input::floor_pose::FloorPose;
use crate::person::hand::Hand;
use crate::person::kinds::PersonKind;
use crate::person::sights;
use crate::person::touches::{self, Standing, Touch};
use hwall::LikelyTouches;
use hwall::arrival::WeightedTarget;
use hwall::reachability::Target;
use hwall_scene::Scene;
use hwall_sim::{Person, PersonConfig, ReachPlan};

/// Touches of one simulated person; more touches need more people.
pub const DOZEN: usize = 12;

/// Period of the simulated tracker, s: a headset's 90 Hz.
const TRACKER_S: f64 = 1.0 / 90.0;

/// Least distance of a resting fingertip from a surface for a reach, m, as in `hwall-sim`.
const LEAST_REACH_M: f64 = 0.02;
/// Scatter about the place of rest is cut off at this many standard deviations per axis.
const FURTHEST_SD: f64 = 3.0;

/// One hand, and the touches that it makes.
pub struct Participant {
    /// The hand.
    pub hand: Hand,
    /// Its touches, in order of time.
    pub touches: Vec<Touch>,
    /// Seed of the person, and of the sensors' noise in the run.
    pub seed: u64,
}

/// As many simulated people as are needed for `touches` touches, a dozen each.
///
/// The first has the given seed itself, so a run of a dozen is part of every longer one.
///
/// # Errors
/// A scene in which too few points are visible and free before the hand.
pub fn simulated(
    scene: &Scene,
    arm: &BoardArm,
    kind: PersonKind,
    touches: usize,
    seed: u64,
) -> anyhow::Result<Vec<Participant>> {
    let config = |_, seed| kind.config(seed);
    simulated_as(config, FloorPose::ORIGIN, scene, arm, touches, seed)
}

/// As [`simulated`], with the settings of each person by number and seed, for an arm whose base was moved: the people stand at their
/// original places. The scene is seen from the base.
///
/// # Errors
/// As [`simulated`].
pub fn simulated_as(
    config: impl Fn(u64, u64) -> PersonConfig,
    base: FloorPose,
    scene: &Scene,
    arm: &BoardArm,
    touches: usize,
    seed: u64,
) -> anyhow::Result<Vec<Participant>> {
    let people = touches.div_ceil(DOZEN);
    (0..people)
        .map(|number| {
            let count = DOZEN.min(touches - number * DOZEN);
            let seed = seed_of(seed, number as u64);
            let config = base.person_seen(config(number as u64, seed));
            participant(scene, arm, config, count, seed)
        })
        .collect()
}

fn participant(
    scene: &Scene,
    arm: &BoardArm,
    config: PersonConfig,
    count: usize,
    seed: u64,
) -> anyhow::Result<Participant> {
    let person = Person::new(config, seed)?;
    let standing = Standing {
        head_m: person.head_m(),
        hand_m: config.hand_rest_m,
    };
    // The planned touches are reachable from every place of rest.
    let clear_m = LEAST_REACH_M + FURTHEST_SD * 3_f64.sqrt() * config.rest_scatter_m;
    let plans = touches::plan(scene, arm, &standing, clear_m, count, seed)?;
    let reaches: Vec<ReachPlan> = plans.into_iter().map(ReachPlan::from).collect();
    let sights_m = if config.glances[1] > 0 {
        sights::in_view(scene, &standing, config.facing, seed)?
    } else {
        Vec::new()
    };
    let sequence = person.plan_looking(&reaches, &sights_m)?;
    let touches = touches::of_person(scene, sequence.touches());
    Ok(Participant {
        hand: Hand::Simulated(Box::new(sequence), TRACKER_S),
        touches,
        seed,
    })
}

/// The seed of a person: the given one for the first; for others unrelated to it, to each other and to those of
/// neighbouring seeds. Source: the finalizer of SplitMix64, Steele, Lea and Flood 2014, Fast splittable pseudorandom number
/// generators.
fn seed_of(seed: u64, number: u64) -> u64 {
    let scrambled = |n: u64| {
        let z = n.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    };
    match number {
        0 => seed,
        // Rotated, to avoid the seeds of the training populations of `hwall-sim`.
        _ => scrambled(scrambled(seed).rotate_left(32) ^ number),
    }
}

/// Number of points that represent the likely touches.
const LIKELY: usize = 144;
/// Seed for choosing them; not used by any participant.
const LIKELY_SEED: u64 = 0x0070_7563_6865_5f31;

/// Random points that the first participant may touch: visible and reachable from where head and hand are first
/// seen. In a scene without such points, any point counts.
#[must_use]
pub fn likely_touches(
    scene: &Scene,
    arm: &BoardArm,
    participants: &[Participant],
) -> LikelyTouches {
    standing_of(participants)
        .and_then(|standing| {
            touches::plan(
                scene,
                arm,
                &standing,
                f64::NEG_INFINITY,
                LIKELY,
                LIKELY_SEED,
            )
            .ok()
        })
        .map(|plans| {
            let targets = plans.iter().map(|plan| {
                WeightedTarget::from(Target {
                    point_m: plan.target_m,
                    normal: plan.normal,
                })
            });
            LikelyTouches::Such(targets.collect())
        })
        .unwrap_or_default()
}

/// Where the first participant is first seen.
fn standing_of(participants: &[Participant]) -> Option<Standing> {
    match &participants.first()?.hand {
        Hand::Simulated(sequence, _) => Standing::seen_in(&sequence.sample(0.0).hand_frame()),
        Hand::Recorded(frames, _) => frames.iter().find_map(Standing::seen_in),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn nobody_is_there_twice() {
        let seeds: HashSet<u64> = (0..100)
            .flat_map(|seed| (0..100).map(move |number| seed_of(seed, number)))
            .collect();
        assert_eq!(seeds.len(), 100 * 100);
        assert_eq!(seed_of(7, 0), 7);
    }
}

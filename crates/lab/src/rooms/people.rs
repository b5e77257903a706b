//! People who touch the surfaces of a room under some condition, and predictors run over them.

use crate::rooms::room::Room;
use crate::rooms::scores::{TimedPrediction, TouchPredictions};
use anyhow::Context;
use hwall_contact::score::Span;
use hwall_contact::{ContactPrediction, Predictor, PredictorInput};
use hwall_sim::{PersonConfig, Population, ReachPlan, TouchSequence};
use hwall_stage::training::{Filters, Stream, SurfaceTouch};
use hwall_testkit::Sampler;
use std::time::Instant;

/// Period of the tracker, s.
const PERIOD_S: f64 = 1.0 / 90.0;

/// Condition under which people touch a room.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// For tables.
    pub name: String,
    /// Settings of people and trackers.
    pub person: PersonConfig,
    /// Share of the reaches that start for another target.
    pub changes_of_mind: f64,
    /// Only targets hidden from the eyes by a touchable or untouchable surface: figure VI-1
    /// of the dissertation.
    pub occluded: bool,
    /// Only targets near where two walls meet.
    pub at_corner: bool,
}

impl Condition {
    /// The nominal condition.
    pub fn nominal() -> Self {
        Self {
            name: "usual".to_owned(),
            person: PersonConfig::varied(),
            changes_of_mind: 0.0,
            occluded: false,
            at_corner: false,
        }
    }

    /// The nominal condition, then others that each degrade one aspect.
    pub fn all() -> Vec<Self> {
        type Change = fn(&mut Condition);
        let worse: [(&str, Change); 11] = [
            ("gaze noise 0 deg", |c| c.person.gaze_noise_rad = 0.0),
            ("gaze noise 2 deg", |c| {
                c.person.gaze_noise_rad = 2_f64.to_radians();
            }),
            ("gaze noise 5 deg", |c| {
                c.person.gaze_noise_rad = 5_f64.to_radians();
            }),
            ("gaze noise 10 deg", |c| {
                c.person.gaze_noise_rad = 10_f64.to_radians();
            }),
            ("gaze misses", |c| c.person.gaze_misses = 1.0),
            ("gaze leaves early", |c| {
                (c.person.gaze_leaves, c.person.gaze_misses) = (1.0, 0.0);
            }),
            ("occluded", |c| c.occluded = true),
            ("corner of two walls", |c| c.at_corner = true),
            ("tracker noise 5 mm", |c| c.person.tracker_noise_m = 0.005),
            ("dropouts 15 %", |c| c.person.dropout = 0.15),
            ("changes of mind", |c| c.changes_of_mind = 1.0),
        ];
        let made = |(name, change): (&str, fn(&mut Self))| {
            let mut condition = Self {
                name: name.to_owned(),
                ..Self::nominal()
            };
            change(&mut condition);
            condition
        };
        [Self::nominal()]
            .into_iter()
            .chain(worse.map(made))
            .collect()
    }
}

/// How many people and touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StudySize {
    /// Training people.
    pub training_people: usize,
    /// Test people.
    pub participants: usize,
    /// Touches of each.
    pub touches: usize,
    /// The same seed gives the same people and touches.
    pub seed: u64,
}

impl Default for StudySize {
    fn default() -> Self {
        Self {
            training_people: 12,
            participants: 8,
            touches: 12,
            seed: 1,
        }
    }
}

/// The people of a study.
pub struct StudyPeople {
    /// Training people.
    pub training: Vec<Stream>,
    /// Test people.
    pub participants: Vec<Stream>,
}

/// The people of a condition in a room.
///
/// # Errors
/// A condition without possible targets; errors of the simulation of people.
pub fn people(room: &Room, condition: &Condition, size: &StudySize) -> anyhow::Result<StudyPeople> {
    let population = Population::new(condition.person, size.seed)?;
    let mut sampler = Sampler::new(size.seed);
    let mut number = 0;
    let mut person = |_| {
        let mut plans = Vec::new();
        for _ in 0..size.touches {
            let mut draw = |occluded, at_corner| {
                room.target(&mut sampler, &condition.person, occluded, at_corner)
            };
            let touch = draw(condition.occluded, condition.at_corner);
            let touch = touch.context("no place to touch")?;
            let other = draw(false, false);
            let changes = sampler.uniform(0.0, 1.0) < condition.changes_of_mind;
            plans.push(ReachPlan {
                touch,
                meant_first: other.filter(|_| changes),
            });
        }
        let hand = population.person(number).plan_reaches(&plans)?;
        number += 1;
        stream(room, &hand)
    };
    let mut streams = |count: usize| (0..count).map(&mut person).collect::<anyhow::Result<_>>();
    Ok(StudyPeople {
        training: streams(size.training_people)?,
        participants: streams(size.participants)?,
    })
}

fn stream(room: &Room, hand: &TouchSequence) -> anyhow::Result<Stream> {
    let samples = 0..(hand.duration_s() / PERIOD_S) as usize;
    let frames = samples.map(|i| hand.tracked(i as f64 * PERIOD_S)).collect();
    let mut touches = Vec::new();
    for truth in hand.touches() {
        let span = Span {
            start_s: truth.start_s,
            contact_s: truth.contact_s,
        };
        if room.way_is_free(hand, span) {
            let surface = room.surface_at(truth.target_m)?;
            touches.push(SurfaceTouch::of(surface, hand, truth));
        }
    }
    Ok(Stream::new(frames, touches))
}

/// Runs a predictor over people, frame by frame: its predictions for every touch, from the start of the hand to the contact, without
/// feedback about touches.
///
/// # Errors
/// Settings that a filter refuses.
pub fn predictions(
    predictor: &mut dyn Predictor,
    room: &Room,
    streams: &[Stream],
) -> anyhow::Result<Vec<TouchPredictions>> {
    let touches = streams.iter().flat_map(|stream| &stream.touches);
    let of = |&touch: &SurfaceTouch| TouchPredictions {
        touch,
        samples: Vec::new(),
    };
    let mut touches: Vec<TouchPredictions> = touches.map(of).collect();
    follow(predictor, room, streams, |number, t_s, ranked, took_us| {
        touches[number].samples.push(TimedPrediction {
            t_s,
            first: ranked.first().copied(),
            took_us,
        });
    })?;
    Ok(touches)
}

/// The same with a function that gets the number of the touch, the time of the sample, s, the ranked predictions and their computing time, us.
///
/// # Errors
/// Settings that a filter refuses.
pub(super) fn follow(
    predictor: &mut dyn Predictor,
    room: &Room,
    streams: &[Stream],
    mut each: impl FnMut(usize, f64, &[ContactPrediction], f64),
) -> anyhow::Result<()> {
    let mut first = 0;
    for Stream { frames, touches } in streams {
        let mut filters = Filters::new()?;
        predictor.reset();
        let mut due = 0;
        for frame in frames {
            let over = |touch: &&SurfaceTouch| frame.t_s >= touch.contact_s;
            due += usize::from(touches.get(due).filter(over).is_some());
            let Some(touch) = touches.get(due) else {
                break;
            };
            let tracking = filters.hand.step(frame);
            let gaze = filters.gaze.step(frame.t_s, frame.gaze_ray().as_ref());
            let seen = PredictorInput {
                frame,
                hand: tracking.state(),
                gaze,
            };
            let began = Instant::now();
            let ranked = predictor.predict(&room.scene, &seen);
            let took_us = began.elapsed().as_secs_f64() * 1e6;
            if frame.t_s >= touch.start_s {
                each(first + due, frame.t_s, ranked, took_us);
            }
        }
        first += touches.len();
    }
    Ok(())
}

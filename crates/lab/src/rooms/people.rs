//! People who touch the surfaces of a room, under conditions: what predictions with a scene are judged by.

pub use crate::rooms::room::Room;
use crate::rooms::scores::{Heard, Told};
use anyhow::Context;
use hwall_contact::{ContactPrediction, Predictor, PredictorInput};
use hwall_sim::{PersonConfig, Population, ReachPlan, TouchSequence};
use hwall_stage::training::{Filters, Stream, Touch};
use hwall_testkit::Sampler;
use std::time::Instant;

/// Period of the tracker, s.
const PERIOD_S: f64 = 1.0 / 90.0;
/// What a room has to bear.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// For tables.
    pub name: String,
    /// What people and trackers are like.
    pub person: PersonConfig,
    /// Share of the reaches that start for another target.
    pub changes_of_mind: f64,
    /// Only targets that the eyes cannot see, from behind something that cannot be touched or that
    /// can: figure VI-1 of the dissertation.
    pub occluded: bool,
    /// Only targets near where two walls meet.
    pub at_corner: bool,
}

impl Condition {
    /// People as they are.
    #[must_use]
    pub fn usual() -> Self {
        Self {
            name: "usual".to_owned(),
            person: PersonConfig::varied(),
            changes_of_mind: 0.0,
            occluded: false,
            at_corner: false,
        }
    }

    /// One thing after the other made worse.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let usual = Self::usual();
        let with = |name: String, change: &dyn Fn(&mut Self)| {
            let mut condition = Self {
                name,
                ..usual.clone()
            };
            change(&mut condition);
            condition
        };
        let mut all = vec![usual.clone()];
        for degrees in [0.0, 2.0, 5.0, 10.0_f64] {
            all.push(with(format!("gaze noise {degrees} deg"), &|c| {
                c.person.gaze_noise_rad = degrees.to_radians();
            }));
        }
        all.push(with("gaze misses".to_owned(), &|c| {
            c.person.gaze_misses = 1.0
        }));
        all.push(with("gaze leaves early".to_owned(), &|c| {
            c.person.gaze_leaves = 1.0;
            c.person.gaze_misses = 0.0;
        }));
        all.push(with("occluded".to_owned(), &|c| c.occluded = true));
        all.push(with("corner of two walls".to_owned(), &|c| {
            c.at_corner = true
        }));
        all.push(with("tracker noise 5 mm".to_owned(), &|c| {
            c.person.tracker_noise_m = 0.005;
        }));
        all.push(with("dropouts 15 %".to_owned(), &|c| {
            c.person.dropout = 0.15
        }));
        all.push(with("changes of mind".to_owned(), &|c| {
            c.changes_of_mind = 1.0
        }));
        all
    }
}

/// How many people and touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cast {
    /// People to learn from, and other ones to be judged by.
    pub people: [usize; 2],
    /// Touches of each.
    pub touches: usize,
    /// Everything follows from it.
    pub seed: u64,
}

impl Default for Cast {
    fn default() -> Self {
        Self {
            people: [12, 8],
            touches: 12,
            seed: 1,
        }
    }
}

/// The people of a condition in a room: those to learn from, those to be judged by.
///
/// # Errors
/// A condition that no person can meet.
pub fn streams(
    room: &Room,
    condition: &Condition,
    cast: &Cast,
) -> anyhow::Result<[Vec<Stream>; 2]> {
    let population = Population::new(condition.person, cast.seed)?;
    let mut sampler = Sampler::new(cast.seed);
    let mut number = 0;
    let mut of = |people: usize| {
        (0..people)
            .map(|_| {
                let mut plans = Vec::new();
                for _ in 0..cast.touches {
                    let mut draw = |occluded, at_corner| {
                        room.target(&mut sampler, &condition.person, occluded, at_corner)
                    };
                    let touch = draw(condition.occluded, condition.at_corner)
                        .context("no place to touch")?;
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
            })
            .collect::<anyhow::Result<Vec<_>>>()
    };
    Ok([of(cast.people[0])?, of(cast.people[1])?])
}

fn stream(room: &Room, hand: &TouchSequence) -> anyhow::Result<Stream> {
    let samples = (hand.duration_s() / PERIOD_S) as usize;
    let frames = (0..samples)
        .map(|i| hand.tracked(i as f64 * PERIOD_S))
        .collect();
    let mut touches = Vec::new();
    for truth in hand.touches() {
        if room.way_is_free(hand, [truth.start_s, truth.contact_s]) {
            touches.push(Touch {
                surface: room.surface_at(truth.target_m)?,
                target_m: truth.target_m,
                normal: truth.normal,
                start_s: truth.start_s,
                contact_s: truth.contact_s,
            });
        }
    }
    Ok(Stream::new(frames, touches))
}

/// One sample of a touch, and all that was said about it.
pub struct Answered<'a> {
    /// Which stream, and which of its touches.
    pub place: [usize; 2],
    /// What the predictor was given.
    pub seen: PredictorInput<'a>,
    /// What it said.
    pub answers: &'a [ContactPrediction],
    /// How long that took, µs.
    pub took_us: f64,
}

/// Runs a predictor over people as they come: `hear` gets every sample from the start of a hand to its
/// contact.
///
/// # Errors
/// Settings that a filter refuses.
pub fn follow(
    predictor: &mut dyn Predictor,
    room: &Room,
    streams: &[Stream],
    condition: &Condition,
    mut hear: impl FnMut(&Answered<'_>),
) -> anyhow::Result<()> {
    for (number, stream) in streams.iter().enumerate() {
        let mut filters = Filters::new(condition.person.gaze_noise_rad)?;
        let mut due = 0;
        for frame in &stream.frames {
            let over = |t: &Touch| frame.t_s >= t.contact_s;
            due += usize::from(stream.touches.get(due).is_some_and(over));
            let Some(touch) = stream.touches.get(due) else {
                break;
            };
            let tracking = filters.hand.step(frame);
            let gaze = frame
                .gaze_ray()
                .and_then(|ray| filters.gaze.step(frame.t_s, &ray));
            let seen = PredictorInput {
                frame,
                hand: tracking.state(),
                gaze: gaze.as_ref(),
            };
            let began = Instant::now();
            let answers = predictor.predict(&room.scene, &seen);
            let took_us = began.elapsed().as_secs_f64() * 1e6;
            if frame.t_s >= touch.start_s {
                hear(&Answered {
                    place: [number, due],
                    seen,
                    answers,
                    took_us,
                });
            }
        }
    }
    Ok(())
}

/// What a predictor says of every touch, sample by sample from the start of the hand to the contact.
///
/// # Errors
/// Settings that a filter refuses.
pub fn listen(
    predictor: &mut dyn Predictor,
    room: &Room,
    streams: &[Stream],
    condition: &Condition,
) -> anyhow::Result<Vec<Told>> {
    let mut told: Vec<Told> = Vec::new();
    let mut firsts = Vec::with_capacity(streams.len());
    for stream in streams {
        firsts.push(told.len());
        told.extend(stream.touches.iter().map(|&touch| Told {
            touch,
            heard: Vec::new(),
        }));
    }
    follow(predictor, room, streams, condition, |at| {
        let [stream, touch] = at.place;
        told[firsts[stream] + touch].heard.push(Heard {
            t_s: at.seen.frame.t_s,
            first: at.answers.first().copied(),
            took_us: at.took_us,
        });
    })?;
    Ok(told)
}

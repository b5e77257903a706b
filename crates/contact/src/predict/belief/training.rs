//! Learns the reliability of each source from streams with known contacts: expectation maximisation of a mixture.

use super::super::gaze_memory::GazeMemory;
use super::super::hand::phase::PHASES;
use super::super::stream::StreamEstimator;
use super::context::{AGES, COLUMNS, EvidenceSource, SOURCES, SourceShares};
use super::model::{EvidenceModel, RestingHand, Shares};
use super::places::TouchedPlaces;
use super::sample::Sample;
use crate::error::ContactError;
use crate::estimate::ContactEstimator;
use crate::matrices::square;
use glam::{DMat3, DVec3};
use hwall_hand::{
    GazeFilter, GazeFilterConfig, HandFilter, HandFilterConfig, HandFrame, WatchConfig,
};
use hwall_numeric::check::{all_finite, finite};
use std::collections::BTreeMap;

/// A person's samples and contacts: also shows what people do between and before their reaches.
#[derive(Debug, Clone, Copy)]
pub struct LabelledStream<'a> {
    /// As tracked, in order of time, in the frame of the contacts.
    pub frames: &'a [HandFrame],
    /// All contacts in these samples, in order of time.
    pub contacts: &'a [StreamContact],
}

/// A contact in a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamContact {
    /// Position, m.
    pub point_m: DVec3,
    /// Time of the first contact, s.
    pub contact_s: f64,
}

/// Filters applied to a stream; use the same at run time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StreamFilters {
    /// Smoothing of the hand.
    pub hand: HandFilterConfig,
    /// Detection of fixations.
    pub gaze: GazeFilterConfig,
    /// Detection of the beginning and end of a reach.
    pub watch: WatchConfig,
}

const LEAST_TOUCHES: usize = 4;
/// Samples closer together than this are redundant, s.
const STEP_S: f64 = 0.02;
/// A hand at rest this far from its last contact belongs to the next one, m.
const AWAY_M: f64 = 0.08;
/// Standard deviation of an estimate without a covariance, m.
const DEFAULT_SD_M: f64 = 0.1;
/// Iterations of expectation maximisation.
const ROUNDS: usize = 40;
/// Least factor on the standard deviation that an estimator states; the largest is its inverse.
const LEAST_SCALE: f64 = 0.05;
/// Weight with which the shares of a cell are shrunk towards those of its cue, and the shares of the cue towards the prior, in touches.
const PULL: f64 = 4.0;

/// One sample and its contact.
struct Row {
    touch: usize,
    sample: Sample,
    contact_m: DVec3,
    places: TouchedPlaces,
    weight: f64,
}

impl EvidenceModel {
    /// Learns all parameters from streams. The estimator (by index of the stream) must be the kind used later, ideally not trained on that stream:
    /// its reliability in each phase is learned with it.
    ///
    /// Uses the samples from the first rest after a contact until the next contact; touches are weighted equally, not samples. Streams without gaze
    /// only inform the other parameters.
    ///
    /// # Errors
    /// Fewer than 4 touches; a contact that is not finite; settings that a filter refuses.
    pub fn fit_streams<E: ContactEstimator>(
        self,
        streams: &[LabelledStream<'_>],
        mut estimator: impl FnMut(usize) -> E,
        filters: &StreamFilters,
    ) -> Result<Self, ContactError> {
        for contact in streams.iter().flat_map(|stream| stream.contacts) {
            all_finite("point_m", &contact.point_m.to_array())?;
            finite("contact_s", contact.contact_s)?;
        }
        let (mut rows, mut touches) = (Vec::new(), 0);
        for (number, stream) in streams.iter().enumerate() {
            let estimator = StreamEstimator::new(estimator(number), filters.watch)?;
            touches = self.collect(stream, estimator, filters, &mut rows, touches)?;
        }
        if touches < LEAST_TOUCHES {
            return Err(ContactError::TooFewReaches {
                got: touches,
                needed: LEAST_TOUCHES,
            });
        }
        weigh(&mut rows);
        let start = Self {
            touches,
            motion_scale: usual_scales(&rows),
            ..self
        };
        let mut model = start;
        for _ in 0..ROUNDS {
            model = model.improved(&start, &rows);
        }
        model.validate()?;
        Ok(model)
    }

    /// Adds the rows of one stream; returns the number of touches so far.
    fn collect<E: ContactEstimator>(
        &self,
        stream: &LabelledStream<'_>,
        mut estimator: StreamEstimator<E>,
        filters: &StreamFilters,
        rows: &mut Vec<Row>,
        mut touches: usize,
    ) -> Result<usize, ContactError> {
        let mut hand = HandFilter::new(filters.hand)?;
        let mut gaze = GazeFilter::new(filters.gaze)?;
        let mut memory = GazeMemory::default();
        let mut places = TouchedPlaces::default();
        let mut contacts = stream.contacts.iter();
        let (mut last, mut next) = (None::<&StreamContact>, contacts.next());
        let mut on_the_way = true;
        let mut last_s = f64::NEG_INFINITY;
        for frame in stream.frames {
            while let Some(over) = next.filter(|c| frame.t_s >= c.contact_s) {
                places.touched(over.point_m, None);
                (last, next) = (Some(over), contacts.next());
                on_the_way = false;
                touches += 1;
            }
            let Some(contact) = next else { break };
            let tracking = hand.step(frame);
            estimator.step(frame, tracking.state());
            let seen = gaze.step(frame.t_s, frame.gaze_ray().as_ref());
            memory.step(frame.t_s, &seen, self.apart_rad());
            let Some(state) = tracking.state() else {
                continue;
            };
            let away_m = last.map_or(f64::INFINITY, |c| c.point_m.distance(state.point_m));
            on_the_way |= !estimator.reaching() && away_m > AWAY_M;
            if on_the_way && frame.t_s - last_s >= STEP_S {
                last_s = frame.t_s;
                let settings = (&filters.watch, DEFAULT_SD_M);
                let any = places.any();
                let sample = Sample::new(state, &estimator, &memory, any, self, settings);
                rows.extend(sample.map(|sample| Row {
                    touch: touches,
                    sample,
                    contact_m: contact.point_m,
                    places,
                    weight: 0.0,
                }));
            }
        }
        Ok(touches)
    }

    /// One iteration of expectation maximisation; `start` is the prior.
    fn improved(&self, start: &Self, rows: &[Row]) -> Self {
        let none: Shares = [[[[0.0; SOURCES]; COLUMNS]; AGES]; PHASES];
        let mut counts = none;
        let (mut dwells, mut squares) = (1.0, start.on_target_sd_rad.powi(2));
        let (mut rested, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        // Of *motion* alone: touches that the gaze confirms do not count. The error of the labels is included.
        let mut ends = [PULL; PHASES];
        let mut end_squares = start.motion_scale.map(|scale| PULL * scale * scale);
        for row in rows {
            let Row {
                sample, contact_m, ..
            } = row;
            let shares = self.shares_in(&sample.context);
            let logs = sample.log_densities(*contact_m, &row.places, self);
            let Some(right) = sample.responsibilities(&shares, &logs) else {
                continue;
            };
            let phase = sample.context.phase as usize;
            let weight = row.weight * right[EvidenceSource::Motion as usize];
            if let Some([motion, _]) = &sample.motion
                && weight > 0.0
            {
                ends[phase] += weight;
                end_squares[phase] += weight * motion.mahalanobis_squared(*contact_m) / 3.0;
            }
            let counts = &mut counts[phase];
            let is_known = sample.context.cue.is_some();
            for (age, cue, part) in sample.context.nodes() {
                let columns = [Some(cue), is_known.then_some(COLUMNS - 1)];
                for column in columns.into_iter().flatten() {
                    for (sum, right) in counts[age][column].iter_mut().zip(right) {
                        *sum += row.weight * part * right;
                    }
                }
            }
            if sample.motion.is_none() {
                if let Some(dwell) = &sample.dwells[0] {
                    let weight = row.weight * right[EvidenceSource::Fixation as usize];
                    let to_contact = *contact_m - dwell.ray.origin_m;
                    let rad = dwell.ray.direction.angle_between(to_contact);
                    dwells += weight;
                    squares += weight * (0.5 * rad * rad - dwell.noise_rad.powi(2));
                }
                let weight = row.weight * right[EvidenceSource::Anywhere as usize];
                let off = *contact_m - sample.rest_m;
                rested += weight;
                first += off * weight;
                second += square(off) * weight;
            }
        }
        let mut shares = none;
        for (phase, counts) in counts.iter().enumerate() {
            shares[phase] = pulled_together(counts, &start.shares[phase][0]);
        }
        let (before, total) = (start.rest, rested + PULL);
        let mean_m = (first + before.mean_m * PULL) / total;
        let second = second + (before.covariance_m2 + square(before.mean_m)) * PULL;
        Self {
            on_target_sd_rad: (squares / dwells).max(1e-6).sqrt(),
            shares,
            motion_scale: std::array::from_fn(|i| {
                let scale = (end_squares[i] / ends[i]).sqrt();
                scale.clamp(LEAST_SCALE, 1.0 / LEAST_SCALE)
            }),
            rest: RestingHand {
                mean_m,
                covariance_m2: second * total.recip() + square(mean_m) * -1.0,
            },
            ..*self
        }
    }
}

/// By phase, the median error of the estimator as a multiple of what it states: where expectation maximisation starts.
fn usual_scales(rows: &[Row]) -> [f64; PHASES] {
    // The median of a chi-squared variable with three degrees of freedom.
    const MEDIAN: f64 = 2.366;
    std::array::from_fn(|phase| {
        let own = rows
            .iter()
            .filter(|row| row.sample.context.phase as usize == phase);
        let squared = |row: &Row| Some(row.sample.motion?[0].mahalanobis_squared(row.contact_m));
        let mut squared: Vec<f64> = own.filter_map(squared).collect();
        squared.sort_by(f64::total_cmp);
        let median = squared.get(squared.len() / 2).copied().unwrap_or(MEDIAN);
        (median / MEDIAN)
            .sqrt()
            .clamp(LEAST_SCALE, 1.0 / LEAST_SCALE)
    })
}

/// Gives all rows of one touch in one cell together the weight of one row.
fn weigh(rows: &mut [Row]) {
    let cell = |row: &Row| {
        let nodes = row.sample.context.nodes();
        let (age, cue, _) = nodes
            .into_iter()
            .max_by(|a, b| a.2.total_cmp(&b.2))
            .unwrap_or((0, 0, 0.0));
        (row.touch, row.sample.context.phase as usize, age, cue)
    };
    let mut counts = BTreeMap::new();
    for row in rows.iter() {
        *counts.entry(cell(row)).or_insert(0.0) += 1.0;
    }
    for row in rows {
        row.weight = counts
            .get(&cell(row))
            .map_or(0.0, |count: &f64| count.recip());
    }
}

/// Shares from counts in the cells of a phase: each cell is shrunk towards its cue, and each cue towards the prior.
fn pulled_together(
    counts: &[[SourceShares; COLUMNS]; AGES],
    start: &[SourceShares; COLUMNS],
) -> [[SourceShares; COLUMNS]; AGES] {
    let pulled = |counts: &SourceShares, towards: &SourceShares| -> SourceShares {
        let total: f64 = counts.iter().sum::<f64>() + PULL;
        std::array::from_fn(|i| (counts[i] + PULL * towards[i]) / total)
    };
    let of_cue: [SourceShares; COLUMNS] = std::array::from_fn(|cue| {
        let sum = |i: usize| counts.iter().map(|of_age| of_age[cue][i]).sum();
        pulled(&std::array::from_fn(sum), &start[cue])
    });
    std::array::from_fn(|age| std::array::from_fn(|cue| pulled(&counts[age][cue], &of_cue[cue])))
}

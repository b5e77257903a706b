//! How people look, learnt from reaches or from whole streams.

use super::gaussian::Gaussian;
use super::gaze_memory::{GazeMemory, Look};
use super::gaze_model::GazeModel;
use super::gaze_weights::{
    ASTRAY_SHARE, ASTRAY_STRETCH, FAR_SHARE, FAR_STRETCH, LOOKS_SR, log_sum,
};
use super::hand_place::{HandPlace, gaussian_of};
use super::look_shares::{LOOK_AGES_S, LookShares, LookTable, ReachPhase, TargetShares, nodes};
use super::stream::{ReachBeginning, StreamEstimator};
use crate::error::ContactError;
use crate::estimate::{ContactEstimate, ContactEstimator};
use crate::outer_product::square;
use glam::{DMat3, DVec3};
use hwall_hand::{
    GazeFilter, GazeFilterConfig, HandFilter, HandFilterConfig, HandFrame, HandState,
    LabelledReach, WatchConfig,
};
use std::f64::consts::TAU;

/// A person's samples, and where and when they touch: to learn from what people do between and before their reaches.
#[derive(Debug, Clone, Copy)]
pub struct LabelledStream<'a> {
    /// As the tracker saw them, in order of time, in the frame of the contacts.
    pub frames: &'a [HandFrame],
    /// All contacts in these samples, in order of time.
    pub contacts: &'a [StreamContact],
}

/// A contact in a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamContact {
    /// Where, m.
    pub point_m: DVec3,
    /// When the hand arrives, s.
    pub contact_s: f64,
}

/// The filters that a stream is seen through; the same as in use.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StreamFilters {
    /// How the hand is smoothed.
    pub hand: HandFilterConfig,
    /// What counts as a fixation.
    pub gaze: GazeFilterConfig,
    /// What begins and ends a reach.
    pub watch: WatchConfig,
}

/// Fewest samples of reaches, and fewest touches of streams, that can be learnt from.
const LEAST_SAMPLES: usize = 20;
const LEAST_TOUCHES: usize = 4;

/// Larger angles are clipped to this, rad: the two spreads are those of a plane.
const WIDEST_RAD: f64 = 1.5;

/// Samples closer together than this say the same, s.
const STEP_S: f64 = 0.02;

/// A hand that is at rest this far from its last contact is on its way to the next, m.
const AWAY_M: f64 = 0.08;

/// Spread of an estimate without one, m.
const DEFAULT_SD_M: f64 = 0.1;

/// Error of the contacts that are learnt from, in each axis, m: a tracked tip is a point inside the finger.
const LABEL_SD_M: f64 = 0.008;

/// Rounds of expectation maximisation.
const ROUNDS: usize = 40;

/// Shares of an age are pulled towards those of the phase as if by this many touches, and those of the phase towards what they
/// were as if by this many.
const PULL_OF_PHASE: f64 = 4.0;
const PULL_OF_START: f64 = 2.0;
/// The same for the place of contacts about a resting hand.
const PULL_OF_REST: f64 = 5.0;

impl GazeModel {
    /// Learns both spreads and the share of looks elsewhere from reaches, by expectation maximisation over the angles of
    /// all samples up to the contact. The share is set for every phase of a reach and every age of a look; the rest
    /// stays as in `self`. Streams say more: [`fit_streams`](Self::fit_streams).
    ///
    /// Successive samples are nearly alike, so the number of reaches counts, not that of samples.
    ///
    /// # Errors
    /// Fewer than 20 samples with head and gaze.
    pub fn fit(self, reaches: &[LabelledReach]) -> Result<Self, ContactError> {
        let angles_rad: Vec<f64> = reaches
            .iter()
            .flat_map(|reach| reach.frames.iter().map(|f| (f, reach.contact_m)))
            .filter_map(|(frame, contact_m)| {
                let ray = frame.gaze_ray()?;
                let angle = ray.direction.angle_between(contact_m - ray.origin_m);
                angle.is_finite().then(|| angle.min(WIDEST_RAD))
            })
            .collect();
        if angles_rad.len() < LEAST_SAMPLES {
            return Err(ContactError::TooFewReaches {
                got: angles_rad.len(),
                needed: LEAST_SAMPLES,
            });
        }
        let mut model = self;
        let start = self.looks.at(ReachPhase::UnderWay, 0.5);
        let mut share = start.as_moves.elsewhere + start.anew.elsewhere;
        for _ in 0..100 {
            let (mut on, mut on_square, mut off_square) = (0.0, 0.0, 0.0);
            for angle in &angles_rad {
                let density =
                    |share: f64, sd: f64| share * (-0.5 * (angle / sd).powi(2)).exp() / (sd * sd);
                let near = density(1.0 - share, model.on_target_sd_rad);
                let far = density(share, model.elsewhere_sd_rad);
                let is_on = if near + far > 0.0 {
                    near / (near + far)
                } else {
                    0.0
                };
                on += is_on;
                on_square += is_on * angle * angle;
                off_square += (1.0 - is_on) * angle * angle;
            }
            let off = angles_rad.len() as f64 - on;
            // One pseudo-sample at the start value keeps a component without samples where it was.
            let pooled = |square: f64, n: f64, start: f64| {
                ((square + 2.0 * start * start) / (2.0 * n + 2.0)).sqrt()
            };
            model.on_target_sd_rad = pooled(on_square, on, self.on_target_sd_rad).max(1e-3);
            model.elsewhere_sd_rad =
                pooled(off_square, off, self.elsewhere_sd_rad).max(2.0 * model.on_target_sd_rad);
            share = ((off + 1.0) / (angles_rad.len() as f64 + 2.0)).clamp(1e-3, 1.0 - 1e-3);
        }
        for phase in ReachPhase::ALL {
            model
                .looks
                .set(phase, with_elsewhere(self.looks.at(phase, 0.5), share));
        }
        model.touches = reaches.len();
        Ok(model)
    }

    /// Learns all of it from streams: spreads, where people touch seen from their resting hand, and how often the present look,
    /// the one before it, or neither is at the place of the next contact, by the age of the look and the phase of the reach. The
    /// estimator is the one that will be used: how far its word can be taken in each phase is learnt with it.
    ///
    /// Samples from the time at which the hand rests after a contact until the next contact are used; the touches count, not
    /// the samples. Streams without a gaze teach what they can.
    ///
    /// # Errors
    /// Fewer than 4 touches; settings that a filter refuses.
    pub fn fit_streams<E: ContactEstimator>(
        self,
        streams: &[LabelledStream<'_>],
        mut estimator: impl FnMut(usize) -> E,
        filters: &StreamFilters,
    ) -> Result<Self, ContactError> {
        let mut collected = Collected::default();
        for (number, stream) in streams.iter().enumerate() {
            let mut estimator = StreamEstimator::new(estimator(number), filters.watch)?;
            self.collect(stream, &mut estimator, filters, &mut collected)?;
        }
        if collected.touches < LEAST_TOUCHES {
            return Err(ContactError::TooFewReaches {
                got: collected.touches,
                needed: LEAST_TOUCHES,
            });
        }
        let mut model = self;
        model.touches = collected.touches;
        collected.weigh();
        for _ in 0..ROUNDS {
            model = collected.improved(&self, &model);
        }
        model.validate()?;
        Ok(model)
    }

    /// The rows of one stream.
    fn collect<E: ContactEstimator>(
        &self,
        stream: &LabelledStream<'_>,
        estimator: &mut StreamEstimator<E>,
        filters: &StreamFilters,
        collected: &mut Collected,
    ) -> Result<(), ContactError> {
        let mut hand = HandFilter::new(filters.hand)?;
        let mut gaze = GazeFilter::new(filters.gaze)?;
        let mut memory = GazeMemory::default();
        let mut contacts = stream.contacts.iter();
        let (mut last, mut next) = (None::<&StreamContact>, contacts.next());
        let mut on_the_way = true;
        let mut last_s = f64::NEG_INFINITY;
        for frame in stream.frames {
            while let Some(over) = next.filter(|c| frame.t_s >= c.contact_s) {
                (last, next) = (Some(over), contacts.next());
                on_the_way = false;
                collected.touches += 1;
            }
            let Some(contact) = next else { break };
            let tracking = hand.step(frame);
            let estimate = estimator.step(frame, tracking.state());
            let seen = gaze.step(frame.t_s, frame.gaze_ray().as_ref());
            memory.step(frame.t_s, &seen, self.apart_rad());
            let Some(state) = tracking.state() else {
                continue;
            };
            let away_m = last.map_or(f64::INFINITY, |c| c.point_m.distance(state.point_m));
            on_the_way |= !estimator.reaching() && away_m > AWAY_M;
            if on_the_way && frame.t_s - last_s >= STEP_S {
                last_s = frame.t_s;
                let began = estimator.began();
                let row = self.row((state, began), estimate, &memory, contact, &filters.watch);
                let touch = collected.touches;
                collected.rows.extend(row.map(|row| Row { touch, ..row }));
            }
        }
        Ok(())
    }

    /// What one sample says about a contact.
    fn row(
        &self,
        (hand, began): (&HandState, Option<&ReachBeginning>),
        estimate: Option<ContactEstimate>,
        memory: &GazeMemory,
        contact: &StreamContact,
        watch: &WatchConfig,
    ) -> Option<Row> {
        let moves = estimate.and_then(|e| gaussian_of(&e, DEFAULT_SD_M));
        let place = HandPlace::new(hand, began, estimate.as_ref(), watch);
        let (now, before) = memory.looks(hand.t_s, self.memory_s);
        let row = Row {
            touch: 0,
            phase: place.phase,
            age_s: now.map_or(0.0, |look| look.age_s(hand.t_s)),
            weight: 0.0,
            log_as_moves: moves
                .and_then(|g| g.widened(LABEL_SD_M))
                .map_or(f64::NEG_INFINITY, |g| {
                    log_tailed(&g, contact.point_m, ASTRAY_SHARE, ASTRAY_STRETCH)
                }),
            log_changed: self.log_changed(
                moves.as_ref(),
                began.map(|began| began.since_s),
                memory,
                hand.t_s,
            ),
            from_rest: contact.point_m - place.rest_m,
            log_ahead: hand
                .direction
                .filter(|_| place.moves)
                .map(|ahead| log_ahead(contact.point_m - hand.point_m, ahead)),
            now: now.map(|look| Angle::new(look, contact.point_m)),
            before: before.map(|(look, ago_s)| {
                let fade = 1.0 - ago_s / self.memory_s;
                (Angle::new(look, contact.point_m), fade)
            }),
        };
        row.from_rest.is_finite().then_some(row)
    }
}

/// The same shares with another one for looks elsewhere.
fn with_elsewhere(shares: LookShares, elsewhere: f64) -> LookShares {
    let on = |s: TargetShares| s.now + s.before;
    let all_on = on(shares.as_moves) + on(shares.anew);
    let all_off = shares.as_moves.elsewhere + shares.anew.elsewhere;
    let (a, b) = ((1.0 - elsewhere) / all_on, elsewhere / all_off);
    let scaled = |s: TargetShares| TargetShares {
        now: s.now * a,
        before: s.before * a,
        elsewhere: s.elsewhere * b,
    };
    LookShares {
        as_moves: scaled(shares.as_moves),
        anew: scaled(shares.anew),
    }
}

/// A line of sight beside the true contact.
#[derive(Debug, Clone, Copy)]
struct Angle {
    rad: f64,
    noise_rad: f64,
    /// Logarithm of the density of the contact along the line, given that it is on it, sr/m³.
    log_along: f64,
}

/// What is touched lies somewhere along a line of sight, over this length, m.
const ALONG_M: f64 = 1.2;

impl Angle {
    fn new(look: &Look, contact_m: DVec3) -> Self {
        let to_contact = contact_m - look.ray.origin_m;
        Self {
            rad: look.ray.direction.angle_between(to_contact).min(WIDEST_RAD),
            noise_rad: look.noise_rad,
            log_along: -(ALONG_M * to_contact.length_squared()).ln(),
        }
    }

    /// Logarithm of the density of a direction with this spread, per steradian.
    fn log_density(&self, sd_rad: f64) -> f64 {
        let variance = sd_rad * sd_rad + self.noise_rad * self.noise_rad;
        -0.5 * self.rad * self.rad / variance - (TAU * variance).ln()
    }
}

/// One sample and the truth.
#[derive(Debug, Clone, Copy)]
struct Row {
    touch: usize,
    phase: ReachPhase,
    age_s: f64,
    weight: f64,
    /// Logarithm of the density of the contact by the estimate, per m³.
    log_as_moves: f64,
    /// [`GazeModel::log_changed`].
    log_changed: f64,
    from_rest: DVec3,
    /// Logarithm of its density by the direction of a moving hand alone, per m³.
    log_ahead: Option<f64>,
    now: Option<Angle>,
    /// The look before, and how much of it is left.
    before: Option<(Angle, f64)>,
}

/// Logarithm of the density of a contact by the direction of motion: ahead at any distance, beside it by a share of that.
fn log_ahead(to_contact: DVec3, ahead: DVec3) -> f64 {
    let way_m = to_contact.dot(ahead);
    let aside_m = (to_contact - ahead * way_m).length();
    let sd_m = BEND * way_m.max(0.0) + LABEL_SD_M;
    let usual = -0.5 * (aside_m / sd_m).powi(2) - (TAU * sd_m * sd_m).ln();
    // Behind the hand, or far beside its way.
    log_sum([usual, FAR_SHARE.ln()]) - ALONG_M.ln()
}

/// How far beside its direction of motion a hand touches, as a share of the way left.
const BEND: f64 = 0.25;

/// Density of a point by a Gaussian with a tail.
fn log_tailed(gaussian: &Gaussian, point_m: DVec3, tail: f64, stretch: f64) -> f64 {
    let usual = (1.0 - tail).ln() + gaussian.log_density(point_m);
    let astray = gaussian
        .stretched(stretch)
        .map_or(f64::NEG_INFINITY, |g| tail.ln() + g.log_density(point_m));
    log_sum([usual, astray])
}

#[derive(Debug, Default)]
struct Collected {
    rows: Vec<Row>,
    touches: usize,
}

/// Sums over rows for one phase.
type Counts = [[f64; 6]; LOOK_AGES_S.len()];

impl Collected {
    /// All rows of one touch, phase and age together weigh as much as one.
    fn weigh(&mut self) {
        let cell = |row: &Row| (row.touch, row.phase as usize, nearest(row.age_s));
        let mut counts = std::collections::BTreeMap::new();
        for row in &self.rows {
            *counts.entry(cell(row)).or_insert(0.0) += 1.0;
        }
        for row in &mut self.rows {
            row.weight = counts
                .get(&cell(row))
                .map_or(0.0, |count: &f64| count.recip());
        }
    }

    /// One round of expectation maximisation from `model`; `start` is what is believed without data.
    fn improved(&self, start: &GazeModel, model: &GazeModel) -> GazeModel {
        let mut counts = [[[0.0; 6]; LOOK_AGES_S.len()]; 4];
        let mut on = Spread::default();
        let mut off = Spread::default();
        let mut rest = PlaceSums::default();
        for row in &self.rows {
            let shares = row.responsibilities(model);
            for (i, &share) in shares.iter().enumerate() {
                let weight = row.weight * share;
                for (node, part) in nodes(row.age_s) {
                    counts[row.phase as usize][node][i] += weight * part;
                }
                let (on_now, on_before) = (i % 3 == 0, i % 3 == 1);
                for (look, is_on) in [
                    (row.now, on_now),
                    (row.before.map(|(angle, _)| angle), on_before),
                ] {
                    let Some(angle) = look else { continue };
                    if is_on { &mut on } else { &mut off }.add(weight, &angle);
                }
                if i >= 3 && row.log_ahead.is_none() {
                    rest.add(weight, row.from_rest);
                }
            }
        }
        let on_target_sd_rad = on.sd_rad(start.on_target_sd_rad).max(1e-3);
        let elsewhere_sd_rad = off
            .sd_rad(start.elsewhere_sd_rad)
            .clamp(2.0 * on_target_sd_rad, WIDEST_RAD);
        let mut looks = LookTable::default();
        for phase in ReachPhase::ALL {
            let i = phase as usize;
            looks.shares[i] = phase_shares(&counts[i], &start.looks.shares[i]);
        }
        GazeModel {
            on_target_sd_rad,
            elsewhere_sd_rad,
            looks,
            rest: rest.pulled(start),
            ..*model
        }
    }
}

/// The shares of a phase at every age, from weighted counts.
fn phase_shares(counts: &Counts, start: &Counts) -> Counts {
    let mut pooled = [0.0; 6];
    for row in counts {
        for (sum, count) in pooled.iter_mut().zip(row) {
            *sum += count;
        }
    }
    let mean = |i: usize| start.iter().map(|row| row[i]).sum::<f64>() / start.len() as f64;
    let pooled = pulled(&pooled, &std::array::from_fn(mean), PULL_OF_START);
    std::array::from_fn(|node| pulled(&counts[node], &pooled, PULL_OF_PHASE))
}

/// Shares by counts, with some counts more that are divided as before.
fn pulled(counts: &[f64; 6], before: &[f64; 6], strength: f64) -> [f64; 6] {
    let total: f64 = counts.iter().sum::<f64>() + strength;
    std::array::from_fn(|i| (counts[i] + strength * before[i]) / total)
}

/// The age at which shares are kept that is nearest.
fn nearest(age_s: f64) -> usize {
    let [(a, x), (b, _)] = nodes(age_s);
    if x >= 0.5 { a } else { b }
}

impl Row {
    /// How probable each of the six cases is, the contact being known.
    fn responsibilities(&self, model: &GazeModel) -> [f64; 6] {
        let fade = self.before.map_or(0.0, |(_, fade)| fade);
        let shares = model.looks.at(self.phase, self.age_s);
        let shares = shares.among(self.now.is_some(), fade).to_array();
        let log_anew = model
            .rest
            .about(DVec3::ZERO)
            .map_or(f64::NEG_INFINITY, |g| {
                log_tailed(&g, self.from_rest, FAR_SHARE, FAR_STRETCH)
            });
        let density =
            |look: Option<Angle>, sd_rad: f64| look.map_or(0.0, |a| a.log_density(sd_rad));
        let anywhere = |look: Option<Angle>| look.map_or(0.0, |_| -LOOKS_SR.ln());
        let along = |look: Option<Angle>| look.map_or(0.0, |a| a.log_along);
        let before = self.before.map(|(angle, _)| angle);
        let [on, off] = [model.on_target_sd_rad, model.elsewhere_sd_rad];
        let (now_on, now_off) = (density(self.now, on), density(self.now, off));
        let (before_on, before_off) = (density(before, on), density(before, off));
        let anew = anywhere(self.now) + anywhere(before);
        let mut logs = [
            self.log_as_moves + now_on + before_off,
            self.log_as_moves + now_off + before_on,
            self.log_as_moves + now_off + before_off,
            // The eyes rest anywhere, and what is touched lies on their line.
            anywhere(self.now) + now_on + along(self.now) + anywhere(before) + self.log_changed,
            anew + before_on + along(before),
            anew + self.log_ahead.unwrap_or(log_anew),
        ];
        for (log, share) in logs.iter_mut().zip(shares) {
            *log += share.ln();
        }
        let total = log_sum(logs);
        if total == f64::NEG_INFINITY {
            return [0.0; 6];
        }
        logs.map(|log| (log - total).exp())
    }
}

/// Weighted squares of angles.
#[derive(Debug, Clone, Copy, Default)]
struct Spread {
    weight: f64,
    /// Of the angle in each of two directions, less the noise of the tracker.
    square: f64,
}

impl Spread {
    fn add(&mut self, weight: f64, angle: &Angle) {
        self.weight += weight;
        self.square += weight * (0.5 * angle.rad * angle.rad - angle.noise_rad * angle.noise_rad);
    }

    /// With one pseudo-sample at the start value, which keeps a spread without samples where it was.
    fn sd_rad(&self, start_rad: f64) -> f64 {
        ((self.square + start_rad * start_rad) / (self.weight + 1.0))
            .max(0.0)
            .sqrt()
    }
}

/// Weighted moments of places.
#[derive(Debug, Clone, Copy, Default)]
struct PlaceSums {
    weight: f64,
    first: DVec3,
    second: DMat3,
}

impl PlaceSums {
    fn add(&mut self, weight: f64, x: DVec3) {
        self.weight += weight;
        self.first += x * weight;
        self.second += square(x) * weight;
    }

    /// Moments with some pseudo-samples of the start.
    fn pulled(&self, start: &GazeModel) -> super::resting_hand::RestingHand {
        let before = start.rest;
        let total = self.weight + PULL_OF_REST;
        let mean_m = (self.first + before.mean_m * PULL_OF_REST) / total;
        let second = self.second + (before.covariance_m2 + square(before.mean_m)) * PULL_OF_REST;
        super::resting_hand::RestingHand {
            mean_m,
            covariance_m2: second * total.recip() + square(mean_m) * -1.0,
        }
    }
}

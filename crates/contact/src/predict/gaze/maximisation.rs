//! Expectation maximisation over what was seen of touches whose contacts are known.

use super::super::gaussian::Gaussian;
use super::super::hand::phase::{PHASES, ReachPhase};
use super::memory::Look;
use super::model::GazeModel;
use super::resting_hand::RestingHand;
use super::shares::{LOOK_AGES_S, LookTable, Shares, nodes};
use super::weights::{FAR_SHARE, FAR_STRETCH, LOOKS_SR, log_elsewhere, log_sum};
use crate::matrices::square;
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Larger angles are clipped to this, rad: the two spreads are those of a plane.
pub(super) const WIDEST_RAD: f64 = 1.5;

/// Error of the contacts that are learnt from, in each axis, m: a tracked tip is a point inside the finger.
pub(super) const LABEL_SD_M: f64 = 0.008;

/// Shares of an age are pulled towards those of the phase as if by this many touches, and those of the phase towards what they
/// were as if by this many.
const PULL_OF_PHASE: f64 = 4.0;
const PULL_OF_START: f64 = 2.0;
/// The same for the place of contacts about a resting hand.
const PULL_OF_REST: f64 = 5.0;

/// A line of sight beside the true contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Angle {
    rad: f64,
    noise_rad: f64,
    /// Logarithm of the density of the contact along the line, given that it is on it, sr/m³.
    log_along: f64,
}

/// What is touched lies somewhere along a line of sight, over this length, m.
const ALONG_M: f64 = 1.2;
/// Nobody touches a place nearer to the eyes than this, m.
const NEAREST_M: f64 = 0.1;

impl Angle {
    pub(super) fn new(look: &Look, contact_m: DVec3) -> Self {
        let to_contact = contact_m - look.ray.origin_m;
        Self {
            rad: look.ray.direction.angle_between(to_contact).min(WIDEST_RAD),
            noise_rad: look.noise_rad,
            log_along: -(ALONG_M * to_contact.length_squared().max(NEAREST_M * NEAREST_M)).ln(),
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
pub(super) struct Row {
    pub(super) touch: usize,
    pub(super) phase: ReachPhase,
    pub(super) age_s: f64,
    /// How much the eyes rest in pauses where they rest now, in [0, 1]; `None` while that is not known.
    pub(super) idle: Option<f64>,
    pub(super) weight: f64,
    /// Logarithm of the density of the contact by the estimate, per m³.
    pub(super) log_as_moves: f64,
    /// The same by the motion alone, [`by_motion_alone`](super::super::hand::place::by_motion_alone).
    pub(super) log_by_motion: f64,
    /// [`GazeModel::log_changed`].
    pub(super) log_changed: f64,
    pub(super) from_rest: DVec3,
    /// Logarithm of its density by the direction of a moving hand alone, per m³.
    pub(super) log_ahead: Option<f64>,
    pub(super) now: Option<Angle>,
    /// The look before, and how much of it is left.
    pub(super) before: Option<(Angle, f64)>,
}

/// Logarithm of the density of a contact by the direction of motion: ahead at any distance, beside it by a share of that.
pub(super) fn log_ahead(to_contact: DVec3, ahead: DVec3) -> f64 {
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
pub(super) fn log_tailed(gaussian: &Gaussian, point_m: DVec3, tail: f64, stretch: f64) -> f64 {
    let usual = (1.0 - tail).ln() + gaussian.log_density(point_m);
    let astray = gaussian
        .stretched(stretch)
        .map_or(f64::NEG_INFINITY, |g| tail.ln() + g.log_density(point_m));
    log_sum([usual, astray])
}

/// All that was seen.
#[derive(Debug, Default)]
pub(super) struct Collected {
    pub(super) rows: Vec<Row>,
    pub(super) touches: usize,
}

/// Sums over rows for one phase.
type Counts = [[f64; 6]; LOOK_AGES_S.len()];

impl Collected {
    /// All rows of one touch, phase and age together weigh as much as one.
    pub(super) fn weigh(&mut self) {
        let cell = |row: &Row| (row.touch, row.phase as usize, nearest(row.age_s));
        let mut counts = BTreeMap::new();
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
    pub(super) fn improved(&self, start: &GazeModel, model: &GazeModel) -> GazeModel {
        let none: Shares = [[[0.0; 6]; LOOK_AGES_S.len()]; PHASES];
        let (mut counts, mut by_idle) = (none, [none; 2]);
        let mut on = Spread::default();
        let mut off = Spread::default();
        let mut rest = PlaceSums::default();
        for row in &self.rows {
            let shares = row.responsibilities(model);
            for (i, &share) in shares.iter().enumerate() {
                let weight = row.weight * share;
                for (node, part) in nodes(row.age_s) {
                    counts[row.phase as usize][node][i] += weight * part;
                    for (counts, part_of) in by_idle.iter_mut().zip(row.idle_parts()) {
                        counts[row.phase as usize][node][i] += weight * part * part_of;
                    }
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
            for (k, counts) in by_idle.iter().enumerate() {
                // Without such looks, as for all.
                looks.by_idle[k][i] = phase_shares(&counts[i], &looks.shares[i]);
            }
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
    /// How much it counts for looks where the eyes rest in no pause, and in every one.
    fn idle_parts(&self) -> [f64; 2] {
        self.idle.map_or([0.0; 2], |idle| [1.0 - idle, idle])
    }

    /// How probable each of the six cases is, the contact being known.
    fn responsibilities(&self, model: &GazeModel) -> [f64; 6] {
        let fade = self.before.map_or(0.0, |(_, fade)| fade);
        let shares = model.looks.of_look(self.phase, self.age_s, self.idle);
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
        let elsewhere =
            |look: Option<Angle>| look.map_or(0.0, |angle| log_elsewhere(angle.log_density(off)));
        let (now_on, now_off) = (density(self.now, on), elsewhere(self.now));
        let (before_on, before_off) = (density(before, on), elsewhere(before));
        let anew = anywhere(self.now) + anywhere(before);
        let mut logs = [
            self.log_by_motion + now_on + before_off,
            self.log_by_motion + now_off + before_on,
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
    fn pulled(&self, start: &GazeModel) -> RestingHand {
        let before = start.rest;
        let total = self.weight + PULL_OF_REST;
        let mean_m = (self.first + before.mean_m * PULL_OF_REST) / total;
        let second = self.second + (before.covariance_m2 + square(before.mean_m)) * PULL_OF_REST;
        RestingHand {
            mean_m,
            covariance_m2: second * total.recip() + square(mean_m) * -1.0,
        }
    }
}

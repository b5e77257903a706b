//! Units and channel rates of a recording, inferred from its rows.

use super::in_memory::{Quantity, Recording};
use crate::hand_point::HandPoint;
use glam::DVec3;

/// Typical lengths, m: from the palm to the furthest tip, and across a reach.
const HAND_M: f64 = 0.12;
const RANGE_M: f64 = 0.8;

/// Lengths above the first multiple of the typical ones are taken as centimetres, above the second as millimetres. The multiples lie between the
/// ratios of the units, 1, 100 and 1000.
const CENTIMETRES: f64 = 10.0;
const MILLIMETRES: f64 = 316.0;

/// No hand is faster than this for one twentieth of the time, m/s: twice the peak of fast reaches.
const FAST_M_PER_S: f64 = 10.0;

/// Range of sample periods of hand trackers, s.
const SLOWEST_S: f64 = 0.9;
const FASTEST_S: f64 = 5e-4;

/// The probable units of a recording that is not in metres and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitHint {
    /// Metres per position unit: 0.01 or 0.001; `None` if it is probably metres.
    pub metres: Option<f64>,
    /// Seconds per time unit: 1e-3, 1e-6 or 1e-9; `None` if it is probably seconds.
    pub seconds: Option<f64>,
}

impl Recording {
    /// Units in which the motion is plausible for a person; `None` if metres and seconds are.
    #[must_use]
    pub fn unit_hint(&self) -> Option<UnitHint> {
        let period = median(self.intervals(|_| true)).unwrap_or(0.0);
        let seconds = (period >= SLOWEST_S).then(|| {
            let mut units = [1e-3, 1e-6, 1e-9].into_iter();
            units.find(|unit| (FASTEST_S..SLOWEST_S).contains(&(period * unit)))
        });
        let seconds = seconds.flatten();
        let times_typical = self.times_typical_length(seconds.unwrap_or(1.0));
        let metres = match times_typical {
            x if x >= MILLIMETRES => Some(0.001),
            x if x >= CENTIMETRES => Some(0.01),
            _ => None,
        };
        let hint = UnitHint { metres, seconds };
        (metres.is_some() || seconds.is_some()).then_some(hint)
    }

    /// Converts positions and times, given metres and seconds per unit.
    pub fn scale(&mut self, metres: f64, seconds: f64) {
        for sample in &mut self.samples {
            sample.frame.t_s *= seconds;
            for quantity in Quantity::ALL {
                if quantity != Quantity::Gaze {
                    sample.set(quantity, sample.get(quantity).map(|at| at * metres));
                }
            }
        }
    }

    /// Interpolates channels logged at a lower rate than the hand: the head between any two rows that have it, gaze across its own interval.
    /// Returns the number of rows in which a head was added.
    pub fn fill_slow_channels(&mut self) -> usize {
        let heads = |all: &Self| all.frames().filter(|frame| frame.head_m.is_some()).count();
        let before = heads(self);
        let period_s = median(self.intervals(|_| true)).unwrap_or(0.0);
        let gaze_s = median(self.intervals(|i| self.samples[i].frame.gaze.is_some()));
        // Missing gaze at the rate of the hand is a blink.
        let slow_s = gaze_s.filter(|&gaze_s| gaze_s > 1.5 * period_s);
        let mut samples = self.samples.clone();
        self.fill(Quantity::Head, self.duration_s(), &mut samples);
        if let Some(gaze_s) = slow_s {
            self.fill(Quantity::Gaze, 1.5 * gaze_s, &mut samples);
        }
        self.samples = samples;
        heads(self) - before
    }

    /// Times between neighbouring selected samples, s.
    fn intervals(&self, counts: impl Fn(usize) -> bool) -> Vec<f64> {
        let counted = (0..self.samples.len()).filter(|&i| counts(i));
        let times: Vec<f64> = counted.map(|i| self.samples[i].frame.t_s).collect();
        times.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }

    /// Lengths relative to typical ones: by the hand size; otherwise by the range of the motion, if it is too fast for a person.
    fn times_typical_length(&self, seconds: f64) -> f64 {
        let hands = self.frames().map(|frame| frame.points());
        let sizes = hands.filter_map(|points| {
            let seen: Vec<DVec3> = points.into_iter().flatten().collect();
            let from_first = seen.iter().skip(1).map(|p| p.distance(seen[0]));
            from_first.max_by(f64::total_cmp)
        });
        if let Some(size) = median(sizes.collect()) {
            return size / HAND_M;
        }
        let point = self.steadiest_point();
        point.map_or(0.0, |point| self.times_typical_range(point, seconds))
    }

    fn times_typical_range(&self, point: HandPoint, seconds: f64) -> f64 {
        let seen = self
            .frames()
            .filter_map(|frame| Some((frame.t_s, frame.point(point)?)));
        let seen: Vec<(f64, DVec3)> = seen.collect();
        let speed = |pair: &[(f64, DVec3)]| {
            pair[1].1.distance(pair[0].1) / (seconds * (pair[1].0 - pair[0].0))
        };
        let mut speeds: Vec<f64> = seen.windows(2).map(speed).collect();
        speeds.sort_by(f64::total_cmp);
        let fast = speeds.get(speeds.len() * 19 / 20);
        if fast.is_none_or(|&fast| fast < FAST_M_PER_S) {
            return 0.0;
        }
        let ends = seen.iter().map(|&(_, at)| (at, at));
        let ends = ends.reduce(|(low, high), (a, b)| (low.min(a), high.max(b)));
        ends.map_or(0.0, |(low, high)| low.distance(high) / RANGE_M)
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

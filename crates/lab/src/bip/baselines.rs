//! Predictions of where a hand ends that use no model of the motion, or next to none.

use glam::DVec3;

/// Velocities are straight lines through this much of the past, s.
const VELOCITY_WINDOW_S: f64 = 0.06;

/// What was seen of a motion so far: strictly increasing times, s, one point each, m.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// Time stamps, s.
    pub times_s: &'a [f64],
    /// Positions, m; at least one.
    pub points_m: &'a [DVec3],
}

impl Seen<'_> {
    fn now(&self) -> (f64, DVec3) {
        let last = self.times_s.len() - 1;
        (self.times_s[last], self.points_m[last])
    }

    /// Slope of the straight line through the last samples, m/s; zero for a single one.
    #[must_use]
    pub fn velocity_m_per_s(&self) -> DVec3 {
        let n = self.times_s.len();
        let since = self.now().0 - VELOCITY_WINDOW_S;
        let first = self
            .times_s
            .partition_point(|t| *t < since)
            .min(n.saturating_sub(2));
        let (times, points) = (&self.times_s[first..], &self.points_m[first..]);
        let count = times.len() as f64;
        let mean_t = times.iter().sum::<f64>() / count;
        let mean_p = points.iter().sum::<DVec3>() / count;
        let mut slope = DVec3::ZERO;
        let mut spread = 0.0;
        for (t, p) in times.iter().zip(points) {
            slope += (t - mean_t) * (*p - mean_p);
            spread += (t - mean_t).powi(2);
        }
        if spread > 0.0 {
            slope / spread
        } else {
            DVec3::ZERO
        }
    }
}

/// The hand stays where it is.
#[must_use]
pub fn hold(seen: Seen<'_>) -> DVec3 {
    seen.now().1
}

/// The hand goes on as it goes now, and stops at a time on the clock of the samples, s. If that is
/// over, it stays where it is.
#[must_use]
pub fn constant_velocity(seen: Seen<'_>, arrival_s: f64) -> DVec3 {
    let (t_s, p_m) = seen.now();
    p_m + (arrival_s - t_s).max(0.0) * seen.velocity_m_per_s()
}

/// Share of a minimum-jerk motion that is done at a share of its time; constant outside.
///
/// Source: [Flash 1985], `10 τ³ - 15 τ⁴ + 6 τ⁵`.
#[must_use]
pub fn minimum_jerk_share(tau: f64) -> f64 {
    let t = tau.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

/// Motions that [`minimum_jerk`] considers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MinimumJerkSearch {
    /// Shortest and longest duration, s.
    pub durations_s: [f64; 2],
    /// Earliest and latest start, as a share of the duration, on the clock of the samples.
    pub starts: [f64; 2],
    /// Steps of both.
    pub steps: usize,
}

impl MinimumJerkSearch {
    /// Durations of motions seen before. The start may lie before the first sample: who cuts by
    /// speed misses the first, slow tenth.
    #[must_use]
    pub fn from_durations(durations_s: impl IntoIterator<Item = f64>) -> Self {
        let range = durations_s
            .into_iter()
            .fold([f64::INFINITY, 0.0_f64], |[lo, hi], d| {
                [lo.min(d), hi.max(d)]
            });
        Self {
            durations_s: range,
            starts: [-0.2, 0.1],
            steps: 31,
        }
    }
}

/// The minimum-jerk motion nearest to what was seen: its end.
///
/// Duration and start on a grid; start and end points are the least-squares solution for each. A
/// motion that is hardly begun fits almost any duration: its end is then as good as arbitrary.
#[must_use]
pub fn minimum_jerk(seen: Seen<'_>, search: &MinimumJerkSearch) -> DVec3 {
    let n = seen.times_s.len() as f64;
    let mean_p = seen.points_m.iter().sum::<DVec3>() / n;
    let mut best = (f64::INFINITY, hold(seen));
    let grid = |[lo, hi]: [f64; 2], i: usize| lo + (hi - lo) * i as f64 / (search.steps - 1) as f64;
    for i in 0..search.steps {
        let duration_s = grid(search.durations_s, i);
        for j in 0..search.steps {
            let start_s = seen.times_s[0] + duration_s * grid(search.starts, j);
            let shares: Vec<f64> = seen
                .times_s
                .iter()
                .map(|t| minimum_jerk_share((t - start_s) / duration_s))
                .collect();
            // p = a + b s on every axis at once.
            let mean_s = shares.iter().sum::<f64>() / n;
            let mut cross = DVec3::ZERO;
            let mut spread = 0.0;
            for (s, p) in shares.iter().zip(seen.points_m) {
                cross += (s - mean_s) * (*p - mean_p);
                spread += (s - mean_s).powi(2);
            }
            if spread < 1e-12 {
                continue;
            }
            let b = cross / spread;
            let squares: f64 = shares
                .iter()
                .zip(seen.points_m)
                .map(|(s, p)| (*p - mean_p - (s - mean_s) * b).length_squared())
                .sum();
            if squares < best.0 {
                best = (squares, mean_p + (1.0 - mean_s) * b);
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(f: impl Fn(f64) -> DVec3, until_s: f64) -> (Vec<f64>, Vec<DVec3>) {
        // Uneven steps: real trackers drop frames.
        let mut times = vec![0.0];
        while times[times.len() - 1] + 0.02 <= until_s {
            let step = if times.len() % 3 == 0 { 0.02 } else { 0.01 };
            times.push(times[times.len() - 1] + step);
        }
        let points = times.iter().map(|t| f(*t)).collect();
        (times, points)
    }

    #[test]
    fn constant_velocity_is_exact_on_a_straight_uniform_motion() {
        let line = |t: f64| DVec3::new(0.1, -0.2, 1.0) + t * DVec3::new(0.7, 0.1, -0.4);
        for until_s in [0.0, 0.03, 0.5] {
            let (times_s, points_m) = samples(line, until_s);
            let seen = Seen {
                times_s: &times_s,
                points_m: &points_m,
            };
            let end = constant_velocity(seen, 0.9);
            let truth = if until_s == 0.0 { line(0.0) } else { line(0.9) };
            assert!(end.distance(truth) < 1e-12, "{until_s}: {end}");
            // Nothing is undone after the arrival.
            assert_eq!(constant_velocity(seen, -1.0), hold(seen));
        }
    }

    #[test]
    fn minimum_jerk_is_exact_on_a_minimum_jerk_motion() {
        let (from, to) = (DVec3::new(0.2, 0.0, 1.1), DVec3::new(0.6, 0.3, 1.3));
        // Duration and start lie on the grid.
        let search = MinimumJerkSearch {
            durations_s: [0.5, 1.1],
            starts: [-0.2, 0.1],
            steps: 31,
        };
        let motion = |t: f64| from + (to - from) * minimum_jerk_share((t + 0.1 * 0.8) / 0.8);
        for until_s in [0.3, 0.5, 0.8] {
            let (times_s, points_m) = samples(motion, until_s);
            let seen = Seen {
                times_s: &times_s,
                points_m: &points_m,
            };
            let end = minimum_jerk(seen, &search);
            assert!(end.distance(to) < 1e-9, "{until_s}: {end}");
        }
    }

    #[test]
    fn a_hand_that_rests_stays_where_it_is() {
        let (times_s, points_m) = samples(|_| DVec3::splat(0.3), 0.4);
        let seen = Seen {
            times_s: &times_s,
            points_m: &points_m,
        };
        let search = MinimumJerkSearch::from_durations([0.5, 1.0]);
        for end in [
            hold(seen),
            constant_velocity(seen, 1.0),
            minimum_jerk(seen, &search),
        ] {
            assert!(end.distance(DVec3::splat(0.3)) < 1e-12);
        }
    }
}

//! Where the touching point of a hand is, also while it is not seen, and how fast it goes.

use crate::{HandFrame, HandPoint, LabelledReach};
use glam::DVec3;

/// The touching point over one reach; while it is missing another point stands in, shifted by the last
/// offset between the two, or by the usual one until there is one.
#[derive(Debug, Clone)]
pub(crate) struct TouchingPoint {
    point: HandPoint,
    /// From each point of the hand to the touching one, m.
    usual_m: [Option<DVec3>; 6],
    /// The same when both were last seen in this reach.
    last_m: [Option<DVec3>; 6],
}

impl TouchingPoint {
    pub(crate) fn new(point: HandPoint, usual_m: [Option<DVec3>; 6]) -> Self {
        Self {
            point,
            usual_m,
            last_m: [None; 6],
        }
    }

    pub(crate) fn begin(&mut self) {
        self.last_m = [None; 6];
    }

    /// Place of the touching point by what is seen of the hand, m.
    pub(crate) fn locate(&mut self, seen_m: &[Option<DVec3>; 6]) -> Option<DVec3> {
        let Some(own_m) = seen_m[self.point as usize] else {
            return HandPoint::BY_CONTACT
                .into_iter()
                .find_map(|other| Some(seen_m[other as usize]? + self.offset_m(other)?));
        };
        for (last_m, seen_m) in self.last_m.iter_mut().zip(seen_m) {
            *last_m = seen_m.map(|seen_m| own_m - seen_m).or(*last_m);
        }
        Some(own_m)
    }

    /// From another point of the hand to the touching point, m; `None` where both were never seen.
    pub(crate) fn offset_m(&self, other: HandPoint) -> Option<DVec3> {
        self.last_m[other as usize].or(self.usual_m[other as usize])
    }
}

/// Means of a point of the hand less every other over all samples that show both, m.
pub(crate) fn mean_offsets_m(reaches: &[LabelledReach], point: HandPoint) -> [Option<DVec3>; 6] {
    let offset = |f: &HandFrame, other| Some(f.point(point)? - f.point(other)?);
    HandPoint::ALL
        .map(|other| mean(reaches, |f| offset(f, other)))
        .map(|offset_m| offset_m.filter(|o| o.is_finite()))
}

/// Mean of what some samples of the reaches have.
pub(crate) fn mean(
    reaches: &[LabelledReach],
    value: impl Fn(&HandFrame) -> Option<DVec3>,
) -> Option<DVec3> {
    let values = reaches.iter().flat_map(|r| &r.frames).filter_map(value);
    let (sum, n) = values.fold((DVec3::ZERO, 0.0), |(s, n), v| (s + v, n + 1.0));
    (n > 0.0).then(|| sum / n)
}

/// Slope of the straight line through places, m, at times, s; zero for a single one.
pub(crate) fn slope(samples: impl Iterator<Item = (f64, DVec3)> + Clone) -> DVec3 {
    let (mut count, mut t_sum, mut p_sum) = (0.0, 0.0, DVec3::ZERO);
    let first_s = samples.clone().next().map_or(0.0, |s| s.0);
    for (t, p) in samples.clone() {
        (count, t_sum, p_sum) = (count + 1.0, t_sum + (t - first_s), p_sum + p);
    }
    let (t_mean, p_mean) = (t_sum / count, p_sum / count);
    let (mut cross, mut spread) = (DVec3::ZERO, 0.0);
    for (t, p) in samples {
        let dt = t - first_s - t_mean;
        cross += dt * (p - p_mean);
        spread += dt * dt;
    }
    if spread > 0.0 {
        cross / spread
    } else {
        DVec3::ZERO
    }
}

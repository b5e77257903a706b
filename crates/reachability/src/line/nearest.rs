//! The reachable point of a wall nearest to an unreachable one.

use super::exact::ExactSolver;
use super::family::size_m;
use crate::error::{ReachabilityError, Result};
use crate::wall::{WallPlane, WallPoint};

/// Spacing of the lines of the first sweep, relative to the arm's length. The sweep may miss a reachable part
/// that lies between two lines and is lower than this.
const SWEEP: f64 = 0.015;

/// Reduction factor of a golden-section search.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl ExactSolver {
    /// The point of the wall's reachable set that is nearest to `at`: `at` itself if it is
    /// reachable, `None` if no point of the wall is.
    ///
    /// Exact along each line; heights are swept from `at` outwards in steps of 1.5 % of the arm's
    /// length, and the best height is refined to ten times the solver's accuracy. The returned
    /// point is reachable: if the interval is long enough, the point is inside its end by the
    /// accuracy.
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn nearest_reachable(&self, plane: &WallPlane, at: WallPoint) -> Result<Option<WallPoint>> {
        if self.is_reachable(&plane.line(at.z_m), at.s_m)? {
            return Ok(Some(at));
        }
        let size = size_m(self.arm());
        let step = SWEEP * size;
        let mut best: Option<(f64, WallPoint)> = None;
        let consider = |z_m: f64, best: &mut Option<(f64, WallPoint)>| {
            let found = self.nearest_on_line(plane, z_m, at)?;
            if let Some(point) = found {
                let distance = point.distance_m(at);
                if best.is_none_or(|(least, _)| distance < least) {
                    *best = Some((distance, point));
                }
            }
            Ok::<_, ReachabilityError>(found.map_or(f64::INFINITY, |p| p.distance_m(at)))
        };
        // Reachable heights are within the arm's length of the base.
        let span = at.z_m.abs() + 2.0 * size;
        for ring in 0..=(span / step).ceil() as usize {
            let rise = ring as f64 * step;
            if best.is_some_and(|(least, _)| rise - step > least) {
                break;
            }
            consider(at.z_m + rise, &mut best)?;
            if ring > 0 {
                consider(at.z_m - rise, &mut best)?;
            }
        }
        let Some((_, coarse)) = best else {
            return Ok(None);
        };
        let (mut lo, mut hi) = (coarse.z_m - step, coarse.z_m + step);
        let (mut a, mut b) = (hi - GOLDEN * (hi - lo), lo + GOLDEN * (hi - lo));
        let (mut at_a, mut at_b) = (consider(a, &mut best)?, consider(b, &mut best)?);
        while hi - lo > 10.0 * self.accuracy_m() {
            if at_a <= at_b {
                (hi, b, at_b) = (b, a, at_a);
                a = hi - GOLDEN * (hi - lo);
                at_a = consider(a, &mut best)?;
            } else {
                (lo, a, at_a) = (a, b, at_b);
                b = lo + GOLDEN * (hi - lo);
                at_b = consider(b, &mut best)?;
            }
        }
        Ok(best.map(|(_, point)| point))
    }

    fn nearest_on_line(
        &self,
        plane: &WallPlane,
        z_m: f64,
        at: WallPoint,
    ) -> Result<Option<WallPoint>> {
        let found = self.line(&plane.line(z_m))?;
        let points = found.intervals.iter().map(|i| {
            let inside = self.accuracy_m().min(0.5 * i.span.length_m());
            let (lo, hi) = (i.span.lo_m + inside, i.span.hi_m - inside);
            WallPoint::new(at.s_m.max(lo).min(hi), z_m)
        });
        Ok(points.min_by(|p, q| p.distance_m(at).total_cmp(&q.distance_m(at))))
    }
}

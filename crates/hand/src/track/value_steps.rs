//! Detects the grid step of tracker values: 0.01 m if positions are printed with two decimals.

use glam::DVec3;

/// Tolerance for whole multiples of the common measure, as a share of it. For comparison: positions in `f32` have errors of 6e-8 m, which on a
/// grid of 1 mm change the squared distance of points 0.03 m apart by 0.004 of the measure.
const WHOLE: f64 = 0.05;

/// Finds the grid step of values that are all whole multiples of one length.
///
/// On a grid, squared distances between positions are whole multiples of the squared step, also after a rotation; positions off a grid have no
/// common measure. A hand at constant speed has one by chance, so a grid is accepted only if points also rest exactly and move on.
#[derive(Debug, Clone, Default)]
pub(crate) struct ValueSteps {
    last: [Option<DVec3>; 6],
    rested: [bool; 6],
    rests: bool,
    /// Common measure of all squared steps, m².
    measure: f64,
}

impl ValueSteps {
    /// Takes the points of a sample.
    pub(crate) fn update(&mut self, points: &[Option<DVec3>; 6]) {
        let kept = self.last.iter_mut().zip(&mut self.rested);
        for ((last, rested), point) in kept.zip(points) {
            let Some(point) = *point else {
                continue;
            };
            if let Some(before) = last.replace(point) {
                let moved = point.distance_squared(before);
                if moved > 0.0 {
                    self.measure = common_measure(self.measure, moved);
                    self.rests |= *rested;
                }
                *rested = moved == 0.0;
            }
        }
    }

    /// The step, m; 0 if unknown.
    pub(crate) fn step_m(&self) -> f64 {
        if self.rests { self.measure.sqrt() } else { 0.0 }
    }
}

/// The largest number such that both are whole multiples of it, within [`WHOLE`] of it.
fn common_measure(a: f64, b: f64) -> f64 {
    let (mut large, mut small) = (a.max(b), a.min(b));
    while small > 0.0 {
        let over = large % small;
        let rest = over.min(small - over);
        if rest <= WHOLE * small {
            return small;
        }
        (large, small) = (small, rest);
    }
    large
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hand that moves back and forth, with rounded and rotated coordinates.
    fn step_m(rounded_m: f64, turn_rad: f64) -> f64 {
        let mut steps = ValueSteps::default();
        for i in 0..4000 {
            let phase = 0.002 * f64::from(i);
            let at = |k: f64| DVec3::new(0.4 * phase.sin(), 0.1 * (phase + k).cos(), 0.3 * k);
            let on_grid = |p: DVec3| match rounded_m > 0.0 {
                true => ((p / rounded_m).round() * rounded_m).as_vec3().as_dvec3(),
                false => p,
            };
            let turn = glam::DQuat::from_rotation_y(turn_rad);
            let points = [0.0, 0.2, 0.5].map(|k| Some(turn * on_grid(at(k))));
            steps.update(&[points[0], points[1], points[2], None, None, None]);
        }
        steps.step_m()
    }

    #[test]
    fn the_step_is_found_also_after_a_turn() {
        for turn_rad in [0.0, 0.7] {
            for wanted_m in [0.01, 0.001] {
                let found_m = step_m(wanted_m, turn_rad);
                assert!((found_m / wanted_m - 1.0).abs() < 0.01, "{found_m}");
            }
            assert!(step_m(0.0, turn_rad) < 1e-6);
        }
    }
}

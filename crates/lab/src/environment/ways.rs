//! The avatar's way from one place to the next: a turn, a smooth curve, a stop.

use glam::DVec2;
use hwall_redirection::wrapped_rad;
use hwall_scene::{Scene, SceneError};

/// Speeds of the joystick: acceleration and braking, m/s², and turning on the spot, rad/s; assumptions.
pub(super) const ACCELERATION_M_PER_S2: f64 = 1.5;
const SPIN_RAD_PER_S: f64 = 1.4;
/// Time between two instants, s.
pub(super) const STEP_S: f64 = 0.02;
/// Points of a curve.
const POINTS: usize = 96;
/// Heights above the floor at which nothing may be near the avatar, m.
const BODY_M: [f64; 3] = [0.4, 1.1, 1.6];

/// The avatar at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Avatar {
    pub(super) t_s: f64,
    pub(super) stand: Stand,
    pub(super) speed_m_per_s: f64,
    pub(super) turn_rad_per_s: f64,
}

/// Where the avatar stands, and where it looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stand {
    pub(super) position_m: DVec2,
    pub(super) heading_rad: f64,
}

/// A curve on the floor with its lengths.
#[derive(Debug, Clone)]
pub(super) struct Way {
    /// Heading at its beginning, rad.
    begin_rad: f64,
    /// Place, and length until there, m.
    points: Vec<(DVec2, f64)>,
    pub(super) end: Stand,
}

impl Way {
    /// From a place, after a turn on the spot, to a stand.
    pub(super) fn new(from_m: DVec2, to: Stand) -> Self {
        let chord = to.position_m - from_m;
        let third_m = chord.length() / 3.0;
        let begin_rad = chord.to_angle();
        let controls = [
            from_m,
            from_m + DVec2::from_angle(begin_rad) * third_m,
            to.position_m - DVec2::from_angle(to.heading_rad) * third_m,
            to.position_m,
        ];
        let mut points: Vec<(DVec2, f64)> = Vec::with_capacity(POINTS + 1);
        let (mut last, mut length_m) = (from_m, 0.0);
        for i in 0..=POINTS {
            let at = bezier(&controls, i as f64 / POINTS as f64);
            length_m += at.distance(last);
            last = at;
            points.push((at, length_m));
        }
        Self {
            begin_rad,
            points,
            end: to,
        }
    }

    pub(super) fn length_m(&self) -> f64 {
        self.points.last().map_or(0.0, |p| p.1)
    }

    /// Is nothing nearer than a body's radius? Near its ends, where the avatar stands before a wall, less is asked.
    pub(super) fn is_free(&self, scene: &Scene, floor_m: f64) -> Result<bool, SceneError> {
        let length_m = self.length_m();
        let mut next_m = 0.0;
        for &(at, passed_m) in &self.points {
            if passed_m < next_m {
                continue;
            }
            next_m = passed_m + 0.08;
            let near_end = passed_m.min(length_m - passed_m) < 0.6;
            let radius_m = if near_end { 0.22 } else { 0.32 };
            if !is_free(scene, floor_m, at, radius_m)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Place and heading at a length, m.
    fn at(&self, length_m: f64) -> (DVec2, f64) {
        let next = self
            .points
            .partition_point(|p| p.1 < length_m)
            .clamp(1, self.points.len() - 1);
        let ((a, a_m), (b, b_m)) = (self.points[next - 1], self.points[next]);
        let share = match b_m > a_m {
            true => ((length_m - a_m) / (b_m - a_m)).clamp(0.0, 1.0),
            false => 0.0,
        };
        // The direction between the middles of two pieces is smooth enough for a turn rate.
        let heading = |from: usize| {
            let to = (from + 1).min(self.points.len() - 1);
            (self.points[to].0 - self.points[to - 1].0).to_angle()
        };
        let (first, last) = (heading(next - 1), heading(next));
        (a.lerp(b, share), first + share * wrapped_rad(last - first))
    }

    /// The avatar along it, from a time and a heading on, at no more than a speed. Returns its instants and when the joystick is let
    /// go.
    pub(super) fn travelled(
        &self,
        from_s: f64,
        from_rad: f64,
        most_m_per_s: f64,
    ) -> (Vec<Avatar>, f64) {
        let mut instants = Vec::new();
        let start_m = self.points[0].0;
        let spin_rad = wrapped_rad(self.begin_rad - from_rad);
        let spin_s = spin_rad.abs() / SPIN_RAD_PER_S;
        let length_m = self.length_m();
        let a = ACCELERATION_M_PER_S2;
        let top = most_m_per_s.min((a * length_m).sqrt());
        let (ramp_s, ramp_m) = (top / a, 0.5 * top * top / a);
        let cruise_s = (length_m - 2.0 * ramp_m).max(0.0) / top;
        let release_s = from_s + spin_s + ramp_s + cruise_s;
        let stop_s = release_s + ramp_s;
        let count = ((stop_s - from_s) / STEP_S).ceil() as usize;
        let mut last_rad = from_rad;
        for i in 0..=count {
            let t_s = (from_s + i as f64 * STEP_S).min(stop_s);
            let driven_s = t_s - from_s - spin_s;
            let (position_m, heading_rad, speed) = if driven_s <= 0.0 {
                let turned = (t_s - from_s) * SPIN_RAD_PER_S;
                (start_m, from_rad + spin_rad.signum() * turned, 0.0)
            } else {
                let left_s = stop_s - t_s;
                let (passed_m, speed) = if driven_s < ramp_s {
                    (0.5 * a * driven_s * driven_s, a * driven_s)
                } else if left_s > ramp_s {
                    (ramp_m + top * (driven_s - ramp_s), top)
                } else {
                    (length_m - 0.5 * a * left_s * left_s, a * left_s)
                };
                let (at_m, heading_rad) = self.at(passed_m);
                (at_m, heading_rad, speed)
            };
            let turned = wrapped_rad(heading_rad - last_rad);
            last_rad = heading_rad;
            let stand = Stand {
                position_m,
                heading_rad,
            };
            instants.push(Avatar {
                t_s,
                stand,
                speed_m_per_s: speed,
                turn_rad_per_s: if i == 0 { 0.0 } else { turned / STEP_S },
            });
        }
        if let Some(last) = instants.last_mut() {
            last.stand = self.end;
        }
        (instants, release_s)
    }
}

fn bezier(c: &[DVec2; 4], t: f64) -> DVec2 {
    let s = 1.0 - t;
    c[0] * (s * s * s) + c[1] * (3.0 * s * s * t) + c[2] * (3.0 * s * t * t) + c[3] * (t * t * t)
}

/// Is nothing within a radius of a body at a place?
pub(super) fn is_free(
    scene: &Scene,
    floor_m: f64,
    at: DVec2,
    radius_m: f64,
) -> Result<bool, SceneError> {
    for height_m in BODY_M {
        let middle_m = at.extend(floor_m + height_m);
        if scene.closest_point(middle_m, radius_m)?.is_some() {
            return Ok(false);
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_avatar_starts_and_stops_where_it_should_and_is_never_too_fast() {
        let to = Stand {
            position_m: DVec2::new(3.0, 2.0),
            heading_rad: 2.0,
        };
        let way = Way::new(DVec2::new(-1.0, 0.5), to);
        for most in [1.0, 2.0, 9.0] {
            let (instants, release_s) = way.travelled(5.0, -2.0, most);
            let (first, last) = (instants[0], instants[instants.len() - 1]);
            assert_eq!(
                (first.t_s, first.stand.position_m, first.speed_m_per_s),
                (5.0, DVec2::new(-1.0, 0.5), 0.0)
            );
            assert!(last.stand == to && last.speed_m_per_s < 1e-9 && release_s < last.t_s);
            for pair in instants.windows(2) {
                let way_m = pair[0].stand.position_m.distance(pair[1].stand.position_m);
                assert!(way_m <= most * STEP_S * 1.01 + 1e-6, "{way_m}");
                assert!(pair[1].turn_rad_per_s.abs() < 8.0);
            }
        }
    }
}

//! Bounds on how far the wrist, the triangle and the tilts of a region differ from those of its centre.

use super::pose_region::PoseRegion;
use crate::srs::branch::Branch;
use crate::srs::circle::{Distances, Slack, Triangle};
use crate::srs::model::SrsArm;
use crate::unreachable::Unreachable;
use glam::DVec3;
use hwall_geometry::Pose;

/// Added to every bound: a hundred times the rounding of the cross products.
const ROUNDING: f64 = 1e-12;

/// Above this bound a limit test decides nothing.
pub(super) const LARGEST_SLACK: f64 = 0.9;

/// The wrist centres of a region.
pub(super) struct Wrists {
    pub(super) flange: Pose,
    pub(super) wrist: DVec3,
    pub(super) length: f64,
    half_sides: [DVec3; 2],
    radius: f64,
    /// Rounding of a distance, m.
    tolerance: f64,
    /// Distances from the shoulder, widened by rounding, m.
    pub(super) shortest: f64,
    pub(super) longest: f64,
    /// Largest `|u' - u|`.
    turn: f64,
    /// Chord of the tool's turn.
    tool_turn: f64,
}

impl Wrists {
    pub(super) fn new(arm: &SrsArm, region: &PoseRegion) -> Option<Self> {
        let flange = arm.flange_pose(&region.center);
        let wrist = arm.wrist_from_shoulder(&flange);
        let length = wrist.length();
        let [a, b] = region.half_sides_m;
        let (mut radius, mut tool_turn) = (region.radius_m, 0.0);
        if region.angle_rad != 0.0 {
            tool_turn = 2.0 * (0.5 * region.angle_rad.min(std::f64::consts::PI)).sin();
            let lever = wrist_from_tool(arm, &region.center, wrist);
            radius += lever * tool_turn;
        }
        let valid =
            radius >= 0.0 && tool_turn >= 0.0 && (radius + a.length() + b.length()).is_finite();
        if !valid {
            return None;
        }
        let corners = [a + b, a - b].map(|half| [wrist - half, wrist + half]);
        let lengths = corners.map(|pair| pair.map(DVec3::length));
        let farthest = lengths.as_flattened().iter().copied().fold(0.0, f64::max);
        let nearest = nearest_on_rectangle(wrist, a, b).length();
        let u = wrist / length;
        let mut turn: f64 = 0.0;
        for (corner, length) in corners.as_flattened().iter().zip(lengths.as_flattened()) {
            turn = turn.max((*corner / *length - u).length_squared());
        }
        turn = turn.sqrt();
        if radius > 0.0 {
            // A ball of radius r at distance D subtends the half angle asin(r/D) <= its tangent.
            let ratio = radius / nearest;
            turn += if ratio < 1.0 {
                ratio / (1.0 - ratio * ratio).sqrt()
            } else {
                f64::INFINITY
            };
        }
        let tolerance = arm.distances.tolerance;
        Some(Self {
            flange,
            wrist,
            length,
            half_sides: region.half_sides_m,
            radius,
            tolerance,
            shortest: nearest - radius - tolerance,
            longest: farthest + radius + tolerance,
            // NaN means that the wrist is on the shoulder. From `turn = 1` on, the corners do not
            // bound the points between them; the distances and tilts remain valid.
            turn: if turn < 1.0 { turn } else { f64::INFINITY },
            tool_turn,
        })
    }

    pub(super) fn elbows(&self, distances: &Distances, holds: impl Fn([f64; 2]) -> bool) -> u8 {
        let [negative, positive] = distances.sides.map(holds);
        (if negative { Branch::ELBOW[0] } else { 0 }) | if positive { Branch::ELBOW[1] } else { 0 }
    }

    /// The bounds of the derivation in module `region`; `None` if they are too large to decide anything.
    pub(super) fn slack(&self, triangles: &Triangles) -> Option<Slack> {
        if self.turn >= LARGEST_SLACK {
            return None;
        }
        let chord = |x: [f64; 2], y: [f64; 2]| {
            let [cos, sin] = [x[0] - y[0], x[1] - y[1]];
            cos * cos + sin * sin
        };
        let reference = &triangles.reference;
        let (mut beta, mut eta): (f64, f64) = (0.0, 0.0);
        for there in triangles.ends.iter().chain(&triangles.turning) {
            beta = beta.max(chord(there.beta, reference.beta));
            eta = eta.max(chord(there.eta, reference.eta));
        }
        let slack = Slack {
            shoulder: self.turn + beta.sqrt() + ROUNDING,
            wrist: self.turn + eta.sqrt() + self.tool_turn + ROUNDING,
        };
        (slack.shoulder < LARGEST_SLACK && slack.wrist < LARGEST_SLACK).then_some(slack)
    }

    /// True if joint 2 or joint 6 exceeds its limit everywhere in the region, at every arm angle.
    ///
    /// `|q2|` is least with the elbow highest: `χ - β`, where χ is the angle of w from the base
    /// axis; Likewise `|q6|` is least at `χ - η`, with χ measured from the tool axis. With `cos χ =
    /// c / L` these are functions of L alone if c, the distance along the axis, takes its largest
    /// value. They are stationary where the other link is parallel to the axis, so the least tilt
    /// over the region is exact. The first-order slack above would instead need ever smaller
    /// regions near a tangency.
    pub(super) fn tilted_too_far(
        &self,
        arm: &SrsArm,
        triangles: &Triangles,
    ) -> Option<Unreachable> {
        let normal = self.flange.rotation().z_axis;
        let (upper, fore) = (arm.distances.upper, arm.distances.fore);
        if self.tool_turn == 0.0 {
            let along = self.along(normal);
            let least = triangles.least_tilt(fore, upper, along, |t| t.eta);
            if least.is_some_and(|cos| arm.windows.tilting[1].is_beyond(cos)) {
                return Some(Unreachable::WristLimit);
            }
        }
        let along = self.along(DVec3::Z);
        let least = triangles.least_tilt(upper, fore, along, |t| t.beta);
        least
            .is_some_and(|cos| arm.windows.tilting[0].is_beyond(cos))
            .then_some(Unreachable::ShoulderLimit)
    }

    /// Largest distance of the region's wrist centres along an axis, m.
    fn along(&self, axis: DVec3) -> f64 {
        let [a, b] = self.half_sides;
        self.wrist.dot(axis) + a.dot(axis).abs() + b.dot(axis).abs() + self.radius + self.tolerance
    }
}

/// Triangles of shoulder, elbow and wrist over a range of lengths.
pub(super) struct Triangles {
    /// At a length within the range.
    pub(super) reference: Triangle,
    /// At the ends of the range.
    ends: [Triangle; 2],
    /// Where one of the angles has its maximum, if within the range.
    turning: Option<Triangle>,
    range: [f64; 2],
}

impl Triangles {
    pub(super) fn new(distances: &Distances, lo: f64, hi: f64, length: f64) -> Self {
        let (a, b) = (distances.upper, distances.fore);
        // If the links differ, the angle at the longer link's end is largest at this length.
        let turning = (a * a - b * b).abs().sqrt();
        Self {
            reference: Triangle::from_sides(a, b, length.clamp(lo, hi)),
            ends: [lo, hi].map(|length| Triangle::from_sides(a, b, length)),
            turning: (lo < turning && turning < hi).then(|| Triangle::from_sides(a, b, turning)),
            range: [lo, hi],
        }
    }

    /// Cosine of the least tilt `χ - angle` of the link `near` (the other is `far`) with `cos χ =
    /// along / L`; `None` if the link can lie along the axis.
    #[inline]
    fn least_tilt(
        &self,
        near: f64,
        far: f64,
        along: f64,
        angle: impl Fn(&Triangle) -> [f64; 2],
    ) -> Option<f64> {
        let mut largest: f64 = -1.0;
        let mut visit = |length: f64, [cos, sin]: [f64; 2]| {
            let cos_chi = along / length;
            // χ at or below the angle: the link can be turned onto the axis.
            if cos_chi >= cos {
                return false;
            }
            let cos_chi = cos_chi.max(-1.0);
            let sin_chi = (1.0 - cos_chi * cos_chi).sqrt();
            largest = largest.max(cos_chi * cos + sin_chi * sin);
            true
        };
        for end in &self.ends {
            if !visit(end.length, angle(end)) {
                return None;
            }
        }
        for sign in [-1.0, 1.0] {
            let square = near * near - far * far + sign * 2.0 * far * along;
            let there = square.max(0.0).sqrt();
            if self.range[0] < there && there < self.range[1] {
                // `beta` is the angle at the near link's end.
                let seen = Triangle::from_sides(near, far, there);
                if !visit(there, seen.beta) {
                    return None;
                }
            }
        }
        Some(largest)
    }
}

/// Distance from the tool point to the wrist centre, m.
fn wrist_from_tool(arm: &SrsArm, base_from_tool: &Pose, wrist: DVec3) -> f64 {
    let shoulder = DVec3::Z * arm.geometry().d_bs_m;
    (base_from_tool.position_m() - shoulder - wrist).length()
}

/// The point of `center ± a ± b` nearest to the origin; a and b perpendicular or zero.
fn nearest_on_rectangle(center: DVec3, a: DVec3, b: DVec3) -> DVec3 {
    let step = |side: DVec3| {
        let square = side.length_squared();
        if square > 0.0 {
            side * (-center.dot(side) / square).clamp(-1.0, 1.0)
        } else {
            DVec3::ZERO
        }
    };
    center + step(a) + step(b)
}

//! Verdicts that hold for a whole set of poses at once, with proof.
//!
//! Let a configuration hold the central pose with the elbow at some arm angle. Anywhere else in
//! the region the wrist centre has another direction `u` and another distance `L` from the
//! shoulder. Carry the arm along: turn it by the smallest rotation that takes the old `u` to the
//! new one, then turn the upper arm within the triangle's plane to the new angle β, the forearm to
//! the new angle η. With `R03 = F Ry(-β)` and `R04 = F Ry(η)` this gives
//! `R03' = Q R03 Ry(β - β')` and `R47' = Ry(η' - η)ᵀ R04ᵀ Qᵀ P R`, where P is the turn of the tool.
//! A rotation by an angle moves a unit vector by at most the chord of that angle, so
//!
//! - every row and column of `R03` moves by at most `|u' - u| + chord(β' - β)`,
//! - every row and column of `R47` by at most `|u' - u| + chord(η' - η) + chord(P)`.
//!
//! The limits are tested as cross products of such vectors with fixed unit vectors (`window.rs`),
//! which change by no more. Hence: if some arm angle passes all tests *narrowed* by these bounds
//! the whole region is reachable; if none passes them *widened* by the bounds (carrying the arm is
//! a bijection of the arm angles), no pose of the region is. The bounds need no factor of safety;
//! `ROUNDING` covers the arithmetic. β and η are functions of L alone, monotone but for
//! one turning point, so their extremes over the region's distances are exact, also at full stretch
//! where their slope is infinite.

use crate::circle::{Direction, ElbowCircle, Slack, Triangle, wrist_from_shoulder};
use crate::window::{CROSS_TOLERANCE, Distances};
use crate::{Branch, BranchSet, Pose, SrsArm, Unreachable};
use glam::DVec3;

/// Added to every bound: a hundred times the rounding of the cross products.
const ROUNDING: f64 = 1e-12;

/// With bounds larger than this no limit test says anything.
const LARGEST_SLACK: f64 = 0.9;

/// Tool poses around a central one: positions on a rectangle with a rounded rim, orientations
/// within a cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRegion {
    /// `base_from_tool` in the middle.
    pub center: Pose,
    /// Half of the rectangle's sides, base axes, m; perpendicular to each other, or zero.
    pub half_sides_m: [DVec3; 2],
    /// Every position within this of the rectangle belongs to the region too, m.
    pub radius_m: f64,
    /// And so does every orientation that a turn by at most this, about any axis through the tool
    /// point, makes of the central one, rad.
    pub angle_rad: f64,
}

impl PoseRegion {
    /// The positions `center ± half_m`, one orientation.
    #[must_use]
    pub const fn segment(center: Pose, half_m: DVec3) -> Self {
        Self::rectangle(center, [half_m, DVec3::ZERO])
    }

    /// The positions `center ± a ± b`, one orientation.
    #[must_use]
    pub const fn rectangle(center: Pose, half_sides_m: [DVec3; 2]) -> Self {
        Self {
            center,
            half_sides_m,
            radius_m: 0.0,
            angle_rad: 0.0,
        }
    }

    /// All positions within `radius_m`, all orientations within `angle_rad`.
    #[must_use]
    pub const fn ball(center: Pose, radius_m: f64, angle_rad: f64) -> Self {
        Self {
            center,
            half_sides_m: [DVec3::ZERO; 2],
            radius_m,
            angle_rad,
        }
    }
}

/// What is proven of a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RegionVerdict {
    /// Every pose can be held on each of these branches (and perhaps on others).
    Reachable(BranchSet),
    /// No pose can be held, for this reason; gaps are those of the pose that lacks least.
    Unreachable(Unreachable),
    /// Neither was proven: a smaller region may tell.
    Undecided,
}

impl SrsArm {
    /// Is a whole region of poses reachable, or none of it?
    ///
    /// Either answer is a proof, of the same closed limits and with the same tolerance of 1e-13 as
    /// [`SrsArm::verdict`]; the module `region` in the sources has the derivation. Poses that only
    /// a singular shoulder or wrist can hold (a board at full stretch, square to the arm) are
    /// never proven reachable. A region with NaN, infinite or negative extents is `Undecided`.
    #[must_use]
    pub fn region_verdict(&self, region: &PoseRegion) -> RegionVerdict {
        self.region_verdict_between(self, region)
    }

    /// The same for a family of arms: `self` has the narrowest limits, `widest` the widest, all
    /// else alike.
    ///
    /// `Reachable` then holds for every arm of the family, and so does `Unreachable`. One use:
    /// a wall turned about the base axis only turns joint 1, so limits of joint 1 moved by the
    /// headings' range answer for all headings at once.
    #[must_use]
    pub fn region_verdict_between(&self, widest: &Self, region: &PoseRegion) -> RegionVerdict {
        let cell = match Cell::prepare(self, widest, region) {
            Ok(cell) => cell,
            Err(verdict) => return verdict,
        };
        // One look at the extremes serves both questions; they answer most of them.
        let Cell {
            circle,
            slack,
            certain,
        } = &cell;
        let extremes = circle.extremes();
        let mut held = 0;
        for psi in extremes {
            let inside = circle.verdicts_within(&self.windows, psi, slack.narrowing());
            held |= inside.shoulder & inside.wrist & certain;
        }
        if held != 0 {
            return RegionVerdict::Reachable(BranchSet::from_bits(held));
        }
        let (mut shoulder, mut wrist, mut may_hold) = (0, 0, false);
        for psi in extremes {
            let outside = circle.verdicts_within(&widest.windows, psi, *slack);
            shoulder |= outside.shoulder;
            wrist |= outside.wrist;
            may_hold |= outside.shoulder & outside.wrist != 0;
        }
        if !may_hold {
            let verdict = unreachable(circle, widest, *slack, shoulder, wrist);
            if let Some(reason) = verdict {
                return RegionVerdict::Unreachable(reason);
            }
        }
        if *certain != 0 {
            held = cell.first_held(self, *certain);
            if held == 0 {
                held = cell.held_on_the_way(self, *certain);
            }
        }
        if held == 0 {
            RegionVerdict::Undecided
        } else {
            RegionVerdict::Reachable(BranchSet::from_bits(held))
        }
    }

    /// All branches that provably hold every pose of a region, each at one arm angle.
    ///
    /// Where [`SrsArm::region_verdict`] stops at the first ones it meets, this looks at every limit.
    #[must_use]
    pub fn branches_throughout(&self, region: &PoseRegion) -> BranchSet {
        let Ok(cell) = Cell::prepare(self, self, region) else {
            return BranchSet::EMPTY;
        };
        let mut held = 0;
        for psi in cell.circle.extremes() {
            let v = cell
                .circle
                .verdicts_within(&self.windows, psi, cell.slack.narrowing());
            held |= v.shoulder & v.wrist & cell.certain;
        }
        while held != cell.certain {
            let more = cell.first_held(self, cell.certain & !held);
            if more == 0 {
                break;
            }
            held |= more;
        }
        held |= cell.held_on_the_way(self, cell.certain);
        BranchSet::from_bits(held)
    }

    /// Wrist centre of a tool pose, from the shoulder, base axes, m.
    #[must_use]
    pub fn wrist_from_shoulder_m(&self, base_from_tool: &Pose) -> DVec3 {
        wrist_from_shoulder(self, &self.flange_pose(base_from_tool))
    }

    /// Shortest and longest distance from the shoulder to the wrist centre that the elbow's limits
    /// allow, m. All distances between are allowed.
    #[must_use]
    pub fn shoulder_wrist_range_m(&self) -> [f64; 2] {
        let [a, b] = self.distances.sides;
        [a[0].min(b[0]), a[1].max(b[1])]
    }
}

/// How much a reason says is missing, m.
fn missing(reason: &Unreachable) -> f64 {
    match *reason {
        Unreachable::TooFar { gap_m }
        | Unreachable::TooNear { gap_m }
        | Unreachable::ElbowLimit { gap_m } => gap_m,
        _ => f64::INFINITY,
    }
}

/// The reason why no arm angle passes with this slack, if none does; the extremes did not.
fn unreachable(
    circle: &ElbowCircle,
    arm: &SrsArm,
    slack: Slack,
    mut shoulder: u8,
    mut wrist: u8,
) -> Option<Unreachable> {
    if arm.windows.tilting[0].is_beyond_by(circle.tilting[0].at(Direction::ZERO), slack.shoulder) {
        return Some(Unreachable::ShoulderLimit);
    }
    let straightest = circle.tilting[1].at(circle.straightest_wrist);
    if arm.windows.tilting[1].is_beyond_by(straightest, slack.wrist) {
        return Some(Unreachable::WristLimit);
    }
    let looser = Slack {
        shoulder: slack.shoulder + 2.0 * CROSS_TOLERANCE,
        wrist: slack.wrist + 2.0 * CROSS_TOLERANCE,
    };
    let held = circle.first_root(arm, slack, |psi| {
        let v = circle.verdicts_within(&arm.windows, psi, looser);
        shoulder |= v.shoulder;
        wrist |= v.wrist;
        v.shoulder & v.wrist
    });
    if held != 0 {
        None
    } else if shoulder == 0 {
        Some(Unreachable::ShoulderLimit)
    } else if wrist == 0 {
        Some(Unreachable::WristLimit)
    } else {
        Some(Unreachable::ArmAngleConflict)
    }
}

/// A region made ready for tests at arm angles.
struct Cell {
    circle: ElbowCircle,
    slack: Slack,
    /// Branches whose elbow reaches every distance of the region.
    certain: u8,
}

impl Cell {
    /// What the distances and the tilts alone decide is the error.
    #[inline(always)]
    fn prepare(
        narrow: &SrsArm,
        widest: &SrsArm,
        region: &PoseRegion,
    ) -> Result<Self, RegionVerdict> {
        let Some(wrists) = Wrists::new(narrow, region) else {
            return Err(RegionVerdict::Undecided);
        };
        let (narrow, wide) = (&narrow.distances, &widest.distances);
        let possible = wrists.elbows(wide, |side| {
            side[0] - wide.tolerance <= wrists.longest
                && wrists.shortest <= side[1] + wide.tolerance
        });
        if possible == 0 {
            let length = wrists.length.clamp(wrists.shortest, wrists.longest);
            let least = [wrists.shortest, length, wrists.longest]
                .map(|length| widest.length_reason(length))
                .into_iter()
                .min_by(|a, b| missing(a).total_cmp(&missing(b)));
            return Err(least.map_or(RegionVerdict::Undecided, RegionVerdict::Unreachable));
        }
        // The triangle exists only for lengths the elbow allows; those are what must be covered.
        let lo = wide.sides[0][0].min(wide.sides[1][0]).max(wrists.shortest);
        let hi = wide.sides[0][1].max(wide.sides[1][1]).min(wrists.longest);
        let triangles = Triangles::new(wide, lo.min(hi), lo.max(hi), wrists.length);
        if let Some(reason) = wrists.tilted_too_far(widest, &triangles) {
            return Err(RegionVerdict::Unreachable(reason));
        }
        let Some(slack) = wrists.slack(&triangles) else {
            return Err(RegionVerdict::Undecided);
        };
        let certain = wrists.elbows(narrow, |side| {
            side[0] - narrow.tolerance <= wrists.shortest
                && wrists.longest <= side[1] + narrow.tolerance
        });
        let triangle = triangles.reference;
        let wrist = wrists.wrist * (triangle.length / wrists.length);
        let rotation = wrists.flange.rotation();
        Ok(Self {
            circle: ElbowCircle::new(wrist, triangle, possible, &rotation),
            slack,
            certain,
        })
    }

    /// Some of the wanted branches for which an arm angle passes all tests narrowed by the slack.
    fn first_held(&self, arm: &SrsArm, wanted: u8) -> u8 {
        let slack = self.slack.narrowing();
        // The roots are taken a little further inside, so that rounding cannot fail their own test.
        let deeper = Slack {
            shoulder: slack.shoulder - 2.0 * CROSS_TOLERANCE,
            wrist: slack.wrist - 2.0 * CROSS_TOLERANCE,
        };
        self.circle.first_root(arm, deeper, |psi| {
            let v = self.circle.verdicts_within(&arm.windows, psi, slack);
            v.shoulder & v.wrist & wanted
        })
    }

    /// Branches for which a joint with hardly any room is led through its middle.
    ///
    /// No single arm angle serves the whole region then. But if the joint is on one side of its
    /// middle by more than the slack at one arm angle, on the other side at another, and all other
    /// limits hold with the slack and the way between them to spare, then at every pose of the
    /// region some arm angle between the two has the joint exactly in the middle (the intermediate
    /// value theorem), with all others inside.
    #[inline]
    fn held_on_the_way(&self, arm: &SrsArm, wanted: u8) -> u8 {
        let Some(pinched) = &arm.pinched else {
            return 0;
        };
        let mut held = 0;
        let slack = if pinched.in_shoulder() {
            self.slack.shoulder
        } else {
            self.slack.wrist
        };
        let limit = pinched.middle_of(&self.circle);
        limit.roots(0.0, |psi| {
            let half = 2.0 * slack / limit.slope(psi).abs();
            // Also where the slope is 0 or NaN.
            if half.is_nan() || half > LARGEST_SLACK {
                return;
            }
            let [before, after] = [-half, half].map(|turn| limit.at(psi.turned(turn)));
            if before.abs() < slack || after.abs() < slack || before * after >= 0.0 {
                return;
            }
            let others = Slack {
                shoulder: -(self.slack.shoulder + half),
                wrist: -(self.slack.wrist + half),
            };
            let v = self.circle.verdicts_within(&pinched.others, psi, others);
            let sides = pinched.sides(&self.circle, psi, slack + half);
            held |= v.shoulder & v.wrist & sides & wanted;
        });
        held
    }
}

/// The wrist centres of a region.
struct Wrists {
    flange: Pose,
    wrist: DVec3,
    length: f64,
    half_sides: [DVec3; 2],
    radius: f64,
    /// Rounding of a distance, m.
    tolerance: f64,
    /// Distances from the shoulder, widened by rounding, m.
    shortest: f64,
    longest: f64,
    /// Largest `|u' - u|`.
    turn: f64,
    /// Chord of the tool's turn.
    tool_turn: f64,
}

impl Wrists {
    fn new(arm: &SrsArm, region: &PoseRegion) -> Option<Self> {
        let flange = arm.flange_pose(&region.center);
        let wrist = wrist_from_shoulder(arm, &flange);
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
            // A ball of radius r at distance D is seen under asin(r/D) <= tan of it.
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
            // NaN means that the wrist is on the shoulder. Corners further apart than this may
            // hide what lies between them; the distances and tilts still count.
            turn: if turn < 1.0 { turn } else { f64::INFINITY },
            tool_turn,
        })
    }

    fn elbows(&self, distances: &Distances, holds: impl Fn([f64; 2]) -> bool) -> u8 {
        let [negative, positive] = distances.sides.map(holds);
        (if negative { Branch::ELBOW[0] } else { 0 }) | if positive { Branch::ELBOW[1] } else { 0 }
    }

    /// The bounds of the module's derivation; `None` where they say nothing.
    fn slack(&self, triangles: &Triangles) -> Option<Slack> {
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

    /// Must joint 2 or joint 6 tilt beyond its limit everywhere, whatever the arm angle?
    ///
    /// `|q2|` is least with the elbow highest: `χ - β`, where χ is the angle of w from the base
    /// axis; `|q6|` likewise `χ - η` with the angle of w from the tool axis. With
    /// `cos χ = c / L` these are functions of L alone when c, the distance along the axis, is
    /// taken at its largest. Their stationary places are those where the other link is
    /// parallel to the axis. So the least tilt over the region is found exactly, to all orders:
    /// the slack above, of first order, would need ever smaller regions beside a tangency.
    fn tilted_too_far(&self, arm: &SrsArm, triangles: &Triangles) -> Option<Unreachable> {
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
struct Triangles {
    /// Somewhere in the range.
    reference: Triangle,
    /// At its ends.
    ends: [Triangle; 2],
    /// Where one of the angles turns round, if that is within.
    turning: Option<Triangle>,
    range: [f64; 2],
}

impl Triangles {
    fn new(distances: &Distances, lo: f64, hi: f64, length: f64) -> Self {
        let (a, b) = (distances.upper, distances.fore);
        // Where the links differ, the angle at the longer one's end is largest at this length.
        let turning = (a * a - b * b).abs().sqrt();
        Self {
            reference: Triangle::from_sides(a, b, length.clamp(lo, hi)),
            ends: [lo, hi].map(|length| Triangle::from_sides(a, b, length)),
            turning: (lo < turning && turning < hi).then(|| Triangle::from_sides(a, b, turning)),
            range: [lo, hi],
        }
    }

    /// Cosine of the least tilt `χ - angle` of the link `near` (the other is `far`) with
    /// `cos χ = along / L`; `None` where the link can be along the axis itself.
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
                // As seen from the near link: its angle at the common point is `beta`.
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

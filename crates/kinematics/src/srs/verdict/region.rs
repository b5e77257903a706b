//! Verdicts that hold for a whole set of poses at once, with proof.
//!
//! Let a configuration hold the central pose at some arm angle. Elsewhere in the region the wrist centre
//! has another direction `u` and another distance `L` from the shoulder. Move the arm there in two
//! steps: turn it by the smallest rotation that takes the old `u` to the new one; then, within the
//! triangle's plane, turn the upper arm to the new angle β and the forearm to the new angle η. With `R03
//! = F Ry(-β)` and `R04 = F Ry(η)` this gives `R03' = Q R03 Ry(β - β')` and `R47' = Ry(η' - η)ᵀ R04ᵀ Qᵀ
//! P R`, where P is the turn of the tool. A rotation by an angle moves a unit vector by at most the
//! chord of that angle, so
//!
//! - every row and column of `R03` moves by at most `|u' - u| + chord(β' - β)`,
//! - every row and column of `R47` by at most `|u' - u| + chord(η' - η) + chord(P)`.
//!
//! The limits are tested as cross products of such vectors with fixed unit vectors (`window.rs`), which
//! change by at most the same bounds. Hence: if some arm angle passes all tests *narrowed* by these
//! bounds, the whole region is reachable; if none passes them *widened* by the bounds, no pose of the
//! region is reachable (moving the arm is a bijection of the arm angles). The bounds need no safety
//! factor; `ROUNDING` covers the arithmetic. β and η are functions of L alone and monotone except for
//! one turning point. Their extremes over the region's distances are therefore exact, also at full
//! stretch, where their slope is infinite.

use super::pose_region::PoseRegion;
use super::region_bounds::{LARGEST_SLACK, Triangles, Wrists};
use crate::srs::branch::BranchSet;
use crate::srs::circle::{CROSS_TOLERANCE, Direction, ElbowCircle, Slack};
use crate::srs::model::SrsArm;
use crate::unreachable::Unreachable;
use glam::DVec3;
use hwall_geometry::Pose;

/// What is proven about a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RegionVerdict {
    /// Every pose can be held on each of these branches (and perhaps on others).
    Reachable(BranchSet),
    /// No pose can be held, for this reason; gaps are those of the pose with the smallest gap.
    Unreachable(Unreachable),
    /// Neither was proven; a smaller region may be decidable.
    Undecided,
}

/// Distances from the shoulder to the wrist centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShoulderWristRange {
    /// The shortest, m.
    pub shortest_m: f64,
    /// The longest, m.
    pub longest_m: f64,
}

impl SrsArm {
    /// Whether a whole region of poses is reachable, or none of it.
    ///
    /// Both answers are proofs, for the same closed limits and with the same tolerance of 1e-13 as
    /// [`SrsArm::verdict`]; see the source of module `region` for the derivation. Poses that only a
    /// singular shoulder or wrist can hold (a board at full stretch, perpendicular to the arm) are
    /// never proven reachable. A region with NaN, infinite or negative extents is `Undecided`.
    #[must_use]
    pub fn region_verdict(&self, region: &PoseRegion) -> RegionVerdict {
        self.region_verdict_between(self, region)
    }

    /// As [`region_verdict`](Self::region_verdict), for a family of arms that differ only in their limits: `self` has the narrowest limits,
    /// `widest` the widest.
    ///
    /// `Reachable` and `Unreachable` then hold for every arm of the family. Example: rotating a
    /// wall about the base axis only rotates joint 1, so shifting the limits of joint 1 by the
    /// range of headings covers all headings at once.
    #[must_use]
    pub fn region_verdict_between(&self, widest: &Self, region: &PoseRegion) -> RegionVerdict {
        let cell = match Cell::prepare(self, widest, region) {
            Ok(cell) => cell,
            Err(verdict) => return verdict,
        };
        // One test at the extremes serves both questions and decides most regions.
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
    /// [`SrsArm::region_verdict`] stops at the first branches found; this function checks every limit.
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
        self.wrist_from_shoulder(&self.flange_pose(base_from_tool))
    }

    /// The distances from the shoulder to the wrist centre that the elbow's limits allow: all between shortest and longest.
    #[must_use]
    pub fn shoulder_wrist_range(&self) -> ShoulderWristRange {
        let [a, b] = self.distances.sides;
        ShoulderWristRange {
            shortest_m: a[0].min(b[0]),
            longest_m: a[1].max(b[1]),
        }
    }
}

/// The gap given by a reason, m.
fn missing(reason: &Unreachable) -> f64 {
    match *reason {
        Unreachable::TooFar { gap_m }
        | Unreachable::TooNear { gap_m }
        | Unreachable::ElbowLimit { gap_m } => gap_m,
        _ => f64::INFINITY,
    }
}

/// The reason why no arm angle passes with this slack, if none does. The extremes are already known to fail.
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
    let held = circle.first_root(&arm.windows, slack, |psi| {
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

/// A region prepared for tests at arm angles.
struct Cell {
    circle: ElbowCircle,
    slack: Slack,
    /// Branches whose elbow reaches every distance of the region.
    certain: u8,
}

impl Cell {
    /// The error is the verdict, if distances and tilts alone decide it.
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
        // The triangle exists only for lengths that the elbow allows; only those must be covered.
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
        // Roots are taken slightly further inside, so that rounding cannot fail their own test.
        let deeper = Slack {
            shoulder: slack.shoulder - 2.0 * CROSS_TOLERANCE,
            wrist: slack.wrist - 2.0 * CROSS_TOLERANCE,
        };
        self.circle.first_root(&arm.windows, deeper, |psi| {
            let v = self.circle.verdicts_within(&arm.windows, psi, slack);
            v.shoulder & v.wrist & wanted
        })
    }

    /// Branches for which a joint with very narrow limits passes through its middle.
    ///
    /// With such limits, no single arm angle serves the whole region. But suppose that the joint is on one
    /// side of its middle by more than the slack at one arm angle, and on the other side at another. Suppose
    /// also that all other limits are satisfied with the slack plus the change between the two angles. Then
    /// by the intermediate value theorem every pose of the region has an arm angle between the two with the
    /// joint exactly in the middle and all others inside.
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
            // Also covers a slope of 0 or NaN.
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

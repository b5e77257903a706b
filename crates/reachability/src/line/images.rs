//! The images of a wall: rotated about the base axis, and mirrored.
//!
//! Rotating a wall about the base axis rotates only joint 1. Reflection in the plane of base axis and
//! normal changes the signs of joints 1, 3, 5 and 7, and rotates the flange by `2 r - π` at roll r.
//! So, except for the limits of those four joints, one wall represents all walls at its distance, at
//! every heading, and one half represents the other. The limits of each image forbid an arc of a
//! joint's circle. What is reachable with all of these arcs forbidden is reachable in every image.
//! What is unreachable with only their common part forbidden is unreachable in every image. Where
//! both tests agree, the symmetry is proven, without assumptions about the limits.

use super::family::size_m;
use crate::error::Result;
use hwall_kinematics::{JointLimit, SrsArm};
use std::f64::consts::{PI, TAU};

/// Headings further apart than this are not solved together, rad: the more of joint 1's circle the
/// images forbid, the less can be proven for all of them.
const WIDEST_SECTOR_RAD: f64 = 1.75;

/// Groups headings, rad, to be solved together, around the circle from the largest gap. Returns the sector of each heading.
pub(crate) fn sectors(headings: &[f64]) -> Vec<usize> {
    let turned = |heading: &f64| heading.rem_euclid(TAU);
    let mut order: Vec<usize> = (0..headings.len()).collect();
    order.sort_by(|&a, &b| turned(&headings[a]).total_cmp(&turned(&headings[b])));
    let gap_before = |i: usize| {
        let before = (i + order.len() - 1) % order.len();
        (turned(&headings[order[i]]) - turned(&headings[order[before]])).rem_euclid(TAU)
    };
    let start = (0..order.len())
        .max_by(|&a, &b| gap_before(a).total_cmp(&gap_before(b)))
        .unwrap_or(0);
    order.rotate_left(start);
    let mut sector_of = vec![0; headings.len()];
    let (mut sector, mut from) = (0, order.first().map_or(0.0, |&i| turned(&headings[i])));
    for &index in &order {
        let heading = turned(&headings[index]);
        if (heading - from).rem_euclid(TAU) > WIDEST_SECTOR_RAD {
            (sector, from) = (sector + 1, heading);
        }
        sector_of[index] = sector;
    }
    sector_of
}

/// The mirrored rolls of the flange, if the tool is mirror symmetric up to a rotation of the flange.
pub(super) fn mirrored_rolls(arm: &SrsArm, rolls: impl Iterator<Item = f64>) -> Option<Vec<f64>> {
    let tool = arm.flange_from_tool();
    let (x, z, p) = (
        tool.rotation().x_axis,
        tool.rotation().z_axis,
        tool.position_m(),
    );
    let turned = x.y.atan2(x.x);
    let aligned = z.x.hypot(z.y) < 1e-15 && z.z > 0.0 && p.x.hypot(p.y) < 1e-15 * size_m(arm);
    aligned.then(|| rolls.map(|roll| roll - turned).collect())
}

/// The narrowest and the widest arm of all images of a wall, each rotated to heading 0; `None` if the images share no angle of some joint.
///
/// `mirrored_rolls`: see [`mirrored_rolls`]; without them there are no mirror images.
pub(super) fn family_of_images(
    arm: &SrsArm,
    headings: &[f64],
    mirrored_rolls: Option<&[f64]>,
) -> Result<Option<(SrsArm, SrsArm)>> {
    let (mut narrow, mut wide) = (*arm.limits(), *arm.limits());
    for joint in [0, 2, 4, 6] {
        let Some(forbidden) = Arc::forbidden_by(arm.limits()[joint]) else {
            continue;
        };
        let mut images: Vec<Arc> = match joint {
            0 => headings.iter().map(|h| forbidden.turned(-h)).collect(),
            _ => vec![forbidden],
        };
        if let Some(rolls) = mirrored_rolls {
            let mirrored: Vec<Arc> = images.iter().map(Arc::mirrored).collect();
            if joint == 6 {
                let turned = |r: &f64| forbidden.mirrored().turned(2.0 * r - PI);
                images.extend(rolls.iter().map(turned));
            } else {
                images.extend(mirrored);
            }
        }
        if images.iter().all(|arc| arc.is(&images[0])) {
            let limit = images[0].complement();
            (narrow[joint], wide[joint]) = (limit, limit);
        } else {
            let Some(common) = largest_gap(&images) else {
                return Ok(None);
            };
            (narrow[joint], wide[joint]) = (common, JointLimit::FREE);
        }
    }
    Ok(Some((arm.with_limits(narrow)?, arm.with_limits(wide)?)))
}

/// The angles that a limit forbids, as an open arc of the circle.
#[derive(Debug, Clone, Copy)]
struct Arc {
    middle: f64,
    half: f64,
}

impl Arc {
    fn forbidden_by(limit: JointLimit) -> Option<Self> {
        let width = limit.max_rad - limit.min_rad;
        (width < TAU).then_some(Self {
            middle: 0.5 * (limit.min_rad + limit.max_rad) + PI,
            half: PI - 0.5 * width,
        })
    }

    fn turned(&self, by: f64) -> Self {
        Self {
            middle: self.middle + by,
            ..*self
        }
    }

    fn mirrored(&self) -> Self {
        Self {
            middle: -self.middle,
            ..*self
        }
    }

    fn is(&self, other: &Self) -> bool {
        let turns = (self.middle - other.middle) / TAU;
        self.half == other.half && (turns - turns.round()).abs() < 1e-15
    }

    fn complement(&self) -> JointLimit {
        let middle = self.middle - PI;
        JointLimit {
            min_rad: middle - (PI - self.half),
            max_rad: middle + (PI - self.half),
        }
    }
}

/// The largest arc that no image forbids, if any.
fn largest_gap(forbidden: &[Arc]) -> Option<JointLimit> {
    let mut arcs: Vec<(f64, f64)> = forbidden
        .iter()
        .map(|arc| {
            let start = (arc.middle - arc.half).rem_euclid(TAU);
            (start, start + 2.0 * arc.half)
        })
        .collect();
    arcs.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Once around from the first start; arcs that extend beyond a full turn also cover the first gaps.
    let last = arcs[0].0 + TAU;
    let mut end = arcs.iter().map(|a| a.1 - TAU).fold(arcs[0].0, f64::max);
    let mut best: Option<(f64, f64)> = None;
    for &(start, stop) in arcs.iter().chain([&(last, last)]) {
        if start > end && best.is_none_or(|(lo, hi)| start - end > hi - lo) {
            best = Some((end, start));
        }
        end = end.max(stop);
    }
    best.map(|(min_rad, max_rad)| JointLimit { min_rad, max_rad })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(middle_deg: f64, half_deg: f64) -> Arc {
        Arc {
            middle: middle_deg.to_radians(),
            half: half_deg.to_radians(),
        }
    }

    #[test]
    fn the_largest_gap_goes_round_the_circle() {
        let width = |arcs: &[Arc]| {
            let gap = largest_gap(arcs)?;
            Some((gap.max_rad - gap.min_rad).to_degrees().round())
        };
        assert_eq!(width(&[arc(180.0, 10.0)]), Some(340.0));
        assert_eq!(width(&[arc(180.0, 10.0), arc(0.0, 10.0)]), Some(160.0));
        assert_eq!(width(&[arc(-170.0, 30.0), arc(170.0, 30.0)]), Some(280.0));
        assert_eq!(
            width(&[arc(350.0, 60.0), arc(20.0, 5.0), arc(100.0, 10.0)]),
            Some(180.0)
        );
        assert_eq!(width(&[arc(0.0, 100.0), arc(180.0, 100.0)]), None);
        assert_eq!(width(&[arc(10.0, 180.0), arc(30.0, 180.0)]), None);
    }
}

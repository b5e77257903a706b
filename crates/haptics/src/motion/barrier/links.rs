//! Links of the arm in front of the surfaces that the board stays behind.

use super::Footprint;
use super::tree::Barriers;
use crate::body::{ArmCapsules, Capsule, PersonBody};
use glam::DVec3;

/// A link of the arm in front of a surface, within reach of a person who sees nothing there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkInFront {
    /// The link that is furthest in front, as an index of [`ArmCapsules::links`].
    pub link: usize,
    /// How far, m.
    pub in_front_m: f64,
}

/// Detection starts at this distance in front, m: ten times that allowed for the face. It ends at half of that.
const BEGINS_M: f64 = 0.03;
const ENDS_M: f64 = 0.015;
/// A link this near to head, torso or an arm is within reach, m: the arm of large men is 0.8 m long with the fingers ([DIN 33402-2]). The second
/// value ends the detection.
const REACH_M: f64 = 0.8;
const LEAVES_REACH_M: f64 = 0.9;
/// Sample points on each link, at most 0.15 m apart for an iiwa.
const PLACES: u32 = 4;

impl LinkInFront {
    /// `before`: the last result. The number of samples is fixed: twice [`PLACES`] for each link.
    ///
    /// The nearest surface decides, as for the board. Over the footprint of the goal only the goal's surface counts. The end of the last link, over a
    /// length of its radius, belongs to the board. Losing sight of the person does not end a detection.
    pub(in crate::motion) fn find(
        before: Option<Self>,
        capsules: &ArmCapsules,
        person: &PersonBody,
        barriers: &Barriers,
        goal: Option<Footprint>,
    ) -> Option<Self> {
        let (least_m, reach_m) = match before {
            Some(_) => (ENDS_M, LEAVES_REACH_M),
            None => (BEGINS_M, REACH_M),
        };
        // How far the outermost point of a ball is in front of the surface nearest to its centre, m.
        let side_of = |point_m| barriers.side_of(point_m, &[goal], &[]);
        let furthest_m = |middle_m: DVec3, radius_m| {
            let out = side_of(middle_m)?.normal;
            Some(side_of(middle_m + out * radius_m)?.in_front_m)
        };
        // A person who is no longer tracked may still be there.
        let goes_on = before.is_some() && person.capsules().next().is_none();
        let last = capsules.links().len().checked_sub(1)?;
        let mut found: Option<Self> = None;
        for (link, capsule) in capsules.links().iter().enumerate() {
            let Some(part) = (match link == last {
                true => shortened(capsule),
                false => Some(*capsule),
            }) else {
                continue;
            };
            let is_in_reach = |(_, seen): (_, Capsule)| seen.distance_m(&part) <= reach_m;
            if !goes_on && !person.capsules().any(is_in_reach) {
                continue;
            }
            for place in 0..PLACES {
                let share = f64::from(place) / f64::from(PLACES - 1);
                let middle_m = part.from_m.lerp(part.to_m, share);
                let Some(in_front_m) = furthest_m(middle_m, part.radius_m) else {
                    continue;
                };
                let most_m = found.map_or(least_m, |found| found.in_front_m);
                if in_front_m > most_m {
                    found = Some(Self { link, in_front_m });
                }
            }
        }
        found
    }
}

/// A link without its end, over a length of its radius.
fn shortened(link: &Capsule) -> Option<Capsule> {
    let length_m = link.from_m.distance(link.to_m);
    (length_m > link.radius_m).then(|| Capsule {
        to_m: (link.from_m).lerp(link.to_m, 1.0 - link.radius_m / length_m),
        ..*link
    })
}

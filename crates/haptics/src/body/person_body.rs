//! A person as capsules, from the few points that are tracked.

use super::capsule::Capsule;
use crate::error::HapticsError;
use crate::safety::{PersonPart, PersonPoint};
use glam::DVec3;
use hwall_numeric::check::{non_negative, positive};

/// A body region with its own contact limits ([ISO/TS 15066], annex A).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BodyRegion {
    /// Skull, face and neck: contact is never allowed.
    Head,
    /// Chest, belly, back and hips.
    Torso,
    /// From the shoulder to the palm.
    Arm,
}

/// Body dimensions. The torso is assumed to hang below the head, and an arm without a tracked elbow to be straight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonBodyConfig {
    /// Radius of the head around the tracked point between the eyes, m; default 0.15: face, temples and crown of large men ([DIN 33402-2]); the back
    /// of the head is up to 0.05 further away.
    pub head_radius_m: f64,
    /// Distance of the shoulders below the head, m; default 0.28.
    pub shoulder_below_m: f64,
    /// Distance of the hips below the head, m; default 0.85.
    pub hip_below_m: f64,
    /// Half the depth of a torso with clothes, m; default 0.18.
    pub torso_radius_m: f64,
    /// Half the width of an upper arm with clothes, m; default 0.07.
    pub arm_radius_m: f64,
}

impl Default for PersonBodyConfig {
    fn default() -> Self {
        Self {
            head_radius_m: 0.15,
            shoulder_below_m: 0.28,
            hip_below_m: 0.85,
            torso_radius_m: 0.18,
            arm_radius_m: 0.07,
        }
    }
}

impl PersonBodyConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("head_radius_m", self.head_radius_m)?;
        non_negative("shoulder_below_m", self.shoulder_below_m)?;
        non_negative("hip_below_m", self.hip_below_m)?;
        positive("torso_radius_m", self.torso_radius_m)?;
        positive("arm_radius_m", self.arm_radius_m)?;
        Ok(())
    }
}

/// Most capsules of a person.
pub(super) const MOST: usize = 5;

/// A part of the person, and the time when it was seen, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub(super) region: BodyRegion,
    /// The tracked point that it was derived from.
    pub(super) part: PersonPart,
    pub(super) capsule: Capsule,
    pub(super) stamp_s: f64,
}

/// The known parts of a person, base frame; z is up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PersonBody {
    parts: [Option<Seen>; MOST],
}

impl PersonBody {
    /// From tracked points; points that are not finite are ignored.
    #[must_use]
    pub fn of(points: &[PersonPoint], config: &PersonBodyConfig) -> Self {
        let find = |part| {
            let is_it = |point: &&PersonPoint| point.part == part && point.position_m.is_finite();
            points.iter().find(is_it)
        };
        let Some(head) = find(PersonPart::Head) else {
            return Self::default();
        };
        let below = |way_m: f64| head.position_m - DVec3::Z * way_m;
        let seen = |region, capsule| {
            Some(Seen {
                region,
                part: PersonPart::Head,
                capsule,
                stamp_s: head.stamp_s,
            })
        };
        let shoulder_m = below(config.shoulder_below_m);
        let torso = Capsule {
            from_m: shoulder_m,
            to_m: below(config.hip_below_m),
            radius_m: config.torso_radius_m,
        };
        let limb = |from_m: DVec3, from_s: f64, to: &PersonPoint| Seen {
            region: BodyRegion::Arm,
            part: to.part,
            capsule: Capsule {
                from_m,
                to_m: to.position_m,
                radius_m: config.arm_radius_m,
            },
            stamp_s: from_s.min(to.stamp_s),
        };
        let from_shoulder = |to| limb(shoulder_m, head.stamp_s, to);
        let elbow = find(PersonPart::Elbow);
        let hand = find(PersonPart::Palm).or_else(|| find(PersonPart::Fingertip));
        Self {
            parts: [
                seen(
                    BodyRegion::Head,
                    Capsule::ball(head.position_m, config.head_radius_m),
                ),
                seen(BodyRegion::Torso, torso),
                elbow.map(from_shoulder),
                hand.map(|hand| match elbow {
                    Some(elbow) => limb(elbow.position_m, elbow.stamp_s, hand),
                    None => from_shoulder(hand),
                }),
                find(PersonPart::OtherHand).map(from_shoulder),
            ],
        }
    }

    /// The capsules, with their regions.
    pub fn capsules(&self) -> impl Iterator<Item = (BodyRegion, Capsule)> {
        self.seen().map(|seen| (seen.region, seen.capsule))
    }

    /// Is nothing known?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.seen().next().is_none()
    }

    /// Parts that no moving part of the arm may meet.
    pub(super) fn vital(&self) -> impl Iterator<Item = Seen> {
        self.seen().filter(|seen| seen.region != BodyRegion::Arm)
    }

    pub(super) fn seen(&self) -> impl Iterator<Item = Seen> {
        self.parts.into_iter().flatten()
    }
}

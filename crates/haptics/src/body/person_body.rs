//! People as capsules, from the few points that are tracked.

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

/// Capsules of the person, and of a bystander.
const OF_PERSON: usize = 5;
const OF_BYSTANDER: usize = 2;

/// A part of somebody, and the time when it was seen, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub(super) region: BodyRegion,
    /// The tracked point that it was derived from.
    pub(super) part: PersonPart,
    pub(super) capsule: Capsule,
    pub(super) stamp_s: f64,
}

/// The known parts of the person, and of bystanders, of whom only the head is tracked; base frame, z is up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PersonBody {
    person: [Option<Seen>; OF_PERSON],
    bystanders: [[Option<Seen>; OF_BYSTANDER]; PersonPart::BYSTANDERS.len()],
}

impl PersonBody {
    /// Most capsules.
    pub const MOST: usize = OF_PERSON + OF_BYSTANDER * PersonPart::BYSTANDERS.len();

    /// From tracked points; points that are not finite are ignored.
    #[must_use]
    pub fn of(points: &[PersonPoint], config: &PersonBodyConfig) -> Self {
        let find = |part| {
            let is_it = |point: &&PersonPoint| point.part == part && point.position_m.is_finite();
            points.iter().find(is_it)
        };
        let of_bystander =
            |part| find(part).map_or([None; _], |head| below(head, config).map(Some));
        Self {
            person: find(PersonPart::Head).map_or([None; _], |head| of_person(head, find, config)),
            bystanders: PersonPart::BYSTANDERS.map(of_bystander),
        }
    }

    /// Replaces everybody whose head is in `newer`.
    pub(crate) fn renew(&mut self, newer: &Self) {
        if newer.person[0].is_some() {
            self.person = newer.person;
        }
        for (known, newer) in self.bystanders.iter_mut().zip(&newer.bystanders) {
            if newer[0].is_some() {
                *known = *newer;
            }
        }
    }

    /// Forgets whoever has this head.
    pub(crate) fn forget(&mut self, head: PersonPart) {
        if head == PersonPart::Head {
            self.person = [None; _];
        }
        for (part, known) in PersonPart::BYSTANDERS.into_iter().zip(&mut self.bystanders) {
            if part == head {
                *known = [None; _];
            }
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
        let bystanders = self.bystanders.iter().flatten();
        self.person.iter().chain(bystanders).flatten().copied()
    }
}

/// Head and torso.
fn below(head: &PersonPoint, config: &PersonBodyConfig) -> [Seen; OF_BYSTANDER] {
    let seen = |region, capsule| Seen {
        region,
        part: head.part,
        capsule,
        stamp_s: head.stamp_s,
    };
    let torso = Capsule {
        from_m: head.position_m - DVec3::Z * config.shoulder_below_m,
        to_m: head.position_m - DVec3::Z * config.hip_below_m,
        radius_m: config.torso_radius_m,
    };
    [
        seen(
            BodyRegion::Head,
            Capsule::ball(head.position_m, config.head_radius_m),
        ),
        seen(BodyRegion::Torso, torso),
    ]
}

/// The same, and the arms as far as `find` finds their points.
fn of_person<'a>(
    head: &PersonPoint,
    find: impl Fn(PersonPart) -> Option<&'a PersonPoint>,
    config: &PersonBodyConfig,
) -> [Option<Seen>; OF_PERSON] {
    let [head, torso] = below(head, config);
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
    let from_shoulder = |to| limb(torso.capsule.from_m, head.stamp_s, to);
    let elbow = find(PersonPart::Elbow);
    let hand = find(PersonPart::Palm).or_else(|| find(PersonPart::Fingertip));
    [
        Some(head),
        Some(torso),
        elbow.map(from_shoulder),
        hand.map(|hand| match elbow {
            Some(elbow) => limb(elbow.position_m, elbow.stamp_s, hand),
            None => from_shoulder(hand),
        }),
        find(PersonPart::OtherHand).map(from_shoulder),
    ]
}

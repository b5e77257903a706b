//! Speed and separation: does the arm stand before a person can reach it?

use super::arm_body::{ArmBody, ArmCapsules, MOST as MOST_PARTS, least_or_nan};
use super::person_body::{BodyRegion, MOST as MOST_SEEN, PersonBody, PersonBodyConfig, Seen};
use crate::error::HapticsError;
use crate::safety::PersonPart;
use hwall_kinematics::{JointPositions, JointVelocities, MOST_JOINTS};
use hwall_numeric::check::non_negative;

/// How a person is kept away from an arm that moves: head and torso from all of it ([ISO/TS 15066], 5.5.4), their arms from parts that are
/// faster than may hurt (5.5.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeparationConfig {
    /// The person's sizes.
    pub person: PersonBodyConfig,
    /// A person comes nearer at this speed, m/s; default 1.6, that of [ISO 13855] for a person who walks.
    pub person_m_per_s: f64,
    /// From a change of the world to the first braking, beyond the age of the newest sample, s; default 0.045: 20 ms of tracker and
    /// network, 22 ms of reaction of an iiwa.
    pub latency_s: f64,
    /// What is left between the person and the arm that has stopped, m; default 0.02.
    pub clearance_m: f64,
    /// An arm of which no part is faster than this counts as one that stands, m/s; default 0.005.
    pub stands_m_per_s: f64,
    /// A part that is no faster than this may meet the person's arms, m/s; default 1.1: twice the 150 N of an upper arm over
    /// `sqrt(mu k)`, with 30 N/mm and its 3 kg against 12 kg of an iiwa ([ISO/TS 15066], annex A).
    pub meets_arm_m_per_s: f64,
}

impl Default for SeparationConfig {
    fn default() -> Self {
        Self {
            person: PersonBodyConfig::default(),
            person_m_per_s: 1.6,
            latency_s: 0.045,
            clearance_m: 0.02,
            stands_m_per_s: 0.005,
            meets_arm_m_per_s: 1.1,
        }
    }
}

impl SeparationConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        self.person.validate()?;
        non_negative("person_m_per_s", self.person_m_per_s)?;
        non_negative("latency_s", self.latency_s)?;
        non_negative("clearance_m", self.clearance_m)?;
        non_negative("stands_m_per_s", self.stands_m_per_s)?;
        non_negative("meets_arm_m_per_s", self.meets_arm_m_per_s)?;
        Ok(())
    }
}

/// What is left between an arm and the person while the arm comes to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// The nearest region.
    pub region: BodyRegion,
    /// The tracked point that it is known from.
    pub part: PersonPart,
    /// Distance at the moment of the least margin, m: a lower bound.
    pub distance_m: f64,
    /// Distance beyond what is needed, m: the least until the arm stands. Below zero the arm has to brake.
    pub left_m: f64,
}

impl Gap {
    /// The one of which less is left; NaN is the least.
    fn worse(self, other: Self) -> Self {
        match other.left_m < self.left_m || other.left_m.is_nan() {
            true => other,
            false => self,
        }
    }
}

/// Pieces that the time until the arm stands is cut into: the reaction, and the braking.
const BRAKING_PIECES: usize = 4;

/// Judges motions of an arm by the distance to a person.
#[derive(Debug, Clone)]
pub struct Separation {
    body: ArmBody,
    config: SeparationConfig,
    braking_rad_per_s2: [f64; MOST_JOINTS],
}

impl Separation {
    /// For an arm whose joints brake together, the slowest to stop as hard as these accelerations allow, rad/s².
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(
        body: ArmBody,
        config: SeparationConfig,
        braking_rad_per_s2: [f64; MOST_JOINTS],
    ) -> Result<Self, HapticsError> {
        config.validate()?;
        Ok(Self {
            body,
            config,
            braking_rad_per_s2,
        })
    }

    /// The arm's body.
    #[must_use]
    pub const fn body(&self) -> &ArmBody {
        &self.body
    }

    /// See [`ArmBody::fit`].
    pub fn fit(&mut self, q: &JointPositions) {
        self.body.fit(q);
    }

    /// By how much this posture is nearer than a plan may bring a resting arm, m, to itself or the room (it keeps twice the clearance), and to
    /// head or torso. Negative: free. NaN in gives NaN.
    #[must_use]
    pub fn short_of_m(&self, q: &JointPositions, person: &PersonBody) -> [f64; 2] {
        let nearest = self.body.nearest(q);
        let of_arm_m = 2.0 * self.body.clearance_m() - nearest.distance_m;
        let capsules = self.body.at(q);
        let SeparationConfig {
            person_m_per_s,
            latency_s,
            clearance_m,
            ..
        } = self.config;
        let needed_m = clearance_m + person_m_per_s * latency_s;
        let of_person = person
            .vital()
            .map(|seen| capsules.distance_m(&seen.capsule) - needed_m);
        [of_arm_m, -least_or_nan(of_person)]
    }

    /// The settings.
    #[must_use]
    pub const fn config(&self) -> &SeparationConfig {
        &self.config
    }

    /// A part that is no faster may meet this part of the person, m/s.
    const fn harmless_m_per_s(&self, seen: &Seen) -> f64 {
        match seen.region {
            BodyRegion::Head | BodyRegion::Torso => self.config.stands_m_per_s,
            BodyRegion::Arm => self.config.meets_arm_m_per_s,
        }
    }

    /// The gap while an arm at `q` that moves at `qd` reacts and comes to rest, and the person comes nearer all the time, from where they
    /// were last seen. Parts of the arm that stand do not count, nor for the person's arms those that are slow enough.
    ///
    /// An arm that `leaves`, because it is pushed or withdraws, may move parts away from the person, who counts as not having moved
    /// since: a hand that is squeezed for certain comes before a head that may have come nearer.
    ///
    /// `None`: no person is known, or no part moves. NaN of the arm leaves a gap of NaN.
    ///
    /// A lower bound. Far from the person it is found with one look at the arm. Near them, between two looks the distance of a part is
    /// at least the mean of both minus half the way that it moved.
    #[must_use]
    pub fn gap(
        &self,
        q: &JointPositions,
        qd: &JointVelocities,
        person: &PersonBody,
        now_s: f64,
        leaves: bool,
    ) -> Option<Gap> {
        self.gap_from(&self.body.at(q), (q, qd), person, now_s, leaves)
    }

    /// `here`: the capsules at `q`.
    pub(crate) fn gap_from(
        &self,
        here: &ArmCapsules,
        (q, qd): (&JointPositions, &JointVelocities),
        person: &PersonBody,
        now_s: f64,
        leaves: bool,
    ) -> Option<Gap> {
        let most_m_per_s = self.body.most_m_per_s(qd);
        if most_m_per_s <= self.config.stands_m_per_s {
            return None;
        }
        let stop_s = (qd.0.iter().zip(&self.braking_rad_per_s2))
            .map(|(qd, most)| qd.abs() / most)
            .fold(0.0, f64::max);
        let SeparationConfig {
            person_m_per_s,
            latency_s,
            clearance_m,
            ..
        } = self.config;
        let along = |time_s: f64| {
            let braking_s = (time_s - latency_s).clamp(0.0, stop_s);
            let braked_s = match stop_s > 0.0 {
                true => braking_s * (1.0 - 0.5 * braking_s / stop_s),
                false => 0.0,
            };
            let moving_s = time_s.min(latency_s) + braked_s;
            let at = JointPositions(std::array::from_fn(|i| q[i] + qd[i] * moving_s));
            self.body.at(&at)
        };
        let mut before = *here;
        let mut worst: Option<Gap> = None;
        let gap = |least_m: f64, seen: &Seen, until_s: f64| {
            // A stamp ahead of time shows by how much the clocks differ.
            let age_s = match leaves {
                true => 0.0,
                false => (now_s - seen.stamp_s).abs(),
            };
            Gap {
                region: seen.region,
                part: seen.part,
                distance_m: least_m,
                left_m: least_m - clearance_m - person_m_per_s * (age_s + until_s),
            }
        };
        let most_way_m = most_m_per_s * (latency_s + 0.5 * stop_s);
        // A lever may grow while the joints brake, but no part becomes twice as fast.
        let reacted = along(latency_s);
        let ways_m = before.all().iter().zip(reacted.all());
        let fastest_m_per_s =
            ways_m
                .map(|(from, to)| from.moved_m(to) / latency_s)
                .fold(0.0, |most, m_per_s| match m_per_s <= most {
                    true => most,
                    false => m_per_s,
                });
        let counts = |seen: &Seen| {
            let is_slow = 2.0 * fastest_m_per_s <= self.harmless_m_per_s(seen);
            !is_slow
        };
        // Parts that are far from somebody now stay so.
        let mut distances_m = [[None; MOST_SEEN]; MOST_PARTS];
        let mut is_any_near = false;
        for (part, distances_m) in before.all().iter().zip(&mut distances_m) {
            for (seen, distance_m) in person.seen().filter(counts).zip(distances_m) {
                let now_m = part.distance_m(&seen.capsule);
                let here = gap(now_m - most_way_m, &seen, latency_s + stop_s);
                match here.left_m >= 0.0 {
                    true => worst = Some(worst.map_or(here, |worst| worst.worse(here))),
                    false => (*distance_m, is_any_near) = (Some(now_m), true),
                }
            }
        }
        if !is_any_near {
            return worst;
        }
        let mut last_s = 0.0;
        for piece in 0..=BRAKING_PIECES {
            let until_s = latency_s + stop_s * piece as f64 / BRAKING_PIECES as f64;
            let after = match piece {
                0 => reacted,
                _ => along(until_s),
            };
            let parts = before.all().iter().zip(after.all());
            for ((was, part), distances_m) in parts.zip(&mut distances_m) {
                let moved_m = was.moved_m(part);
                for (seen, distance_m) in person.seen().filter(counts).zip(distances_m) {
                    let Some(from_m) = *distance_m else {
                        continue;
                    };
                    let to_m = part.distance_m(&seen.capsule);
                    *distance_m = Some(to_m);
                    let is_slow = moved_m <= self.harmless_m_per_s(&seen) * (until_s - last_s);
                    let goes_away = leaves && to_m >= from_m;
                    if is_slow || goes_away {
                        continue;
                    }
                    let here = gap(0.5 * (from_m + to_m - moved_m), &seen, until_s);
                    worst = Some(worst.map_or(here, |worst| worst.worse(here)));
                }
            }
            (before, last_s) = (after, until_s);
        }
        worst
    }
}

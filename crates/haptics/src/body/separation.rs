//! Speed and separation: does the arm stop before a person can reach it?

use super::arm_body::{ArmBody, ArmCapsules, MOST as MOST_PARTS, least_or_nan};
use super::person_body::{BodyRegion, PersonBody, PersonBodyConfig, Seen};
use crate::error::HapticsError;
use crate::safety::PersonPart;
use hwall_kinematics::{JointPositions, JointVelocities, MOST_JOINTS};
use hwall_numeric::check::non_negative;

/// How a moving arm keeps away from a person: all of it from head and torso ([ISO/TS 15066], 5.5.4), parts faster than a harmless speed from the
/// person's arms (5.5.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeparationConfig {
    /// The person's dimensions.
    pub person: PersonBodyConfig,
    /// Approach speed of a person, m/s; default 1.6, that of [ISO 13855] for walking.
    pub person_m_per_s: f64,
    /// Time from a change of the world until braking begins, beyond the age of the newest sample, s; default 0.045: 20 ms of tracker and network, 22
    /// ms of reaction of an iiwa.
    pub latency_s: f64,
    /// Distance left between the person and the stopped arm, m; default 0.02.
    pub clearance_m: f64,
    /// An arm counts as standing if no part is faster than this, m/s; default 0.005.
    pub stands_m_per_s: f64,
    /// Parts up to this speed may meet the person's arms, m/s; default 1.1: twice the 150 N of an upper arm over `sqrt(mu k)`, with 30 N/mm and its 3
    /// kg against 12 kg of an iiwa ([ISO/TS 15066], annex A).
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

/// The remaining distance between arm and person while the arm stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// The nearest region.
    pub region: BodyRegion,
    /// The tracked point that it was derived from.
    pub part: PersonPart,
    /// Distance at the moment of the least margin, m: a lower bound.
    pub distance_m: f64,
    /// Margin beyond the required distance, m: the smallest until the arm stands. If negative, the arm has to brake.
    pub left_m: f64,
}

impl Gap {
    /// The one with the smaller margin; NaN counts as the smallest.
    fn worse(self, other: Self) -> Self {
        match other.left_m < self.left_m || other.left_m.is_nan() {
            true => other,
            false => self,
        }
    }
}

/// Number of intervals of the braking time; the reaction time is one more.
const BRAKING_PIECES: usize = 4;

/// Checks motions of an arm by their distance to a person.
#[derive(Debug, Clone)]
pub struct Separation {
    body: ArmBody,
    config: SeparationConfig,
    braking_rad_per_s2: [f64; MOST_JOINTS],
}

impl Separation {
    /// For an arm whose joints brake together; the slowest to stop brakes at these accelerations, rad/s².
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

    /// By how much this posture is closer than a plan may bring a resting arm, m: to itself or the room (twice the clearance), and to head or torso.
    /// Negative: free. NaN in gives NaN.
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

    /// Speed up to which a part of the arm may meet this part of the person, m/s.
    const fn harmless_m_per_s(&self, seen: &Seen) -> f64 {
        match seen.region {
            BodyRegion::Head | BodyRegion::Torso => self.config.stands_m_per_s,
            BodyRegion::Arm => self.config.meets_arm_m_per_s,
        }
    }

    /// The gap while an arm at `q` with velocity `qd` reacts and stops, and the person approaches all the time from their last known position. Parts
    /// of the arm that stand do not count; for the person's arms, slow parts do not count either.
    ///
    /// An arm that `leaves`, because it is pushed or withdraws, may move parts away from the person, and the age of their position is ignored:
    /// releasing a squeezed hand has priority over a head that may have come closer.
    ///
    /// `None`: no person is known, or no part moves. NaN joints give a gap of NaN.
    ///
    /// The result is a lower bound. Far from the person one check of the arm suffices. Near them, the distance of a part between two samples is at
    /// least their mean minus half the distance that it moved.
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
            // A stamp in the future reveals a clock error of that size.
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
        // A lever may grow while the joints brake, but no part doubles its speed.
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
        // Parts that are far from the person now stay far.
        let mut distances_m = [[None; PersonBody::MOST]; MOST_PARTS];
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

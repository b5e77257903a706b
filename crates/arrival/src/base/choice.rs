//! Where the base goes: the choice of least expected loss.

use super::drive::{BaseDrive, BasePose};
use super::inversion::BaseInversion;
use super::person::BaseSafety;
use super::route::{KeepOutArea, route};
use crate::error::ArrivalError;
use glam::{DVec2, DVec3};
use hwall_numeric::check::{non_negative, positive};

/// Settings of the choice. The unit of loss is a touch that the board misses, as in the policy of `hwall`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseChoiceConfig {
    /// Time of the arm from the base at rest until the board is in place, s; default 0.7.
    pub arm_s: f64,
    /// Scale of the logistic distribution of the time of a touch, s; default 0.4.
    pub scale_s: f64,
    /// Share of the remaining time that is left when a touch elsewhere becomes known; default 0.4, as in the policy.
    pub onset_share: f64,
    /// Further touches that are missed in every second until the base stands where the next one is expected; default 0.15: a touch every 3 to 4 s,
    /// about every second one of them there. So a base that is late for one touch still goes there.
    pub touches_per_s: f64,
    /// The last choice is kept unless another saves this much; default 0.03.
    pub least_gain: f64,
    /// Radius of the robot from above while it drives, m: for the estimate of how much a person slows it down; default 0.45.
    pub robot_radius_m: f64,
}

impl Default for BaseChoiceConfig {
    fn default() -> Self {
        Self {
            arm_s: 0.7,
            scale_s: 0.4,
            onset_share: 0.4,
            touches_per_s: 0.15,
            least_gain: 0.03,
            robot_radius_m: 0.45,
        }
    }
}

/// A place that may be touched next, in the frame of the room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseHypothesis {
    /// The place, m.
    pub point_m: DVec3,
    /// Normal of its wall, towards the person.
    pub normal: DVec3,
    /// Probability that the next touch is there.
    pub probability: f64,
    /// Median of the time until then, s.
    pub touch_s: f64,
    /// Where the person stands then, m.
    pub stands_m: DVec2,
}

/// Legs are cut into this many pieces to see how near they lead past the person.
const PIECES: usize = 8;
/// The base is taken to get past a person at this speed at least, m/s.
const SLOWEST_M_PER_S: f64 = 0.04;

/// Weighs the base poses that serve what may be touched.
#[derive(Debug, Clone, Copy)]
pub struct BaseChooser<'a> {
    config: BaseChoiceConfig,
    safety: BaseSafety,
    inversion: &'a BaseInversion,
    area: KeepOutArea,
}

impl<'a> BaseChooser<'a> {
    /// For the walls of a room and the area that the base stays out of.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(
        config: BaseChoiceConfig,
        safety: BaseSafety,
        inversion: &'a BaseInversion,
        area: KeepOutArea,
    ) -> Result<Self, ArrivalError> {
        safety.validate()?;
        non_negative("arm_s", config.arm_s)?;
        positive("scale_s", config.scale_s)?;
        positive("onset_share", config.onset_share)?;
        non_negative("touches_per_s", config.touches_per_s)?;
        non_negative("least_gain", config.least_gain)?;
        non_negative("robot_radius_m", config.robot_radius_m)?;
        Ok(Self {
            config,
            safety,
            inversion,
            area,
        })
    }

    /// The best base pose and the way there, in the frame of the room; `None` if no place is served from anywhere within reach.
    /// `drive` is in the frame of the room, `last` the pose chosen before.
    #[must_use]
    pub fn choose(
        &self,
        drive: &BaseDrive,
        last: Option<BasePose>,
        hypotheses: &[BaseHypothesis],
    ) -> Option<(BasePose, Vec<DVec2>)> {
        let likeliest = hypotheses
            .iter()
            .max_by(|a, b| a.probability.total_cmp(&b.probability))?;
        let mut served: Vec<u32> = hypotheses
            .iter()
            .flat_map(|h| self.inversion.serving(h.point_m, h.normal))
            .copied()
            .collect();
        served.sort_unstable();
        served.dedup();
        let candidates = served
            .iter()
            .map(|&base| self.inversion.bases()[base as usize]);
        let mut best: Option<(f64, BasePose, Vec<DVec2>)> = None;
        for (to, is_last) in last
            .map(|last| (last, true))
            .into_iter()
            .chain(candidates.map(|to| (to, false)))
        {
            if self.area.contains(to.at_m) {
                continue;
            }
            let Some(way) = route(drive.stopping_m(), to.at_m, &self.area) else {
                continue;
            };
            let arrival_s = self.arrival_s(drive, &to, &way, likeliest.stands_m);
            let kept = if is_last { self.config.least_gain } else { 0.0 };
            let loss = self.loss(&to, arrival_s, hypotheses) - kept;
            if best.as_ref().is_none_or(|(least, ..)| loss < *least) {
                best = Some((loss, to, way));
            }
        }
        best.map(|(_, to, way)| (to, way))
    }

    /// Time until the base rests at the end of a way, s, past a person who stands at a place.
    #[must_use]
    pub fn arrival_s(
        &self,
        drive: &BaseDrive,
        to: &BasePose,
        way: &[DVec2],
        person_m: DVec2,
    ) -> f64 {
        let most = drive.limits().speed_m_per_s;
        let radii_m = self.config.robot_radius_m + self.safety.person_radius_m;
        let allowed = |at_m: DVec2| {
            let gap_m = at_m.distance(person_m) - radii_m;
            let a = drive.limits().acceleration_m_per_s2;
            self.safety
                .speed_at_m_per_s(gap_m, a, most)
                .max(SLOWEST_M_PER_S)
        };
        let mut from_m = drive.stopping_m();
        let mut time_s = drive.begins_s(way.first().copied());
        for &end_m in way {
            let length_m = from_m.distance(end_m);
            time_s += drive.leg_s(length_m, most);
            for piece in 0..PIECES {
                let share = (piece as f64 + 0.5) / PIECES as f64;
                let speed = allowed(from_m.lerp(end_m, share));
                time_s += length_m / PIECES as f64 * (speed.recip() - most.recip());
            }
            from_m = end_m;
        }
        time_s.max(drive.turn_s(to.yaw_rad - drive.state().pose().yaw_rad))
    }

    /// Expected loss of going to a base pose and arriving there after a time, s.
    fn loss(&self, to: &BasePose, arrival_s: f64, hypotheses: &[BaseHypothesis]) -> f64 {
        let c = &self.config;
        let late = |takes_s: f64, left_s: f64| 1.0 / (1.0 + ((left_s - takes_s) / c.scale_s).exp());
        let of = |h: &BaseHypothesis| {
            let bases = self.inversion.serving(h.point_m, h.normal);
            let off_m = |base: &u32| {
                self.inversion.bases()[*base as usize]
                    .at_m
                    .distance(to.at_m)
            };
            let nearest_m = bases.iter().map(off_m).fold(f64::INFINITY, f64::min);
            let there_s = arrival_s + c.arm_s;
            let (missed, served_s) = if nearest_m <= SAME_M {
                (late(there_s, h.touch_s), there_s)
            } else {
                let onwards_s = nearest_m / SLOW_M_PER_S + STARTS_S + c.arm_s;
                let missed = late(onwards_s, c.onset_share * h.touch_s);
                (
                    missed.max(late(there_s, h.touch_s)),
                    arrival_s.max(h.touch_s) + onwards_s,
                )
            };
            h.probability * (missed + c.touches_per_s * served_s.min(LONGEST_S))
        };
        hypotheses.iter().map(of).sum()
    }
}

/// Base poses this near to each other serve the same, m.
const SAME_M: f64 = 0.05;
/// Mean speed of a short way near a person, m/s, and the time to start and stop, s.
const SLOW_M_PER_S: f64 = 0.4;
const STARTS_S: f64 = 1.0;
/// Places that nothing serves count as served after this time, s.
const LONGEST_S: f64 = 60.0;

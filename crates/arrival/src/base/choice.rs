//! Where the base goes: the choice of least expected loss.

use super::drive::{BaseDrive, BasePose};
use super::inversion::BaseInversion;
use super::route::{KeepOutArea, route};
use crate::error::ArrivalError;
use glam::{DVec2, DVec3};
use hwall_numeric::check::{all_finite, non_negative, positive};

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
    /// Top speed on all ways, m/s; default 0.6: less than the base's own, because it slows down beside the person.
    pub speed_m_per_s: f64,
}

impl Default for BaseChoiceConfig {
    fn default() -> Self {
        Self {
            arm_s: 0.7,
            scale_s: 0.4,
            onset_share: 0.4,
            touches_per_s: 0.15,
            least_gain: 0.03,
            speed_m_per_s: 0.6,
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
}

impl BaseHypothesis {
    fn is_finite(&self) -> bool {
        let numbers = [self.probability, self.touch_s];
        let is_place = self.point_m.is_finite() && self.normal.is_finite();
        is_place && numbers.iter().all(|number| number.is_finite())
    }
}

/// Weighs the base poses that serve what may be touched.
#[derive(Debug, Clone, Copy)]
pub struct BaseChooser<'a> {
    config: BaseChoiceConfig,
    inversion: &'a BaseInversion,
    area: KeepOutArea,
}

impl<'a> BaseChooser<'a> {
    /// For the walls of a room and the area that the base stays out of.
    ///
    /// # Errors
    /// A setting outside its range; an area that is not finite.
    pub fn new(
        config: BaseChoiceConfig,
        inversion: &'a BaseInversion,
        area: KeepOutArea,
    ) -> Result<Self, ArrivalError> {
        non_negative("arm_s", config.arm_s)?;
        positive("scale_s", config.scale_s)?;
        positive("onset_share", config.onset_share)?;
        non_negative("touches_per_s", config.touches_per_s)?;
        non_negative("least_gain", config.least_gain)?;
        positive("speed_m_per_s", config.speed_m_per_s)?;
        let (low_m, high_m) = (area.low_m, area.high_m);
        let corners = [low_m.x, low_m.y, high_m.x, high_m.y];
        all_finite("area that the base stays out of", &corners)?;
        Ok(Self {
            config,
            inversion,
            area,
        })
    }

    /// The best base pose and the way there, in the frame of the room; `None` if no place is served from anywhere within reach.
    /// `drive` is in the frame of the room, `last` the pose chosen before. Hypotheses and a last pose that are not finite do not count.
    #[must_use]
    pub fn choose(
        &self,
        drive: &BaseDrive,
        last: Option<BasePose>,
        hypotheses: &[BaseHypothesis],
    ) -> Option<(BasePose, Vec<DVec2>)> {
        let hypotheses = hypotheses.iter().filter(|h| h.is_finite());
        let hypotheses: Vec<BaseHypothesis> = hypotheses.copied().collect();
        let last = last.filter(BasePose::is_finite);
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
            let turn_s = drive.turn_s(to.yaw_rad - drive.state().pose().yaw_rad);
            let way_s = self.way_s(drive, drive.stopping_m(), &way);
            let arrival_s = turn_s.max(drive.begins_s(way.first().copied()) + way_s);
            let kept = if is_last { self.config.least_gain } else { 0.0 };
            let loss = self.loss(drive, &to, arrival_s, &hypotheses) - kept;
            if best.as_ref().is_none_or(|(least, ..)| loss < *least) {
                best = Some((loss, to, way));
            }
        }
        best.map(|(_, to, way)| (to, way))
    }

    /// Time for a way from rest to rest, s.
    fn way_s(&self, drive: &BaseDrive, from_m: DVec2, way: &[DVec2]) -> f64 {
        let legs = std::iter::once(&from_m).chain(way).zip(way);
        legs.map(|(a, b)| drive.leg_s(a.distance(*b), self.config.speed_m_per_s))
            .sum()
    }

    /// Expected loss of going to a base pose and arriving there after a time, s.
    ///
    /// From a pose that does not serve a place the base goes on as soon as it is there and the place is known. Ways now and later are charged alike.
    fn loss(
        &self,
        drive: &BaseDrive,
        to: &BasePose,
        arrival_s: f64,
        hypotheses: &[BaseHypothesis],
    ) -> f64 {
        let c = &self.config;
        let of = |h: &BaseHypothesis| {
            let bases = self.inversion.serving(h.point_m, h.normal);
            let bases = bases
                .iter()
                .map(|&i| self.inversion.bases()[i as usize].at_m);
            let nearest = bases.min_by(|a, b| {
                let [a_m, b_m] = [a, b].map(|m| m.distance(to.at_m));
                a_m.total_cmp(&b_m)
            });
            let served_s = match nearest {
                Some(at_m) if at_m.distance(to.at_m) <= SAME_M => arrival_s,
                Some(at_m) => {
                    let known_s = (1.0 - c.onset_share) * h.touch_s;
                    let way = route(to.at_m, at_m, &self.area);
                    let on_s = way.map_or(LONGEST_S, |way| self.way_s(drive, to.at_m, &way));
                    arrival_s.max(known_s) + on_s
                }
                None => LONGEST_S,
            };
            let there_s = (served_s + c.arm_s).min(LONGEST_S);
            let late = 1.0 / (1.0 + ((h.touch_s - there_s) / c.scale_s).exp());
            h.probability * (late + c.touches_per_s * there_s)
        };
        hypotheses.iter().map(of).sum()
    }
}

/// Base poses this near to each other serve the same, m.
const SAME_M: f64 = 0.05;
/// Places that nothing serves count as served after this time, s.
const LONGEST_S: f64 = 60.0;

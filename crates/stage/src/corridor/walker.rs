//! A simulated person who walks from place to place and touches there, in the frame of the corridor.

use super::hall::{DOOR_Y_M, SIDE_M};
use super::visits::Visit;
use crate::person::kinds::PersonKind;
use glam::{DVec2, DVec3, dvec2};
use hwall_hand::{HandFrame, Pose};
use hwall_motion::{JointBounds, JointPoint};
use hwall_sim::{Person, PersonConfig, TouchSequence, TouchTruth, minimum_jerk};
use hwall_testkit::Sampler;
use std::f64::consts::{PI, TAU};

/// A natural walk: speed, m/s, acceleration, m/s², and jerk, m/s³. Speed: [Bohannon 1997] has 1.3 to 1.46 for comfortable walking in the open; the
/// others are assumptions.
const WALK: [f64; 3] = [1.2, 1.2, 6.0];
/// The body turns towards the way, and from it, within this time, s; a corner of the way is
/// rounded within this distance before and behind it, m: at 1.2 m/s a right angle then takes 1.7 m/s².
const TURN_S: f64 = 1.2;
const TURN_M: f64 = 0.6;
/// Ways through a door pass its middle this far beyond the wall, m.
const PAST_DOOR_M: f64 = 0.4;

/// What a walker is doing, since a time.
enum Phase {
    Walks(Walk),
    /// Touches; the sequence begins at that time.
    Touches(Box<TouchSequence>),
    /// Before a door that is still closed.
    Waits,
    Done,
}

/// A way from one standing place to another.
struct Walk {
    /// The way and its length, m, and the headings of the body at its ends, rad.
    way_m: Vec<DVec2>,
    length_m: f64,
    yaws_rad: [f64; 2],
    bounds: JointBounds,
    duration_s: f64,
    /// The first touch there, which the eyes are on.
    looks_at_m: DVec3,
}

/// The walker.
pub(super) struct Walker<'a> {
    visits: &'a [Visit],
    kind: PersonKind,
    seed: u64,
    /// Speed of reaches and length of the hand, the same at all places.
    habits: [f64; 2],
    at: usize,
    phase: Phase,
    since_s: f64,
}

/// Where the body is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Body {
    /// The floor below the eyes, m.
    pub(super) at_m: DVec2,
    pub(super) yaw_rad: f64,
    pub(super) speed_m_per_s: f64,
}

impl<'a> Walker<'a> {
    /// Comes in through the first door.
    pub(super) fn new(visits: &'a [Visit], kind: PersonKind, seed: u64) -> anyhow::Result<Self> {
        let person = Person::new(kind.config(seed), seed)?;
        let mut walker = Self {
            visits,
            kind,
            seed,
            habits: [person.mean_reach_s(), person.hand_length_m()],
            at: 0,
            phase: Phase::Done,
            since_s: 0.0,
        };
        walker.phase = Phase::Walks(walker.walk(dvec2(PAST_DOOR_M, DOOR_Y_M), 0.0, 0)?);
        Ok(walker)
    }

    /// Is the last touch over?
    pub(super) const fn is_done(&self) -> bool {
        matches!(self.phase, Phase::Done)
    }

    /// Does the walker wait before a closed door?
    pub(super) const fn waits(&self) -> bool {
        matches!(self.phase, Phase::Waits)
    }

    /// The present visit, or that to which the walker is walking.
    pub(super) fn visit(&self) -> &Visit {
        &self.visits[self.at]
    }

    /// Its number.
    pub(super) const fn number(&self) -> usize {
        self.at
    }

    /// Goes on to what is next at a time, s. A door opens only if it may.
    pub(super) fn advance(&mut self, t_s: f64, door_opens: bool) -> anyhow::Result<()> {
        let after_s = t_s - self.since_s;
        let next = match &self.phase {
            Phase::Walks(walk) if after_s >= walk.duration_s => {
                Phase::Touches(Box::new(self.sequence()?))
            }
            Phase::Touches(sequence) if after_s >= sequence.duration_s() => {
                match self.at + 1 == self.visits.len() {
                    true => Phase::Done,
                    false if self.visit().leaves => Phase::Waits,
                    false => self.goes_on()?,
                }
            }
            Phase::Waits if door_opens => self.goes_on()?,
            _ => return Ok(()),
        };
        (self.phase, self.since_s) = (next, t_s);
        Ok(())
    }

    fn goes_on(&mut self) -> anyhow::Result<Phase> {
        let from = self.visit();
        let (from_m, yaw_rad) = (from.stands_m, yaw_of(from.facing));
        self.at += 1;
        Ok(Phase::Walks(self.walk(from_m, yaw_rad, self.at)?))
    }

    fn walk(&self, from_m: DVec2, yaw_rad: f64, to: usize) -> anyhow::Result<Walk> {
        let visit = &self.visits[to];
        let mut way_m = vec![from_m];
        if to > 0 && self.visits[to - 1].room != visit.room {
            way_m.push(dvec2(visit.room as f64 * SIDE_M + PAST_DOOR_M, DOOR_Y_M));
        }
        way_m.push(visit.stands_m);
        let length_m: f64 = way_m.windows(2).map(|leg| leg[0].distance(leg[1])).sum();
        let bounds = JointBounds::new(WALK[0], WALK[1], WALK[2])?;
        let walk_s = JointPoint::default().time_to_s(length_m, &bounds);
        Ok(Walk {
            way_m,
            length_m,
            yaws_rad: [yaw_rad, yaw_of(visit.facing)],
            bounds,
            duration_s: walk_s.max(TURN_S),
            looks_at_m: visit.touches[0].target_m,
        })
    }

    /// The person who stands at the present place.
    fn person(&self) -> anyhow::Result<Person> {
        let [reach_s, hand_m] = self.habits;
        let config = PersonConfig {
            mean_reach_s: [reach_s; 2],
            hand_length_m: [hand_m; 2],
            ..self.visit().person(self.kind, self.seed)?
        };
        // Other draws at every place; the habits are the person's.
        let seed = Sampler::new(self.seed ^ (self.at as u64) << 32).index(usize::MAX) as u64;
        Ok(Person::new(config, seed)?)
    }

    fn sequence(&self) -> anyhow::Result<TouchSequence> {
        Ok(self.person()?.plan(&self.visit().touches)?)
    }

    /// Where the body is at a time, s.
    pub(super) fn body(&self, t_s: f64) -> Body {
        match &self.phase {
            Phase::Walks(walk) => walk.body(t_s - self.since_s),
            _ => Body {
                at_m: self.visit().stands_m,
                yaw_rad: yaw_of(self.visit().facing),
                speed_m_per_s: 0.0,
            },
        }
    }

    /// What a tracker sees at a time, s.
    pub(super) fn frame(&self, t_s: f64) -> anyhow::Result<HandFrame> {
        let frame = match &self.phase {
            Phase::Touches(sequence) => sequence.tracked(t_s - self.since_s),
            Phase::Walks(walk) => {
                let body = walk.body(t_s - self.since_s);
                let now = Pose::from_yaw(body.yaw_rad, body.at_m.extend(0.0))?;
                let mut frame = self.at_rest(t_s, &now)?;
                let head_m = frame.head_m.unwrap_or_default();
                frame.gaze = Some(self.gaze(t_s, walk.looks_at_m - head_m));
                frame
            }
            Phase::Waits | Phase::Done => self.at_rest(t_s, &self.visit().body()?)?,
        };
        Ok(HandFrame { t_s, ..frame })
    }

    /// The resting person of the present place, moved to where the body is.
    fn at_rest(&self, t_s: f64, body: &Pose) -> anyhow::Result<HandFrame> {
        let rests = self.person()?.plan(&[])?;
        let moved = body.to_affine() * self.visit().body()?.inverse().to_affine();
        Ok(rests.tracked(t_s).transformed(&Pose::from_affine(&moved)?))
    }

    /// The direction to what is looked at, with the errors of eyes and tracker.
    fn gaze(&self, t_s: f64, towards: DVec3) -> DVec3 {
        let config = self.kind.config(self.seed);
        let direction = towards.normalize_or(DVec3::X);
        let (a, b) = direction.any_orthonormal_pair();
        let off = |seed: u64, sd_rad: f64| {
            let mut sampler = Sampler::new(seed);
            (a * sampler.normal() + b * sampler.normal()) * sd_rad
        };
        let fixed = off(self.seed ^ self.at as u64, config.gaze_offset_rad);
        let noise = off(self.seed ^ t_s.to_bits(), config.gaze_noise_rad);
        (direction + fixed + noise).normalize()
    }

    /// The true index tip and its velocity at a time, while the person touches: m, m/s.
    pub(super) fn tip(&self, t_s: f64) -> Option<(DVec3, DVec3)> {
        let Phase::Touches(sequence) = &self.phase else {
            return None;
        };
        let t_s = t_s - self.since_s;
        Some((
            sequence.true_index_tip(t_s),
            sequence.true_index_velocity_m_per_s(t_s),
        ))
    }

    /// The touches of the present visit and when they begin, s; `None` on the way there.
    pub(super) fn touches(&self) -> Option<(f64, &[TouchTruth])> {
        match &self.phase {
            Phase::Touches(sequence) => Some((self.since_s, sequence.touches())),
            _ => None,
        }
    }
}

impl Walk {
    fn body(&self, after_s: f64) -> Body {
        let since_s = after_s.max(1e-9);
        let along = JointPoint::default().towards(self.length_m, &self.bounds, since_s);
        let (mut at_m, mut way_rad) = (self.way_m[0], None);
        let (mut last, mut bend_m) = (DVec2::ZERO, DVec2::ZERO);
        // Distance from the beginning of each leg.
        let mut on_leg_m = along.q_rad;
        for leg in self.way_m.windows(2) {
            let leg_m = leg[0].distance(leg[1]);
            if leg_m == 0.0 {
                continue;
            }
            let direction = (leg[1] - leg[0]) / leg_m;
            if last != DVec2::ZERO {
                let near_m = (TURN_M - on_leg_m.abs()).max(0.0);
                bend_m += (direction - last) * near_m.powi(2) / (4.0 * TURN_M);
            }
            last = direction;
            let yaw_rad = yaw_of(direction);
            let turned = minimum_jerk(0.5 + 0.5 * on_leg_m / TURN_M);
            way_rad = Some(way_rad.map_or(yaw_rad, |last| last + turned * shorter(yaw_rad - last)));
            if on_leg_m >= 0.0 {
                at_m = leg[0].lerp(leg[1], (on_leg_m / leg_m).min(1.0));
            }
            on_leg_m -= leg_m;
        }
        let way_rad = way_rad.unwrap_or(self.yaws_rad[0]);
        let begins = minimum_jerk(after_s / TURN_S);
        let ends = minimum_jerk((after_s - self.duration_s) / TURN_S + 1.0);
        let first = self.yaws_rad[0] + begins * shorter(way_rad - self.yaws_rad[0]);
        Body {
            at_m: at_m + bend_m,
            yaw_rad: first + ends * shorter(self.yaws_rad[1] - first),
            speed_m_per_s: along.qd_rad_per_s,
        }
    }
}

fn yaw_of(direction: DVec2) -> f64 {
    direction.y.atan2(direction.x)
}

/// An angle taken the shorter way round, rad.
pub(super) fn shorter(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

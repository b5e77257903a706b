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

/// A natural walk: speed, m/s, acceleration, m/s², and jerk, m/s³. Speed: [Bohannon 1997] gives 1.3 to 1.46 for comfortable walking in the
/// open; the others are assumptions.
pub(super) const WALK: [f64; 3] = [1.2, 1.2, 6.0];
/// Time in which the body turns at the beginning and the end of a walk, s. Distance before and after a corner within which the path is
/// rounded, m: at 1.2 m/s a right angle then needs 1.7 m/s².
pub(super) const TURN_S: f64 = 1.2;
const TURN_M: f64 = 0.6;
/// Paths through a door pass its middle line up to this far beyond the wall, m.
const PAST_DOOR_M: f64 = 0.4;

/// Activity of a walker.
enum Phase {
    Walks(Box<Walk>),
    Touches,
    /// At a door that is still closed.
    Waits,
    Done,
}

/// A person at a standing place: rests, touches from this time on, rests.
#[derive(Clone)]
struct Stay {
    corridor_from_body: Pose,
    begins_s: f64,
    sequence: TouchSequence,
}

/// A walk from one standing place to another, with its start time.
struct Walk {
    since_s: f64,
    /// The way and its length, m, and the headings of the body at its ends, rad.
    way_m: Vec<DVec2>,
    length_m: f64,
    yaws_rad: [f64; 2],
    bounds: JointBounds,
    duration_s: f64,
    /// The first touch there, which the eyes fixate.
    looks_at_m: DVec3,
    next: Stay,
}

/// The walker.
pub(super) struct Walker<'a> {
    visits: &'a [Visit],
    kind: PersonKind,
    seed: u64,
    /// Speed of reaches and length of the hand, the same at all places.
    habits: [f64; 2],
    at: usize,
    /// At the present place, or at the last one.
    stay: Stay,
    phase: Phase,
}

/// Pose of the body.
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
        let habits = [person.mean_reach_s(), person.hand_length_m()];
        let sequence = person.plan(&[])?;
        let mut walker = Self {
            visits,
            kind,
            seed,
            habits,
            at: 0,
            stay: Stay {
                corridor_from_body: Pose::IDENTITY,
                begins_s: 0.0,
                sequence,
            },
            phase: Phase::Done,
        };
        let walk = walker.walk(0.0, dvec2(PAST_DOOR_M, DOOR_Y_M), 0.0)?;
        walker.stay = walk.next.clone();
        walker.phase = Phase::Walks(Box::new(walk));
        Ok(walker)
    }

    /// Is the last touch over?
    pub(super) const fn is_done(&self) -> bool {
        matches!(self.phase, Phase::Done)
    }

    /// Does the walker wait at a closed door?
    pub(super) const fn waits(&self) -> bool {
        matches!(self.phase, Phase::Waits)
    }

    /// The present visit, or the visit to which the walker walks.
    pub(super) fn visit(&self) -> &Visit {
        &self.visits[self.at]
    }

    /// Its number.
    pub(super) const fn number(&self) -> usize {
        self.at
    }

    /// Advances to this time, s. `door_opens`: doors may open.
    pub(super) fn advance(&mut self, t_s: f64, door_opens: bool) -> anyhow::Result<()> {
        match &mut self.phase {
            Phase::Walks(walk) if t_s >= walk.next.begins_s => {
                std::mem::swap(&mut self.stay, &mut walk.next);
                self.phase = Phase::Touches;
            }
            Phase::Touches if t_s >= self.stay.begins_s + self.stay.sequence.duration_s() => {
                match self.at + 1 == self.visits.len() {
                    true => self.phase = Phase::Done,
                    false if self.visit().leaves => self.phase = Phase::Waits,
                    false => self.goes_on(t_s)?,
                }
            }
            Phase::Waits if door_opens => self.goes_on(t_s)?,
            _ => {}
        }
        Ok(())
    }

    fn goes_on(&mut self, t_s: f64) -> anyhow::Result<()> {
        let from = self.visit();
        let (from_m, yaw_rad) = (from.stands_m, yaw_of(from.facing));
        self.at += 1;
        self.phase = Phase::Walks(Box::new(self.walk(t_s, from_m, yaw_rad)?));
        Ok(())
    }

    /// The walk to the present visit.
    fn walk(&self, since_s: f64, from_m: DVec2, yaw_rad: f64) -> anyhow::Result<Walk> {
        let visit = self.visit();
        let mut way_m = vec![from_m];
        if self.at > 0 && self.visits[self.at - 1].room != visit.room {
            way_m.push(dvec2(visit.room as f64 * SIDE_M + PAST_DOOR_M, DOOR_Y_M));
        }
        way_m.push(visit.stands_m);
        let length_m: f64 = way_m.windows(2).map(|leg| leg[0].distance(leg[1])).sum();
        let bounds = JointBounds::new(WALK[0], WALK[1], WALK[2])?;
        let walk_s = JointPoint::default().time_to_s(length_m, &bounds);
        let duration_s = walk_s.max(TURN_S);
        Ok(Walk {
            since_s,
            way_m,
            length_m,
            yaws_rad: [yaw_rad, yaw_of(visit.facing)],
            bounds,
            duration_s,
            looks_at_m: visit.touches[0].target_m,
            next: Stay {
                corridor_from_body: visit.body()?,
                begins_s: since_s + duration_s,
                sequence: self.person()?.plan(&visit.touches)?,
            },
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
        // New random draws at every place; the habits stay the same.
        let seed = Sampler::new(self.seed ^ (self.at as u64) << 32).index(usize::MAX) as u64;
        Ok(Person::new(config, seed)?)
    }

    /// Pose of the body at a time, s.
    pub(super) fn body(&self, t_s: f64) -> Body {
        match &self.phase {
            Phase::Walks(walk) => walk.body(t_s),
            _ => Body {
                at_m: self.visit().stands_m,
                yaw_rad: yaw_of(self.visit().facing),
                speed_m_per_s: 0.0,
            },
        }
    }

    /// What a tracker sees at a time, s.
    pub(super) fn frame(&self, t_s: f64) -> anyhow::Result<HandFrame> {
        let mut frame = self.seen(t_s, TouchSequence::tracked)?;
        if let Phase::Walks(walk) = &self.phase {
            let head_m = frame.head_m.unwrap_or_default();
            frame.gaze = Some(self.gaze(t_s, walk.looks_at_m - head_m));
        }
        Ok(frame)
    }

    /// Head and hand as they are at a time, s.
    pub(super) fn truth(&self, t_s: f64) -> anyhow::Result<HandFrame> {
        self.seen(t_s, |sequence, t_s| sequence.truth(t_s).hand_frame())
    }

    /// During a walk, blends from the resting person at one place to that at the next.
    fn seen(
        &self,
        t_s: f64,
        of: impl Fn(&TouchSequence, f64) -> HandFrame,
    ) -> anyhow::Result<HandFrame> {
        let at = |stay: &Stay| of(&stay.sequence, t_s - stay.begins_s);
        let frame = match &self.phase {
            Phase::Walks(walk) => {
                let body = walk.body(t_s);
                let now = Pose::from_yaw(body.yaw_rad, body.at_m.extend(0.0))?.to_affine();
                let moved = |stay: &Stay| {
                    let by = now * stay.corridor_from_body.inverse().to_affine();
                    Ok(at(stay).transformed(&Pose::from_affine(&by)?))
                };
                let share = minimum_jerk((t_s - walk.since_s) / walk.duration_s);
                let ends: [anyhow::Result<_>; 2] = [moved(&self.stay), moved(&walk.next)];
                let [last, next] = ends;
                between(&last?, &next?, share)
            }
            _ => at(&self.stay),
        };
        Ok(HandFrame { t_s, ..frame })
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
        matches!(self.phase, Phase::Touches).then(|| {
            let (sequence, t_s) = (&self.stay.sequence, t_s - self.stay.begins_s);
            let velocity = sequence.true_index_velocity_m_per_s(t_s);
            (sequence.true_index_tip(t_s), velocity)
        })
    }

    /// The touches of the present visit and their start, s; `None` while walking there.
    pub(super) fn touches(&self) -> Option<(f64, &[TouchTruth])> {
        let touches = matches!(self.phase, Phase::Touches);
        touches.then(|| (self.stay.begins_s, self.stay.sequence.touches()))
    }
}

/// Interpolates the points of two frames.
fn between(a: &HandFrame, b: &HandFrame, share: f64) -> HandFrame {
    let mixed = |a: Option<DVec3>, b: Option<DVec3>| Some(a?.lerp(b?, share));
    HandFrame {
        palm_m: mixed(a.palm_m, b.palm_m),
        tips_m: std::array::from_fn(|i| mixed(a.tips_m[i], b.tips_m[i])),
        head_m: mixed(a.head_m, b.head_m),
        ..*b
    }
}

impl Walk {
    /// Pose of the body at a time, s.
    fn body(&self, t_s: f64) -> Body {
        let after_s = t_s - self.since_s;
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

/// The equivalent angle of least magnitude, rad.
pub(super) fn shorter(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

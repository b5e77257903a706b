//! The renderer's response to a supervisor: withdraw the board, and slow down.

use super::object::path_follower::PathFollower;
use super::proximity::SHARES;
use super::yielding::{Yielding, is_push};
use crate::motion::Follower;
use crate::object::ObjectPath;
use hwall_kinematics::{ArmKinematics, JointPositions, JointTorques, JointVelocities};
use std::sync::Arc;

/// Acceleration at the start and end of a withdrawal, m/s².
const ACCELERATION_M_PER_S2: f64 = 1.0;

/// Moves the board back along -normal of its face, and away from obstacles.
#[derive(Debug, Clone)]
pub(super) struct Withdrawal {
    path: PathFollower,
    way: Option<Way>,
    yielding: Yielding,
    /// Where a push has taken the arm; the retreat is then over.
    pushed_to: Option<JointPositions>,
    qd: JointVelocities,
}

/// The retreat in progress.
#[derive(Debug, Clone, Copy)]
struct Way {
    /// Its length, m: shorter where the arm cannot continue.
    length_m: f64,
    done_m: f64,
    speed_m_per_s: f64,
}

impl Withdrawal {
    /// The tool of the arm is the face of the board.
    pub(super) fn new(arm: Arc<dyn ArmKinematics>) -> Self {
        Self {
            path: PathFollower::new(arm, hwall_motion::IIWA7_ACCELERATION_RAD_PER_S2),
            way: None,
            yielding: Yielding::default(),
            pushed_to: None,
            qd: JointVelocities::default(),
        }
    }

    /// One step of yielding to a push on the arm, from the follower's commanded configuration.
    pub(super) fn give_way(
        &mut self,
        follower: &Follower,
        torque: Option<&JointTorques>,
        speed_m_per_s: f64,
        dt_s: f64,
    ) -> JointPositions {
        let arm = follower.arm();
        let from = self.pushed_to.unwrap_or(match self.way {
            Some(_) => *self.path.q(),
            None => follower.commanded(),
        });
        self.qd = self
            .yielding
            .step(&**arm, &from, torque, speed_m_per_s, dt_s);
        let limits = arm.limits();
        let q = JointPositions(std::array::from_fn(|i| {
            let to = from[i] + self.qd[i] * dt_s;
            to.clamp(
                limits[i].min_rad.min(from[i]),
                limits[i].max_rad.max(from[i]),
            )
        }));
        self.pushed_to = Some(q);
        q
    }

    /// Was the arm pushed, or is it now?
    pub(super) fn is_pushed(&self, arm: &dyn ArmKinematics, torque: Option<&JointTorques>) -> bool {
        self.pushed_to.is_some() || torque.is_some_and(|torque| is_push(arm, torque))
    }

    /// One step back from the follower's commanded pose; `None` if that is not finite. A board that is already behind all surfaces withdraws by that
    /// much less.
    pub(super) fn step(
        &mut self,
        follower: &Follower,
        behind_m: f64,
        speed_m_per_s: f64,
        dt_s: f64,
    ) -> Option<JointPositions> {
        let mut way = match self.way {
            Some(way) => way,
            None => {
                let direction = -follower.commanded_pose().rotation().z_axis;
                let in_front_m = follower.protrusion_m().unwrap_or(0.0);
                let path = ObjectPath::sliding(direction).ok()?;
                self.path.begin(path, 0.0, &follower.commanded()).ok()?;
                Way {
                    length_m: (behind_m + in_front_m).clamp(0.0, behind_m.max(0.0)),
                    done_m: 0.0,
                    speed_m_per_s: 0.0,
                }
            }
        };
        let left_m = (way.length_m - way.done_m).max(0.0);
        way.speed_m_per_s = (way.speed_m_per_s + ACCELERATION_M_PER_S2 * dt_s)
            .min(speed_m_per_s)
            .min((2.0 * ACCELERATION_M_PER_S2 * left_m).sqrt());
        let next_m = (way.done_m + way.speed_m_per_s * dt_s).min(way.length_m);
        let before = *self.path.q();
        match self.path.go_to(next_m) {
            Ok(None) => way.done_m = next_m,
            _ => (way.length_m, way.speed_m_per_s) = (way.done_m, 0.0),
        }
        let q = *self.path.q();
        if dt_s > 0.0 {
            self.qd = JointVelocities(std::array::from_fn(|i| (q[i] - before[i]) / dt_s));
        }
        self.way = Some(way);
        Some(q)
    }

    /// Was the arm pushed in this retreat?
    pub(super) const fn was_pushed(&self) -> bool {
        self.pushed_to.is_some()
    }

    /// Ends the retreat: returns the arm's configuration and velocity; `None` if there was none.
    pub(super) fn end(&mut self) -> Option<(JointPositions, JointVelocities)> {
        self.yielding = Yielding::default();
        let (way, pushed_to) = (self.way.take(), self.pushed_to.take());
        let q = pushed_to.or(way.map(|_| *self.path.q()))?;
        Some((q, self.qd))
    }
}

/// The share of the joint speeds that a supervisor allows: after a cut it is restored step by step.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpeedCap {
    most: f64,
    /// Time without a cut, s.
    sound_s: f64,
    /// Time since the last cut that counted, s.
    since_cut_s: f64,
    /// Time since a share was last restored, s.
    since_given_s: f64,
    /// Time without a cut before the next share is restored, s.
    wait_s: f64,
}

impl Default for SpeedCap {
    fn default() -> Self {
        Self {
            most: 1.0,
            sound_s: 0.0,
            since_cut_s: f64::INFINITY,
            since_given_s: f64::INFINITY,
            wait_s: GIVEN_BACK_S,
        }
    }
}

/// Cuts within this time of the last one count as the same cut, s: a motion takes that long to slow down, even if no joint is fast.
const CUT_S: f64 = 0.02;

/// After this time without a cut the next larger share is tried, s.
const GIVEN_BACK_S: f64 = 0.1;
/// If a share is cut again within [`GIVEN_BACK_S`], it was too large, and the wait before the next try doubles, up to this, s. Otherwise an arm near
/// a person would brake and accelerate eight times a second.
const MOST_WAIT_S: f64 = 0.8;

impl SpeedCap {
    /// Whatever pushed the arm may still be there: full speed is restored step by step.
    pub(super) const fn begin_slowly(&mut self) {
        (self.most, self.sound_s) = (SHARES[0], 0.0);
    }

    /// `asked`: share of the last command that passed; `in_force`: share of the joint speeds of that command; `has_slowed`: no joint is faster than
    /// that.
    pub(super) fn step(&mut self, asked: f64, in_force: f64, has_slowed: bool, dt_s: f64) -> f64 {
        self.since_cut_s += dt_s;
        self.since_given_s += dt_s;
        // NaN counts as a cut.
        if asked.is_nan() || asked < 1.0 {
            // Another cut while the motion is still slowing down does not count.
            if self.most >= in_force && has_slowed && self.since_cut_s >= CUT_S {
                self.since_cut_s = 0.0;
                self.wait_s = match self.since_given_s {
                    since_s if since_s < GIVEN_BACK_S => (2.0 * self.wait_s).min(MOST_WAIT_S),
                    since_s if since_s > MOST_WAIT_S => GIVEN_BACK_S,
                    _ => self.wait_s,
                };
                let fitting = SHARES.into_iter().filter(|share| *share < in_force);
                self.most = fitting.fold(SHARES[0], f64::max);
            }
            self.sound_s = 0.0;
        } else if self.most < 1.0 {
            self.sound_s += dt_s;
            if self.sound_s >= self.wait_s {
                if self.since_cut_s > self.since_given_s {
                    self.wait_s = GIVEN_BACK_S;
                }
                (self.sound_s, self.since_given_s) = (0.0, 0.0);
                let more = SHARES.into_iter().find(|share| *share > self.most);
                self.most = more.unwrap_or(1.0);
            }
        }
        self.most
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::FollowerConfig;
    use hwall_kinematics::SrsArm;

    #[test]
    fn cuts_in_a_row_are_one_until_the_motion_has_slowed_down() {
        let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        let goal = JointPositions::from_deg([40.0, 50.0, 20.0, -60.0, 30.0, -50.0, 40.0]);
        // Just begun, under way, and near the end, where no joint is fast.
        for steps in [5, 60, 200, 900] {
            let arm = Arc::new(SrsArm::iiwa7());
            let mut follower = Follower::new(arm, FollowerConfig::default(), &start).unwrap();
            follower.set_posture(&goal, None).unwrap();
            follower.set_speed_share(0.5).unwrap();
            for _ in 0..steps {
                follower.step(DT_S).unwrap();
            }
            let (mut cap, mut share) = (SpeedCap::default(), 0.5);
            for k in 0..420 {
                share = cap.step(0.5, share, follower.has_slowed(), DT_S);
                follower.set_speed_share(share).unwrap();
                follower.step(DT_S).unwrap();
                assert!(k >= 20 || share >= 0.35, "{steps} steps, {k}: {share}");
            }
            // Repeated cuts slow it down further.
            assert!(share < 0.2, "{steps} steps: {share}");
        }
    }

    const DT_S: f64 = 1e-3;

    /// Simulates an arm that slows down at once and is cut to `bound` of its speed; returns how often it was cut, and the largest share at the end of
    /// each wait.
    fn cuts(cap: &mut SpeedCap, share: &mut f64, bound: f64, seconds: f64) -> Vec<f64> {
        let (mut at_s, mut before) = (vec![], *share);
        for k in 0..(seconds / DT_S) as u32 {
            let asked = (bound / *share).min(1.0);
            *share = cap.step(asked, *share, true, DT_S);
            if *share < before {
                at_s.push(f64::from(k) * DT_S);
            }
            before = *share;
        }
        at_s
    }

    #[test]
    fn the_wait_doubles_with_every_try_that_fails() {
        let (mut cap, mut share) = (SpeedCap::default(), 1.0);
        // Between two discrete shares.
        let at_s = cuts(&mut cap, &mut share, 0.4, 10.0);
        // One cut for each share above the bound, then one for each try.
        let waits_s: Vec<f64> = at_s[2..].windows(2).map(|pair| pair[1] - pair[0]).collect();
        for (wait_s, wanted_s) in waits_s.iter().zip([0.1, 0.2, 0.4, 0.8, 0.8, 0.8]) {
            assert!((wait_s - wanted_s).abs() < 5e-3, "{waits_s:?}");
        }
        // No chatter: one try in 0.8 s, and the share in between is the one below the bound.
        assert!(at_s.len() <= 6 + (10.0 / MOST_WAIT_S) as usize, "{at_s:?}");
        assert!(share == 0.35 || share == 0.5, "{share}");
        // When full speed is allowed again, it returns, and a later cut begins with the short wait.
        assert_eq!(cuts(&mut cap, &mut share, 1.0, 3.0).len(), 0);
        assert_eq!(share, 1.0);
        let at_s = cuts(&mut cap, &mut share, 0.6, 0.3);
        let first_s = at_s[2] - at_s[1];
        assert!((first_s - GIVEN_BACK_S).abs() < 5e-3, "{at_s:?}");
    }

    #[test]
    fn nan_is_a_cut() {
        let mut cap = SpeedCap::default();
        assert_eq!(cap.step(f64::NAN, 1.0, true, DT_S), 0.7);
    }
}

//! What the renderer does for a supervisor: withdraw the board, and slow down.

use super::proximity::SHARES;
use crate::board::{BoardTarget, surface_axes};
use crate::motion::Follower;
use glam::DVec3;

/// The way of a board that withdraws along -normal of its face.
#[derive(Debug, Clone, Copy)]
pub(super) struct Withdrawal {
    /// Where the face shall be; `None`: it is behind its surface already, or nothing behind it can be reached.
    target: Option<BoardTarget>,
}

/// Shares of the way back that are tried, the whole first.
const WAYS: [f64; 4] = [1.0, 0.5, 0.25, 0.1];
/// Less is no way, m.
const LEAST_M: f64 = 1e-3;
/// Slower than this nothing is slowed down, m/s.
const SLOWEST_M_PER_S: f64 = 1e-3;

impl Withdrawal {
    /// From where the board is commanded to be; a board that is behind all surfaces withdraws the less.
    pub(super) fn new(follower: &Follower, behind_m: f64) -> Self {
        let in_front_m = follower.protrusion_m().unwrap_or(0.0);
        let way_m = (behind_m + in_front_m).clamp(0.0, behind_m.max(0.0));
        let face = follower.commanded_pose();
        let [x, y, normal] = [0, 1, 2].map(|i| face.rotation().col(i));
        let _ = x;
        let target = surface_axes(normal).ok().map(|[x0, y0]| BoardTarget {
            roll_rad: Some((-y.dot(x0)).atan2(y.dot(y0))),
            behind_m: way_m,
            near: Some(follower.commanded()),
            ..BoardTarget::new(face.position_m(), normal, 0.0)
        });
        Self {
            target: target.filter(|_| way_m >= LEAST_M),
        }
    }

    pub(super) const fn moves(&self) -> bool {
        self.target.is_some()
    }

    /// Sends the follower there. Returns the share of the joint speeds that was set.
    pub(super) fn step(&mut self, follower: &mut Follower, speed_m_per_s: f64) -> Option<f64> {
        let target = self.target?;
        let reached = WAYS.into_iter().find_map(|way| {
            let nearer = BoardTarget {
                behind_m: way * target.behind_m,
                ..target
            };
            matches!(follower.set_target(&nearer), Ok(None)).then_some(nearer)
        });
        self.target = reached;
        let speed: DVec3 = follower.commanded_twist().linear_m_per_s;
        let share = match speed.length() > speed_m_per_s.max(SLOWEST_M_PER_S) {
            true => SHARES[0] * speed_m_per_s / speed.length(),
            false => SHARES[0],
        };
        let share = share.max(0.1 * SHARES[0]);
        follower.set_speed_share(share).is_ok().then_some(share)
    }
}

/// The share of the joint speeds that a supervisor leaves: what it cuts off is given back step by step.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpeedCap {
    most: f64,
    /// Since nothing was cut, s.
    sound_s: f64,
}

impl Default for SpeedCap {
    fn default() -> Self {
        Self {
            most: 1.0,
            sound_s: 0.0,
        }
    }
}

/// Nothing was cut for so long: the next larger share is tried, s.
const GIVEN_BACK_S: f64 = 0.1;

impl SpeedCap {
    /// `asked`: share of the last command that went through; `in_force`: share of the joint speeds that it was made with.
    pub(super) fn step(&mut self, asked: f64, in_force: f64, dt_s: f64) -> f64 {
        if asked < 1.0 {
            // A cut in a motion that is slowing down already is not another one.
            if self.most >= in_force {
                let fitting = SHARES.into_iter().filter(|share| *share < in_force);
                self.most = fitting.fold(SHARES[0], f64::max);
            }
            self.sound_s = 0.0;
        } else if self.most < 1.0 {
            self.sound_s += dt_s;
            if self.sound_s >= GIVEN_BACK_S {
                self.sound_s = 0.0;
                let more = SHARES.into_iter().find(|share| *share > self.most);
                self.most = more.unwrap_or(1.0);
            }
        }
        self.most
    }
}

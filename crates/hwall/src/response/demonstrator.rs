//! An arm that demonstrates how reaches are answered.

use super::demonstration::{ResponseDemonstration, Task};
use crate::error::SessionError;
use crate::upright_pieces::barriers_of;
use hwall_hand::HandFrame;
use hwall_haptics::{BarrierTree, Board, BoardTarget, Follower, FollowerConfig};
use hwall_kinematics::{ArmKinematics, JointPositions};
use hwall_scene::Scene;
use std::sync::Arc;

/// Time between two configurations of a path, s.
const STEP_S: f64 = 0.01;
/// A path that takes longer counts as not found, s.
const LONGEST_S: f64 = 6.0;
/// A motion with less time left has ended, s.
const ENDED_S: f64 = 1e-6;

/// Answers demonstrated reaches: moves from the waiting posture to the presentation along the reference motion and behind the surfaces, as
/// a session would.
#[derive(Debug, Clone)]
pub struct Demonstrator {
    arm: Arc<dyn ArmKinematics>,
    board: Board,
    surfaces: BarrierTree,
    waiting: JointPositions,
}

impl Demonstrator {
    /// For an arm with the face of the board as its tool, among the surfaces of a scene in its base frame.
    ///
    /// # Errors
    /// A scene whose surfaces make no barriers; a posture that is not finite.
    pub fn new(
        arm: &Arc<dyn ArmKinematics>,
        board: &Board,
        scene: &Scene,
        waiting: &JointPositions,
    ) -> Result<Self, SessionError> {
        let made = Self {
            arm: Arc::clone(arm),
            board: *board,
            surfaces: barriers_of(scene)?.into(),
            waiting: *waiting,
        };
        made.follower()?;
        Ok(made)
    }

    fn follower(&self) -> Result<Follower, SessionError> {
        let config = FollowerConfig::default();
        let approach = config.approach;
        let follower = Follower::new(Arc::clone(&self.arm), config, &self.waiting)?;
        let mut follower = follower.with_board(approach, self.board);
        follower.set_barriers(self.surfaces.clone());
        Ok(follower)
    }

    /// The configurations on the path to a target, every 10 ms; `None` if the arm cannot present it, or finds no path.
    ///
    /// # Errors
    /// A target that is not finite or has no normal.
    pub fn way(&self, target: &BoardTarget) -> Result<Option<Vec<JointPositions>>, SessionError> {
        let mut follower = self.follower()?;
        let mut way = vec![follower.commanded()];
        if follower.aim(target)?.is_some() || follower.goal().is_none() {
            return Ok(None);
        }
        for _ in 0..(LONGEST_S / STEP_S) as usize {
            way.push(follower.step(STEP_S)?);
            follower.plan();
            if !follower.is_blocked() && follower.left_s().is_some_and(|left_s| left_s <= ENDED_S) {
                return Ok(Some(way));
            }
        }
        Ok(None)
    }

    /// Configurations of the arm in step with a reach: after each fraction of the reach's duration, the arm has completed the same
    /// fraction of its path's duration, so hand and arm arrive together. `None` as for [`way`](Self::way).
    ///
    /// # Errors
    /// As for [`way`](Self::way).
    pub fn answer(
        &self,
        task: Task,
        frames: &[HandFrame],
        target: &BoardTarget,
    ) -> Result<Option<ResponseDemonstration>, SessionError> {
        let (Some(first), Some(last)) = (frames.first(), frames.last()) else {
            return Ok(None);
        };
        let Some(way) = self.way(target)? else {
            return Ok(None);
        };
        let lasts_s = last.t_s - first.t_s;
        let at = |frame: &HandFrame| {
            let share = match lasts_s > 0.0 {
                true => ((frame.t_s - first.t_s) / lasts_s).clamp(0.0, 1.0),
                false => 1.0,
            };
            between(&way, share)
        };
        Ok(Some(ResponseDemonstration {
            task,
            frames: frames.to_vec(),
            joints: frames.iter().map(at).collect(),
        }))
    }
}

/// The configuration at a share of a path.
fn between(way: &[JointPositions], share: f64) -> JointPositions {
    let at = share * (way.len() - 1) as f64;
    let before = (at as usize).min(way.len() - 1);
    let after = (before + 1).min(way.len() - 1);
    let part = at - before as f64;
    JointPositions(std::array::from_fn(|i| {
        way[before][i] + part * (way[after][i] - way[before][i])
    }))
}

//! A reach of a hand, and the arm that answers it.

use crate::error::SessionError;
use hwall_bip::Demonstration;
use hwall_hand::{HandFrame, HandPoint};
use hwall_kinematics::JointPositions;
use hwall_numeric::check::all_finite;

/// What a hand is about to do. Each task has its own shape of the hand and its own way to present the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Task {
    /// Touches a surface with the fingertip, over the middle of the board.
    Touch,
    /// Pushes a movable object with the open hand.
    Push,
    /// Grasps an edge or a handle, with the edge of the board between the fingers.
    Grasp,
    /// Slides along a surface with extended fingers.
    Stroke,
}

impl Task {
    /// In the order of [`JointPosterior::tasks`](super::JointPosterior::tasks).
    pub const ALL: [Self; 4] = [Self::Touch, Self::Push, Self::Grasp, Self::Stroke];

    /// Name for tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Touch => "touch",
            Self::Push => "push",
            Self::Grasp => "grasp",
            Self::Stroke => "stroke",
        }
    }
}

/// One reach of a hand from its start to the contact, with the arm in step.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseDemonstration {
    /// What the hand does.
    pub task: Task,
    /// Samples in the base frame of the arm, in order of time. Points may be missing in some.
    pub frames: Vec<HandFrame>,
    /// Configurations of the arm at these times, rad; the last one presents the board.
    pub joints: Vec<JointPositions>,
}

impl ResponseDemonstration {
    pub(super) fn validate(&self, number: usize) -> Result<(), SessionError> {
        let (frames, joints) = (self.frames.len(), self.joints.len());
        if frames != joints || frames < 2 {
            return Err(SessionError::Demonstration {
                number,
                frames,
                joints,
            });
        }
        for joints in &self.joints {
            all_finite("joints of a demonstration", &joints.0)?;
        }
        Ok(())
    }

    /// Is a point ever seen?
    pub(super) fn sees(&self, point: HandPoint) -> bool {
        self.frames.iter().any(|frame| frame.point(point).is_some())
    }

    /// The configuration at the end, rad.
    pub(super) fn presents_with(&self) -> [f64; 7] {
        self.joints.last().map_or([0.0; 7], |joints| joints.0)
    }

    /// Columns: x, y and z of the points, then the joints. Gaps of a point are interpolated linearly, and held constant at the ends.
    pub(super) fn to_primitive(&self, points: &[HandPoint]) -> Result<Demonstration, SessionError> {
        let dofs = 3 * points.len() + 7;
        let mut values = vec![0.0; dofs * self.frames.len()];
        for (column, point) in points.iter().enumerate() {
            self.fill(*point, 3 * column, dofs, &mut values);
        }
        for (row, joints) in values.chunks_exact_mut(dofs).zip(&self.joints) {
            row[dofs - 7..].copy_from_slice(&joints.0);
        }
        let start_s = self.frames.first().map_or(0.0, |frame| frame.t_s);
        let times = self.frames.iter().map(|frame| frame.t_s - start_s);
        Ok(Demonstration::from_timestamps(
            times.collect(),
            dofs,
            values,
        )?)
    }

    /// Writes a point into its three columns.
    fn fill(&self, point: HandPoint, first: usize, dofs: usize, values: &mut [f64]) {
        let seen: Vec<_> = (self.frames.iter().enumerate())
            .filter_map(|(k, frame)| Some((k, frame.t_s, frame.point(point)?)))
            .collect();
        for (k, row) in values.chunks_exact_mut(dofs).enumerate() {
            let after = seen.partition_point(|(at, ..)| *at < k);
            let (before, next) = (
                after.checked_sub(1).and_then(|i| seen.get(i)),
                seen.get(after),
            );
            let at = match (before, next) {
                (_, Some((at, _, point_m))) if *at == k => *point_m,
                (Some((_, from_s, from_m)), Some((_, to_s, to_m))) => {
                    let share = (self.frames[k].t_s - from_s) / (to_s - from_s);
                    from_m.lerp(*to_m, share)
                }
                (Some((.., point_m)), None) | (None, Some((.., point_m))) => *point_m,
                (None, None) => continue,
            };
            row[first..first + 3].copy_from_slice(&at.to_array());
        }
    }
}

//! Where the arm waits for this person, and how soon it is at the walls from there.

use crate::walls::Walls;
use glam::DVec3;
use hwall_arrival::Atlas;
use hwall_haptics::{QUARTER_TURNS_RAD, board_pose};
use hwall_kinematics::{JointPositions, NearestConfig};
use std::sync::Arc;

/// Another posture must suit the person better by this, s: what is known of a person wavers.
const CLEARLY_S: f64 = 0.04;

/// The postures that the arm may wait in, and the one for this person.
#[derive(Debug, Clone)]
pub(super) struct Waiting {
    usual: Option<JointPositions>,
    /// By the time that people leave, s, the usual one first; `None` where no atlas was made.
    atlases: Vec<(f64, Option<Arc<Atlas>>)>,
    present: usize,
}

impl Waiting {
    /// As for somebody of whom nothing is known.
    pub(super) fn of(walls: &Walls) -> Self {
        let others = walls.others.iter();
        let others = others.map(|other| (other.budget_s, Some(Arc::clone(&other.atlas))));
        // Without a usual posture the arm stays where it is, for everybody.
        let others = others.filter(|_| walls.waiting.is_some());
        Self {
            usual: walls.waiting,
            atlases: std::iter::once((walls.budget_s, walls.atlas.clone()))
                .chain(others)
                .collect(),
            present: 0,
        }
    }

    /// The person leaves the arm so much time, s: the posture for the nearest time from now on.
    pub(super) fn turn_to(&mut self, budget_s: f64) {
        let off_s = |at: usize| (self.atlases[at].0 - budget_s).abs();
        let nearest = (0..self.atlases.len()).min_by(|a, b| off_s(*a).total_cmp(&off_s(*b)));
        if let Some(nearest) = nearest.filter(|n| off_s(*n) + CLEARLY_S < off_s(self.present)) {
            self.present = nearest;
        }
    }

    fn atlas(&self) -> Option<&Arc<Atlas>> {
        self.atlases[self.present].1.as_ref()
    }

    /// Where the arm waits, rad; `None`: where it is.
    pub(super) fn posture(&self) -> Option<JointPositions> {
        match self.present {
            0 => self.usual,
            _ => self.atlas().map(|atlas| *atlas.waiting()),
        }
    }

    /// A configuration from which the arm presents a place well; `None` where none is known.
    pub(super) fn near(&self, point_m: DVec3, normal: DVec3) -> Option<JointPositions> {
        let entry = self.atlas()?.look_up(point_m, normal)?;
        Some(entry.q)
    }

    /// How soon the board is at a place from the waiting posture, s: by the atlas, else at whichever quarter turn. `None` where no atlas
    /// was made; infinite for a place that cannot be held.
    pub(super) fn arrival_s(&self, point_m: DVec3, normal: DVec3) -> Option<f64> {
        let atlas = self.atlas()?;
        if let Some(entry) = atlas.look_up(point_m, normal) {
            return Some(entry.arrival_s);
        }
        let waiting = atlas.waiting();
        let config = NearestConfig::default();
        let time_s = |roll_rad: f64| {
            let pose = board_pose(point_m, normal, roll_rad).ok()?;
            let solution = atlas.arm().nearest_solution(&pose, waiting, &config).ok()?;
            Some(atlas.limits().travel_time_s(waiting, &solution.q))
        };
        let times_s = QUARTER_TURNS_RAD.into_iter().filter_map(time_s);
        Some(times_s.fold(f64::INFINITY, f64::min))
    }
}

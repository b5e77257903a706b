//! Where the arm waits for this person, and how soon it reaches the walls from there.

use crate::walls::Walls;
use glam::DVec3;
use hwall_arrival::{Atlas, AtlasEntry};
use hwall_haptics::{QUARTER_TURNS_RAD, board_pose};
use hwall_kinematics::{JointPositions, NearestConfig};
use std::sync::Arc;

/// Hysteresis: another posture must suit the person better by this, s, because the estimate fluctuates.
const CLEARLY_S: f64 = 0.04;

/// The postures that the arm may wait in, and the one for this person.
#[derive(Debug, Clone)]
pub(super) struct Waiting {
    nominal: Option<JointPositions>,
    /// Atlases with their available times, s, the default first; `None` if no atlas was built.
    atlases: Vec<(f64, Option<Arc<Atlas>>)>,
    present: usize,
}

impl Waiting {
    /// For an unknown person.
    pub(super) fn of(walls: &Walls) -> Self {
        let others = walls.others.iter();
        let others = others.map(|other| (other.budget_s, Some(Arc::clone(&other.atlas))));
        // Without a default posture, the arm stays where it is for everybody.
        let others = others.filter(|_| walls.waiting.is_some());
        Self {
            nominal: walls.waiting,
            atlases: std::iter::once((walls.budget_s, walls.atlas.clone()))
                .chain(others)
                .collect(),
            present: 0,
        }
    }

    /// Selects the posture for the nearest available time, s.
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

    /// Waiting posture, rad; `None`: the arm stays where it is.
    pub(super) fn posture(&self) -> Option<JointPositions> {
        match self.present {
            0 => self.nominal,
            _ => self.atlas().map(|atlas| *atlas.waiting()),
        }
    }

    fn look_up(&self, point_m: DVec3, normal: DVec3) -> Option<AtlasEntry> {
        self.atlas()?.look_up(point_m, normal)
    }

    /// A good configuration to present a place; `None` if unknown.
    pub(super) fn near(&self, point_m: DVec3, normal: DVec3) -> Option<JointPositions> {
        Some(self.look_up(point_m, normal)?.q)
    }

    /// How the arm presents a place: from the atlas, else the solution nearest to the waiting posture at any quarter turn.
    pub(super) fn presents(&self, point_m: DVec3, normal: DVec3) -> Presents {
        if let Some(entry) = self.look_up(point_m, normal) {
            return Presents::With(entry.q, !entry.clear);
        }
        let Some((atlas, arm)) = self.atlas().and_then(|atlas| Some((atlas, atlas.arm()?))) else {
            return Presents::Unknown;
        };
        let config = NearestConfig::default();
        let at_roll = |roll_rad: f64| {
            let pose = board_pose(point_m, normal, roll_rad).ok()?;
            let solution = arm.nearest_solution(&pose, atlas.waiting(), &config).ok()?;
            Some((self.travel_s(atlas.waiting(), &solution.q)?, solution.q))
        };
        let solutions = QUARTER_TURNS_RAD.into_iter().filter_map(at_roll);
        match solutions.min_by(|(a_s, _), (b_s, _)| a_s.total_cmp(b_s)) {
            Some((_, q)) => Presents::With(q, false),
            None => Presents::Never,
        }
    }

    /// Least time between two configurations, s; `None` without an atlas.
    pub(super) fn travel_s(&self, from: &JointPositions, to: &JointPositions) -> Option<f64> {
        Some(self.atlas()?.limits().travel_time_s(from, to))
    }
}

/// How the arm presents a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Presents {
    /// With these joints, rad; does the direct path from the waiting posture lead through a surface?
    With(JointPositions, bool),
    /// The arm cannot hold it.
    Never,
    /// There is no atlas, or the arm has no closed form and the atlas lacks the place.
    Unknown,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walls::WallsConfig;
    use hwall_arrival::WaitingConfig;
    use hwall_haptics::Board;
    use hwall_kinematics::SrsArm;
    use hwall_scene::Scene;

    fn walls(other_budgets_s: Vec<f64>) -> Walls {
        let wall = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n";
        let (scene, _) = Scene::from_obj_str(wall, None).expect("a wall");
        let board = Board::default();
        let tool = board.flange_from_board_face().expect("a board");
        let config = WallsConfig {
            // These tests are about the use of postures, not about their quality.
            waiting: WaitingConfig {
                starts: 1,
                most_targets: 8,
                ..WaitingConfig::default()
            },
            other_budgets_s,
            ..WallsConfig::default()
        };
        Walls::of(&scene, &SrsArm::iiwa7().with_tool(tool), &board, &config).expect("within reach")
    }

    #[test]
    fn the_posture_is_that_of_the_nearest_time_and_does_not_waver() {
        let walls = walls(vec![0.4]);
        let other = *walls.others[0].atlas.waiting();
        assert_ne!(walls.waiting, Some(other));
        let mut waiting = Waiting::of(&walls);
        assert_eq!(waiting.posture(), walls.waiting);
        let between_s = 0.5 * (walls.budget_s + 0.4);
        for (budget_s, expected) in [
            (between_s - 0.01, walls.waiting),
            (0.3, Some(other)),
            (between_s + 0.01, Some(other)),
            (f64::NAN, Some(other)),
            (2.0, walls.waiting),
        ] {
            waiting.turn_to(budget_s);
            assert_eq!(waiting.posture(), expected, "{budget_s}");
            let (point_m, normal) = (DVec3::new(0.6, 0.0, 0.6), DVec3::X);
            let atlas = waiting.atlas().expect("made");
            let entry = atlas.look_up(point_m, normal).expect("within reach");
            assert_eq!(waiting.near(point_m, normal), Some(entry.q));
            let Presents::With(q, _) = waiting.presents(point_m, normal) else {
                panic!("within reach")
            };
            let from = atlas.waiting();
            assert_eq!(waiting.travel_s(from, &q), Some(entry.arrival_s));
        }
    }

    #[test]
    fn without_a_nominal_posture_the_arm_stays_for_everybody() {
        let nowhere = Walls {
            waiting: None,
            ..walls(vec![0.4])
        };
        let mut waiting = Waiting::of(&nowhere);
        waiting.turn_to(0.1);
        assert_eq!(waiting.posture(), None);
        let unknown = Waiting::of(&Walls::default());
        assert!(unknown.near(DVec3::X, DVec3::X).is_none());
    }

    #[test]
    fn a_time_that_makes_no_sense_is_named() {
        let wall = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nf 1 2 3\n";
        let (scene, _) = Scene::from_obj_str(wall, None).expect("a wall");
        let arm = SrsArm::iiwa7();
        for budget_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let config = WallsConfig {
                other_budgets_s: vec![budget_s],
                ..WallsConfig::default()
            };
            let refused = Walls::of(&scene, &arm, &Board::default(), &config);
            let text = refused.expect_err("no such time").to_string();
            assert!(text.contains("budget_s"), "{text}");
        }
    }
}

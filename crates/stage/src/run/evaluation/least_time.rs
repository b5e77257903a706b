//! The least time in which an arm could bring the board to a touch, by brute force.
//!
//! Independent of the code that steers the board: tries every branch, arm angle, quarter turn and position of the board under
//! the touched point on a grid, and refines the best.

use crate::input::arms::{BoardArm, nearest};
use glam::DVec3;
use hwall::haptics::{PlaceTolerance, QUARTER_TURNS_RAD, board_pose};
use hwall_geometry::Pose;
use hwall_kinematics::{JointLimit, JointPositions, SrsArm};
use hwall_motion::MotionLimits;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Grid size: positions of the middle of the board in each direction, and arm angles.
const PLACES: usize = 5;
const ARM_ANGLES: usize = 72;
/// Number of grid points to refine, each of another branch or sector of arm angles: the minimum over the slowest of seven
/// joints has several valleys side by side.
const REFINED: usize = 8;
const SECTORS: usize = 12;
/// Halvings of the steps while refining.
const HALVINGS: usize = 8;
/// Positions of the board in each direction for an arm without a closed form.
const SEARCHED_PLACES: usize = 3;

/// Margin inside the slack, m: a board at its end is then in place despite rounding.
const ROUNDING_M: f64 = 1e-6;

/// The quickest motion to a touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quickest {
    /// Duration from rest to rest, without the delay of the arm, s.
    pub time_s: f64,
    /// Final configuration.
    pub q: JointPositions,
}

/// Searches for the quickest motion to a touch. The touched point may be anywhere on the board at least the margin of
/// [`PlaceTolerance`] inside its edge; the board may be turned by quarter turns.
///
/// Error, for an arm with a closed form: at most 1 ms too long, against a search sixteen times as dense (tests). Without a closed
/// form the solver tries only a few positions: the result is a valid motion, but perhaps not the quickest.
#[derive(Debug, Clone)]
pub struct LeastTime<'a> {
    arm: &'a BoardArm,
    limits: MotionLimits,
    /// Allowed offset of the middle of the board along its axes, m.
    slack_m: [f64; 2],
    /// The same arm with an unlimited last joint: turns of the board about its normal are turns of that joint.
    round: Option<SrsArm>,
}

/// Position of the board on the surface, along its axes at roll 0, m, and arm angle, rad.
type Choice = [f64; 3];

impl<'a> LeastTime<'a> {
    /// For an arm whose tool is the face of the board.
    ///
    /// # Errors
    /// A board too small for the place tolerance; limits that the arm refuses.
    pub fn new(
        arm: &'a BoardArm,
        place: &PlaceTolerance,
        limits: MotionLimits,
    ) -> anyhow::Result<Self> {
        limits.validate()?;
        let inset_m = place.inset_m + ROUNDING_M;
        let slack_m =
            [arm.board().half_width_m, arm.board().half_height_m].map(|half| half - inset_m);
        anyhow::ensure!(
            slack_m.iter().all(|slack| *slack >= 0.0),
            "no point of the board is {} m inside its edge",
            place.inset_m
        );
        let round = arm.closed_form().map(|arm| {
            let mut all = *arm.limits();
            all[6] = JointLimit {
                min_rad: -PI,
                max_rad: PI,
            };
            arm.with_limits(all)
        });
        Ok(Self {
            arm,
            limits,
            slack_m,
            round: round.transpose()?,
        })
    }

    /// The arm.
    #[must_use]
    pub const fn arm(&self) -> &BoardArm {
        self.arm
    }

    /// Allowed offset of the middle of the board from the touched point, along the board's axes, m.
    #[must_use]
    pub const fn slack_m(&self) -> [f64; 2] {
        self.slack_m
    }

    /// The limits of the motion.
    #[must_use]
    pub const fn limits(&self) -> &MotionLimits {
        &self.limits
    }

    /// The quickest motions from rest at each start to a touch of a surface; `None` if none was found.
    ///
    /// # Errors
    /// NaN or infinity, or a normal without a direction.
    pub fn to_touch<const N: usize>(
        &self,
        point_m: DVec3,
        normal: DVec3,
        starts: &[JointPositions; N],
    ) -> anyhow::Result<[Option<Quickest>; N]> {
        let upright = board_pose(point_m, normal, 0.0)?;
        match &self.round {
            Some(round) => Ok(self.in_closed_form(round, &upright, starts)),
            None => self.by_search(&upright, starts),
        }
    }

    fn in_closed_form<const N: usize>(
        &self,
        round: &SrsArm,
        upright: &Pose,
        starts: &[JointPositions; N],
    ) -> [Option<Quickest>; N] {
        let widest_m = self.slack_m[0].max(self.slack_m[1]);
        let step_m = 2.0 * widest_m / (PLACES - 1) as f64;
        let step_rad = TAU / ARM_ANGLES as f64;
        // The best of each branch in each sector, for each start.
        let mut best = [[[None::<(f64, Choice)>; SECTORS]; 8]; N];
        let mut look = |choice: Choice| {
            let sector = (choice[2] / TAU).rem_euclid(1.0) * SECTORS as f64;
            let sector = (sector as usize).min(SECTORS - 1);
            let solutions = round.solutions(&moved(upright, choice), choice[2]);
            for (branch, q) in solutions.into_iter().enumerate() {
                let Some(q) = q else { continue };
                for (start, best) in starts.iter().zip(&mut best) {
                    let Some(found) = self.turned(&q, choice, start) else {
                        continue;
                    };
                    let slot = &mut best[branch][sector];
                    if slot.is_none_or(|(time_s, _)| found.time_s < time_s) {
                        *slot = Some((found.time_s, choice));
                    }
                }
            }
        };
        for place in 0..PLACES * PLACES {
            let [u, v] = [place % PLACES, place / PLACES].map(|i| i as f64 * step_m - widest_m);
            for angle in 0..ARM_ANGLES {
                look([u, v, angle as f64 * step_rad - PI]);
            }
        }
        // Near the limit of the reach, arcs of arm angles are narrower than the grid.
        if let Ok(angles) = round.feasible_arm_angles(upright) {
            for branch in angles.branches() {
                for arc in angles.arcs(branch) {
                    look([0.0, 0.0, 0.5 * (arc.start_rad + arc.end_rad)]);
                }
            }
        }
        std::array::from_fn(|i| {
            let found = |branch: usize| best[i][branch].iter().flatten().map(move |b| (branch, *b));
            let mut order: Vec<(usize, (f64, Choice))> = (0..8).flat_map(found).collect();
            order.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
            let refined = order
                .into_iter()
                .take(REFINED)
                .filter_map(|(branch, (_, choice))| {
                    let steps = [step_m, step_m, step_rad];
                    self.refined(round, upright, branch, choice, steps, &starts[i])
                });
            refined.min_by(|a, b| a.time_s.total_cmp(&b.time_s))
        })
    }

    /// Searches around a choice with decreasing steps, as long as it finds something quicker.
    fn refined(
        &self,
        round: &SrsArm,
        upright: &Pose,
        branch: usize,
        choice: Choice,
        mut steps: [f64; 3],
        start: &JointPositions,
    ) -> Option<Quickest> {
        let at = |choice: Choice| {
            let q = round.solutions(&moved(upright, choice), choice[2])[branch]?;
            self.turned(&q, choice, start)
        };
        let widest_m = self.slack_m[0].max(self.slack_m[1]);
        let (mut choice, mut best) = (choice, at(choice)?);
        for _ in 0..HALVINGS {
            steps = steps.map(|step| 0.5 * step);
            // Each motion is quicker than the previous one, so this ends.
            loop {
                let around = (0..27).filter(|i| *i != 13).map(|i| {
                    let by = |power: i32| f64::from(i / power % 3 - 1);
                    [
                        (choice[0] + by(1) * steps[0]).clamp(-widest_m, widest_m),
                        (choice[1] + by(3) * steps[1]).clamp(-widest_m, widest_m),
                        choice[2] + by(9) * steps[2],
                    ]
                });
                let found = around
                    .filter_map(|choice| Some((choice, at(choice)?)))
                    .min_by(|a, b| a.1.time_s.total_cmp(&b.1.time_s));
                match found {
                    Some((there, quicker)) if quicker.time_s < best.time_s - 1e-6 => {
                        (choice, best) = (there, quicker);
                    }
                    _ => break,
                }
            }
        }
        Some(best)
    }

    /// The quickest turn of the last joint among the board's quarter turns.
    fn turned(
        &self,
        q: &JointPositions,
        [u, v, _]: Choice,
        start: &JointPositions,
    ) -> Option<Quickest> {
        let limit = self.arm.kinematics().limits()[6];
        let ways = (-4..=4_i32).filter_map(|quarter| {
            let [along_u, along_v] = match quarter % 2 {
                0 => self.slack_m,
                _ => [self.slack_m[1], self.slack_m[0]],
            };
            let mut q = *q;
            q[6] += f64::from(quarter) * FRAC_PI_2;
            let suits = u.abs() <= along_u + 1e-12 && v.abs() <= along_v + 1e-12;
            (suits && limit.contains(q[6])).then(|| Quickest {
                time_s: self.limits.travel_time_s(start, &q),
                q,
            })
        });
        ways.filter(|way| way.time_s.is_finite())
            .min_by(|a, b| a.time_s.total_cmp(&b.time_s))
    }

    fn by_search<const N: usize>(
        &self,
        upright: &Pose,
        starts: &[JointPositions; N],
    ) -> anyhow::Result<[Option<Quickest>; N]> {
        let mut best = [None; N];
        let middle = (SEARCHED_PLACES - 1) as f64 / 2.0;
        for (turn, roll_rad) in QUARTER_TURNS_RAD.into_iter().enumerate() {
            let [x, y] = match turn % 2 {
                0 => self.slack_m,
                _ => [self.slack_m[1], self.slack_m[0]],
            };
            for place in 0..SEARCHED_PLACES * SEARCHED_PLACES {
                let [iu, iv] = [place % SEARCHED_PLACES, place / SEARCHED_PLACES];
                let [u, v] = [(iu, x), (iv, y)].map(|(i, m)| m * (i as f64 - middle) / middle);
                let there = moved(upright, [u, v, 0.0]);
                let pose = board_pose(there.position_m(), there.rotation().z_axis, roll_rad)?;
                for (start, best) in starts.iter().zip(&mut best) {
                    let Ok(q) = nearest(&**self.arm.kinematics(), &pose, start)? else {
                        continue;
                    };
                    let time_s = self.limits.travel_time_s(start, &q);
                    if best.is_none_or(|b: Quickest| time_s < b.time_s) {
                        *best = Some(Quickest { time_s, q });
                    }
                }
            }
        }
        Ok(best)
    }
}

/// The board moved along its own axes.
fn moved(upright: &Pose, [u, v, _]: Choice) -> Pose {
    upright.at(upright.transform_point(DVec3::new(u, v, 0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::arms::waiting_iiwa7;
    use hwall::haptics::Board;
    use hwall_kinematics::SrsArm;
    use hwall_motion::MotionConfig;
    use hwall_testkit::Sampler;

    fn setup() -> (BoardArm, Board) {
        let board = Board::default();
        (BoardArm::named("iiwa7", &board).unwrap(), board)
    }

    fn least(arm: &BoardArm) -> LeastTime<'_> {
        let limits = MotionLimits::of_arm(&**arm.kinematics(), &MotionConfig::default()).unwrap();
        LeastTime::new(arm, &PlaceTolerance::default(), limits).unwrap()
    }

    /// The touched point and normal that the board at `q` presents.
    fn touch_at(arm: &BoardArm, q: &JointPositions) -> (DVec3, DVec3) {
        let pose = arm.kinematics().forward(q);
        (pose.position_m(), pose.rotation().z_axis)
    }

    #[test]
    fn a_board_that_is_there_needs_no_time_and_what_is_found_is_in_place() {
        let (arm, board) = setup();
        let least = least(&arm);
        let starts = [arm.start(), waiting_iiwa7()];
        let place = PlaceTolerance {
            inset_m: 0.02 - 1e-9,
            gap_m: 1e-9,
            tilt_rad: 1e-6,
        };
        for start in starts {
            let (point_m, normal) = touch_at(&arm, &start);
            let found = least.to_touch(point_m, normal, &starts).unwrap();
            for (from, found) in starts.iter().zip(found) {
                let found = found.unwrap();
                let pose = arm.kinematics().forward(&found.q);
                assert!(place.holds(&board, &pose, point_m, normal), "{pose:?}");
                let time_s = least.limits().travel_time_s(from, &found.q);
                assert_eq!(time_s, found.time_s);
                if *from == start {
                    // The board's roll is not a quarter turn, so the last joint may have to turn slightly.
                    assert!(found.time_s < 0.12, "{}", found.time_s);
                }
            }
        }
    }

    #[test]
    fn no_way_that_is_known_to_exist_is_quicker() {
        let (arm, _) = setup();
        let least = least(&arm);
        let srs = arm.closed_form().unwrap();
        let mut sampler = Sampler::new(11);
        let (mut compared, mut worst_s) = (0, 0.0_f64);
        let limits = *srs.limits();
        while compared < 60 {
            // A known solution: any configuration with the board upright on a wall, and any start near the waiting posture.
            let point_m =
                sampler.point_in_box(DVec3::new(0.4, -0.4, 0.3), DVec3::new(0.7, 0.4, 0.9));
            let yaw: f64 = sampler.uniform(-0.6, 0.6);
            let normal = DVec3::new(yaw.cos(), yaw.sin(), 0.0);
            let start = JointPositions(std::array::from_fn(|i| {
                let q = waiting_iiwa7()[i] + sampler.uniform(-0.3, 0.3);
                q.clamp(limits[i].min_rad, limits[i].max_rad)
            }));
            let planted = (0..400).filter_map(|_| planted(&mut sampler, srs, point_m, normal));
            let quickest_s = planted
                .map(|q| least.limits().travel_time_s(&start, &q))
                .fold(f64::INFINITY, f64::min);
            let [found] = least.to_touch(point_m, normal, &[start]).unwrap();
            if quickest_s.is_finite() {
                let found = found.expect("a way exists");
                worst_s = worst_s.max(found.time_s - quickest_s);
                compared += 1;
            }
        }
        assert!(worst_s < 0.001, "{worst_s}");
    }

    fn planted(
        sampler: &mut Sampler,
        srs: &SrsArm,
        point_m: DVec3,
        normal: DVec3,
    ) -> Option<JointPositions> {
        let roll_rad = QUARTER_TURNS_RAD[sampler.index(4)];
        let upright = board_pose(point_m, normal, roll_rad).unwrap();
        let [u, v] = [(); 2].map(|()| sampler.uniform(-0.08, 0.08));
        let solutions = srs.solutions(&moved(&upright, [u, v, 0.0]), sampler.uniform(-PI, PI));
        solutions[sampler.index(8)]
    }

    /// A grid sixteen times as fine in each direction finds nothing more than 1 ms quicker.
    #[test]
    fn what_is_found_is_within_1_ms_of_a_dense_search() {
        let (arm, _) = setup();
        let least = least(&arm);
        let round = least.round.as_ref().unwrap();
        let mut sampler = Sampler::new(6);
        let (mut compared, mut worst_s) = (0, f64::NEG_INFINITY);
        while compared < 6 {
            let point_m =
                sampler.point_in_box(DVec3::new(0.55, -0.5, 0.3), DVec3::new(0.7, 0.5, 1.0));
            let start = [arm.start(), waiting_iiwa7()][compared % 2];
            let Some(found) = least.to_touch(point_m, DVec3::X, &[start]).unwrap()[0] else {
                continue;
            };
            let upright = board_pose(point_m, DVec3::X, 0.0).unwrap();
            let mut dense_s = f64::INFINITY;
            for iu in 0..=16 {
                for iv in 0..=16 {
                    let [u, v] = [iu, iv].map(|i| 0.01 * f64::from(i) - 0.08);
                    for ia in 0..720 {
                        let choice = [u, v, f64::from(ia) * TAU / 720.0];
                        let solutions = round.solutions(&moved(&upright, choice), choice[2]);
                        for q in solutions.into_iter().flatten() {
                            let way = least.turned(&q, choice, &start);
                            dense_s = way.map_or(dense_s, |way| dense_s.min(way.time_s));
                        }
                    }
                }
            }
            worst_s = worst_s.max(found.time_s - dense_s);
            compared += 1;
        }
        assert!(worst_s < 0.001, "{worst_s}");
        let worst_ms = 1e3 * worst_s;
        println!("largest excess over a dense search: {worst_ms:.2} ms");
    }

    #[test]
    fn out_of_reach_is_no_way_and_nonsense_is_refused() {
        let (arm, board) = setup();
        let least = least(&arm);
        let starts = [arm.start()];
        let far = least.to_touch(DVec3::new(3.0, 0.0, 0.5), DVec3::X, &starts);
        assert_eq!(far.unwrap(), [None]);
        let nan = DVec3::new(f64::NAN, 0.0, 0.5);
        assert!(least.to_touch(nan, DVec3::X, &starts).is_err());
        assert!(least.to_touch(DVec3::X, DVec3::ZERO, &starts).is_err());
        let tiny = Board {
            half_width_m: 0.01,
            ..board
        };
        let limits = *least.limits();
        let arm = BoardArm::named("iiwa7", &tiny).unwrap();
        assert!(LeastTime::new(&arm, &PlaceTolerance::default(), limits).is_err());
    }

    #[test]
    fn an_arm_without_a_closed_form_finds_a_way_that_is_not_much_longer() {
        let (arm, board) = setup();
        let path = std::env::temp_dir().join(format!("least-time-{}.urdf", std::process::id()));
        let panda = include_str!("../../../../kinematics/tests/data/panda.urdf");
        std::fs::write(&path, panda).unwrap();
        let searched = BoardArm::named(path.to_str().unwrap(), &board);
        std::fs::remove_file(&path).unwrap();
        let searched = searched.unwrap();
        let (point_m, normal) = touch_at(&searched, &searched.start());
        let beside_m = point_m + DVec3::new(0.0, 0.15, 0.05);
        let found = least(&searched).to_touch(beside_m, normal, &[searched.start()]);
        let found = found.unwrap()[0].expect("within reach");
        let pose = searched.kinematics().forward(&found.q);
        assert!(PlaceTolerance::default().holds(&board, &pose, beside_m, normal));
        assert!(found.time_s < 1.0, "{}", found.time_s);
        assert!(arm.closed_form().is_some() && searched.closed_form().is_none());
    }
}

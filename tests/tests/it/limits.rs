//! Whatever the room and the targets, no command leaves the limits of the arm.

use glam::{DAffine3, DVec3};
use hwall::{Cycle, Surroundings, TargetControl, drive};
use hwall_haptics::{
    ArmCommand, Board, BoardTarget, FollowerConfig, MotionLimits, Phase, RendererConfig,
};
use hwall_kinematics::{JointPositions, SrsArm, Wrench};
use hwall_scene::Scene;
use hwall_sim::{ServoArm, ServoConfig, SimError};
use hwall_testkit::Sampler;

const DT_S: f64 = 1e-3;
const STEPS: usize = 4000;

/// Two walls and a box, anywhere around the arm, turned at random about the vertical.
fn room(s: &mut Sampler) -> Scene {
    let mut obj = String::new();
    let mut vertices = 0;
    let mut quad = |name: &str, corners: [DVec3; 4]| {
        obj += &format!("o {name}\n");
        for c in corners {
            obj += &format!("v {} {} {}\n", c.x, c.y, c.z);
        }
        let [a, b, c, d] = [1, 2, 3, 4].map(|i| vertices + i);
        obj += &format!("f {a} {b} {c} {d}\n");
        vertices += 4;
    };
    for name in ["front", "side"] {
        let turned = DAffine3::from_rotation_z(s.uniform(-1.5, 1.5));
        let x = s.uniform(0.35, 1.1);
        let lean = s.uniform(-0.2, 0.2);
        let corners = [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.6), (-1.0, 1.6)];
        quad(
            name,
            corners.map(|(y, z)| turned.transform_point3(DVec3::new(x + lean * z, y, z))),
        );
    }
    let (x, z) = (s.uniform(0.4, 0.8), s.uniform(0.2, 0.8));
    let corners = [(0.0, -0.3), (0.3, -0.3), (0.3, 0.3), (0.0, 0.3)];
    quad("shelf", corners.map(|(dx, y)| DVec3::new(x + dx, y, z)));
    Scene::from_obj_str(&obj, None).expect("a room").0
}

/// A room with somebody in it who wants the board here and there, and presses it now and then.
struct Around {
    seed: u64,
    sampler: Sampler,
    scene: Scene,
    /// Where the board is wanted, and the normal there.
    wanted: Option<(DVec3, DVec3)>,
    begun: usize,
}

impl Around {
    fn new(seed: u64) -> Self {
        let mut sampler = Sampler::new(100 + seed);
        Self {
            seed,
            scene: room(&mut sampler),
            sampler,
            wanted: None,
            begun: 0,
        }
    }

    /// Time of the next cycle, s.
    fn now_s(&self) -> f64 {
        self.begun as f64 * DT_S
    }

    /// What the next cycle begins with.
    fn change(&mut self, control: &mut TargetControl, servo: &mut ServoArm) {
        let s = &mut self.sampler;
        if s.uniform(0.0, 1.0) < 0.0015 {
            // A place on the room, or none at all.
            let near_m = s.point_in_box(DVec3::new(-0.2, -0.9, 0.0), DVec3::new(0.9, 0.9, 1.3));
            let found = self.scene.closest_touchable(near_m, 0.5).unwrap();
            self.wanted = found.map(|c| (c.point_m, c.normal));
            let press = if s.index(4) == 0 {
                s.unit_vector() * s.uniform(0.0, 15.0)
            } else {
                DVec3::ZERO
            };
            servo
                .apply_wrench(Wrench {
                    force_n: press,
                    ..Wrench::default()
                })
                .unwrap();
        }
        if let Some((point_m, _)) = &mut self.wanted {
            // A hand that drifts.
            *point_m += s.unit_vector() * 5e-4;
        }
        control.target = self
            .wanted
            .map(|(point_m, normal)| BoardTarget::new(point_m, normal, self.now_s()));
    }
}

impl Surroundings<ServoArm> for Around {
    fn next_cycle(&mut self, _: &mut ServoArm) -> Result<Option<f64>, SimError> {
        let now_s = (self.begun < STEPS).then(|| self.now_s());
        self.begun += 1;
        Ok(now_s)
    }
}

/// The last command and the speed that it asked for.
#[derive(Default)]
struct Limits {
    follower: FollowerConfig,
    before: Option<(JointPositions, [f64; 7])>,
}

impl Limits {
    fn check(&mut self, around: &Around, servo: &ServoArm, cycle: &Cycle) {
        let place = format_args!("{} {}", around.seed, cycle.t_s);
        let ArmCommand::Position(q) = cycle.command else {
            panic!("{place}: all states are good")
        };
        let arm = servo.model();
        let limits = MotionLimits::of_arm(&**arm, &self.follower.motion).expect("of an iiwa 7");
        let mut speed = [0.0; 7];
        for j in 0..7 {
            let is_within = q[j].is_finite() && arm.limits()[j].contains(q[j]);
            assert!(is_within, "{place} {j}: {}", q[j]);
            let Some((before, speed_before)) = self.before else {
                continue;
            };
            speed[j] = (q[j] - before[j]) / DT_S;
            let most = limits.velocity_rad_per_s[j];
            // A difference over a millisecond of positions that are good to 1e-11 rad.
            let is_slow = speed[j].abs() <= most + 1e-8;
            assert!(is_slow, "{place} {j}: {} rad/s", speed[j]);
            let change = (speed[j] - speed_before[j]) / DT_S;
            let most = limits.acceleration_rad_per_s2[j];
            assert!(change.abs() <= most + 1e-6, "{place} {j}: {change} rad/s²");
        }
        self.before = Some((q, speed));
    }
}

/// How many steps showed what.
#[derive(Debug, Default)]
struct Counts {
    at_goal: usize,
    out_of_reach: usize,
    no_target: usize,
    touched: usize,
}

impl Counts {
    fn count(&mut self, control: &TargetControl, servo: &ServoArm) {
        let step = control.last_step().expect("a step");
        let arrived = step
            .goal
            .is_some_and(|goal| servo.q().max_abs_difference(&goal) < 0.05);
        let wanted = control.target.is_some();
        self.at_goal += usize::from(arrived && step.unreachable.is_none() && wanted);
        self.out_of_reach += usize::from(step.unreachable.is_some());
        self.no_target += usize::from(!wanted);
        self.touched += usize::from(matches!(step.phase, Phase::Contact { .. }));
    }
}

#[test]
fn no_command_leaves_the_limits_in_20_random_rooms() {
    let mut counts = Counts::default();
    for seed in 0..20 {
        let mut around = Around::new(seed);
        let (arm, board) = (SrsArm::iiwa7(), Board::default());
        let control = TargetControl::new(&arm, &board, RendererConfig::default());
        let mut control = control.unwrap();
        let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        let config = ServoConfig {
            seed,
            ..ServoConfig::default()
        };
        let mut servo = ServoArm::new(control.renderer().arm().clone(), start, config).unwrap();
        let mut limits = Limits::default();
        around.change(&mut control, &mut servo);
        drive(
            &mut control,
            &mut servo,
            &mut around,
            |control, servo, around, cycle| {
                limits.check(around, servo, cycle);
                servo.advance(DT_S)?;
                for j in 0..7 {
                    let (q, qd) = (servo.q()[j], servo.qd()[j]);
                    let place = format_args!("{seed} {} {j}", cycle.t_s);
                    assert!(servo.model().limits()[j].contains(q), "{place}: {q}");
                    assert!(qd.abs() <= servo.model().max_velocity_rad_per_s()[j] + 1e-12);
                }
                counts.count(control, servo);
                around.change(control, servo);
                Ok(())
            },
        )
        .expect("the simulated arm takes every command");
    }
    println!("{counts:?} steps");
    // The rooms must offer all of it.
    assert!(counts.out_of_reach > 500 && counts.no_target > 500);
    // A target that drifts in every step is seldom reached exactly.
    assert!(counts.at_goal > 500 && counts.touched > 500);
}

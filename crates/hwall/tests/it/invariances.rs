//! What a session does depends neither on clock, place or handedness of the world, nor on how a file lists its triangles, and hardly on the
//! rates of tracker and control.

use crate::common::{
    DT_S, GazeSession, Hand, home, iiwa, largest_difference_rad, position, session_of,
};
use hwall::glam::{DMat3, DVec3};
use hwall::hand::HandFrame;
use hwall::haptics::Arm;
use hwall::kinematics::{JointPositions, Pose};
use hwall::maps_of;
use hwall::scene::Scene;
use hwall_sim::{HandContact, ServoArm, ServoConfig};
use std::sync::{Arc, LazyLock};

const TARGET_M: DVec3 = DVec3::new(0.6, 0.1, 0.6);
const SECONDS: f64 = 4.0;

/// A house: a wall with a low table in front of it.
const OBJ: &str = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 2\nv 0.6 -1 2\nf 1 2 3\nf 1 3 4\n\
                   o table\nv 0.6 0.6 0.3\nv 1.2 0.6 0.3\nv 1.2 1 0.3\nv 0.6 1 0.3\nf 5 6 7\nf 5 7 8\n";

fn scene() -> Scene {
    Scene::from_obj_str(OBJ, None).unwrap().0
}

/// Settings of a run; the rest are defaults.
struct Run {
    scene: Scene,
    start: JointPositions,
    /// Applied to every frame after it was seen.
    seen: fn(HandFrame) -> HandFrame,
    clock_s: f64,
    tracker_hz: f64,
    period_s: f64,
}

impl Default for Run {
    fn default() -> Self {
        Self {
            scene: scene(),
            start: home(),
            seen: |frame| frame,
            clock_s: 0.0,
            tracker_hz: 90.0,
            period_s: DT_S,
        }
    }
}

/// Results of a touch: commands, and the face when the hand meets the wall.
struct Answer {
    commands: Vec<Option<JointPositions>>,
    face_at_contact: Pose,
}

impl Run {
    fn answered(self) -> Answer {
        let arm = iiwa();
        let maps = maps_of(&self.scene, &arm).unwrap();
        let mut session: GazeSession = session_of(&arm, self.scene, maps);
        let config = ServoConfig::default();
        let mut servo = ServoArm::new(Arc::new(iiwa()), self.start, config).unwrap();
        let hand = Hand::reaching_in(1.0, TARGET_M);
        let (finger, mut frames) = (HandContact::default(), 0_u32);
        let (mut commands, mut face_at_contact) = (Vec::new(), servo.pose());
        for cycle in 0..(SECONDS / self.period_s).round() as usize {
            let t_s = cycle as f64 * self.period_s;
            // Frames fall between the cycles, because the order of simultaneous events depends on rounding.
            let next_s = |frames: u32| f64::from(frames) / self.tracker_hz + 0.37e-3;
            while next_s(frames) <= t_s {
                let seen_s = next_s(frames);
                let mut frame = (self.seen)(hand.frame(seen_s));
                frame.t_s = self.clock_s + seen_s;
                session.frame(&frame);
                frames += 1;
            }
            let mut state = servo.state().unwrap();
            state.t_s += self.clock_s;
            let command = session.step(self.clock_s + t_s, &state);
            session.plan();
            commands.push(position(command));
            servo.command(command).unwrap();
            servo.advance(self.period_s).unwrap();
            if t_s < hand.press_s {
                face_at_contact = servo.pose();
            }
            let tip = (self.seen)(hand.frame(t_s)).tips_m[1].unwrap();
            let ahead = (self.seen)(hand.frame(t_s + 1e-4)).tips_m[1].unwrap();
            let relative = (ahead - tip) / 1e-4 - servo.twist().linear_m_per_s;
            let wrench = finger.wrench(&servo.pose(), tip, relative).unwrap();
            servo.apply_wrench(wrench.unwrap_or_default()).unwrap();
        }
        Answer {
            commands,
            face_at_contact,
        }
    }
}

impl Answer {
    /// Largest difference of the commands, rad.
    fn worst(&self, other: &Self) -> f64 {
        largest_difference_rad(&self.commands, &other.commands)
    }

    /// Distance of the touch from the middle of the face, along it and across it, m.
    fn missed_m(&self) -> [f64; 2] {
        let there = self.face_at_contact.inverse_transform_point(TARGET_M);
        [there.x.hypot(there.y), there.z.abs()]
    }
}

/// The plain run.
static NOMINAL: LazyLock<Answer> = LazyLock::new(|| Run::default().answered());

/// The slack of a prediction without a covariance: half a face less inset, margin and one standard deviation, m.
const SLACK_M: f64 = 0.055;

#[test]
fn the_clock_may_start_at_any_time() {
    let nominal = &*NOMINAL;
    for clock_s in [1.0, 1000.0, 1.7e9] {
        let run = Run {
            clock_s,
            ..Run::default()
        };
        let worst = nominal.worst(&run.answered());
        // Rounding may delay what is due exactly in a cycle by one cycle.
        assert!(worst < 5e-4, "{clock_s}: {worst}");
    }
}

#[test]
fn triangles_and_surfaces_may_come_in_any_order() {
    let nominal = &*NOMINAL;
    let other = "o table\nv 0.6 0.6 0.3\nv 1.2 0.6 0.3\nv 1.2 1 0.3\nv 0.6 1 0.3\nf 3 4 1\nf 2 3 1\n\
                 o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 2\nv 0.6 -1 2\nf 7 8 5\nf 5 6 7\n";
    let scene = Scene::from_obj_str(other, None).unwrap().0;
    let run = Run {
        scene,
        ..Run::default()
    };
    let worst = nominal.worst(&run.answered());
    assert!(worst < 1e-9, "{worst}");
}

/// Mirrors left and right.
fn mirrored(frame: HandFrame) -> HandFrame {
    let flip = |p: DVec3| DVec3::new(p.x, -p.y, p.z);
    HandFrame {
        palm_m: frame.palm_m.map(flip),
        tips_m: frame.tips_m.map(|tip| tip.map(flip)),
        head_m: frame.head_m.map(flip),
        gaze: frame.gaze.map(flip),
        ..frame
    }
}

/// The iiwa's joints after mirroring: those about upright axes change their sign.
fn mirrored_q(q: JointPositions) -> JointPositions {
    let signs = [-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
    JointPositions(std::array::from_fn(|i| signs[i] * q[i]))
}

#[test]
fn a_mirrored_world_is_answered_by_a_mirrored_motion() {
    // The board is upright, so that a turned one is its own mirror image.
    let nominal = &*NOMINAL;
    let words = |line: &str| match line.split_whitespace().collect::<Vec<_>>()[..] {
        ["v", x, y, z] => format!("v {x} {} {z}\n", -y.parse::<f64>().unwrap()),
        ["f", a, b, c] => format!("f {a} {c} {b}\n"),
        _ => format!("{line}\n"),
    };
    let obj: String = OBJ.lines().map(words).collect();
    let run = Run {
        scene: Scene::from_obj_str(&obj, None).unwrap().0,
        start: mirrored_q(home()),
        seen: mirrored,
        ..Run::default()
    };
    // The order of computation decides between two equal turns of the board about its normal, but not its place.
    let arm = iiwa();
    let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    for (a, b) in nominal.commands.iter().zip(run.answered().commands) {
        if let (Some(a), Some(b)) = (*a, b) {
            let [a_m, b_m] = [a, b].map(|q| arm.forward(&q).position_m());
            let apart_m = a_m.distance(flip * b_m);
            assert!(apart_m < 1e-6, "{apart_m} m");
        }
    }
}

/// The place of the board when the hand arrives depends on what was seen by then: within a bound.
#[test]
fn trackers_and_control_loops_of_any_rate_bring_the_board() {
    for (tracker_hz, period_s) in [
        (60.0, 0.001),
        (72.0, 0.001),
        (90.0, 0.001),
        (120.0, 0.001),
        (90.0, 0.005),
        (90.0, 0.002),
    ] {
        let run = Run {
            tracker_hz,
            period_s,
            ..Run::default()
        };
        let [along_m, across_m] = run.answered().missed_m();
        assert!(
            along_m < SLACK_M && across_m < 0.005,
            "{tracker_hz} {period_s}: {along_m} {across_m}"
        );
    }
}

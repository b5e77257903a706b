//! A sliding panel with a texture: moved by a finger that scans across its path, and at rest under a finger that scans along it.

use crate::common::{DT_S, TRACKER_S, by_gaze, config, iiwa, session_on, with_room};
use hwall::geometry::Wrench;
use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, Board, MovingObject};
use hwall::scene::{Scene, SurfaceId};
use hwall::texton::{Level, ScanAngle};
use hwall::texture::TextureLevels;
use hwall::{EventKind, Walls, maps_of, object_of};
use hwall_sim::{HandContact, ServoArm, ServoConfig, minimum_jerk};
use std::sync::Arc;

const PANEL: SurfaceId = SurfaceId(0);
const TARGET_M: DVec3 = DVec3::new(0.6, 0.0, 0.6);
const DEPTH_M: f64 = 0.015;
/// Speeds of the scanning finger, and of the board against it, m/s.
const SCAN: DVec3 = DVec3::Y;
const SCAN_M_PER_S: f64 = 0.06;
const BOARD_M_PER_S: f64 = 0.04;
/// Times at which the hand presses, moves the panel and lets go, s.
const PRESS_S: f64 = 1.8;
const LEAVE_S: f64 = 2.5;

/// A panel in the plane x = 0.6 that slides along a direction.
fn panel(direction: DVec3, mechanics: &str) -> Scene {
    let obj = "o panel\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 2\nv 0.6 -1 2\nf 1 2 3 4\n";
    let [x, y, z] = direction.to_array();
    let sidecar = format!(
        "[surface.panel]\nroughness = 1.0\nkind = \"sliding_panel\"\ndirection = [{x:?}, {y:?}, {z:?}]\n\
         range_m = [-0.5, 0.5]\n{mechanics}"
    );
    Scene::from_obj_str(obj, Some(&sidecar)).unwrap().0
}

/// Free position of the finger, m. It accelerates along `takes` while it presses, m/s².
fn tip_m(t_s: f64, takes: DVec3) -> DVec3 {
    let share = |from_s: f64, to_s: f64| minimum_jerk((t_s - from_s) / (to_s - from_s));
    let out = share(0.2, PRESS_S) - share(LEAVE_S, LEAVE_S + 0.3);
    let slid_s = t_s.clamp(PRESS_S, LEAVE_S) - PRESS_S;
    let slid_m = SCAN * (SCAN_M_PER_S * slid_s) + takes * (0.5 * slid_s * slid_s);
    let rest_m = TARGET_M + DVec3::X * 0.4;
    rest_m.lerp(TARGET_M - DVec3::X * DEPTH_M + slid_m, out)
}

/// Results of a touch.
#[derive(Debug, Default)]
struct Felt {
    /// Mean velocity of the board relative to the panel, against the scan, from 0.2 s after the scan began, m/s.
    board_m_per_s: f64,
    /// Travel of the panel, m, and the largest error against its closed form under the force of the finger.
    moved_m: f64,
    off_m: f64,
}

impl Felt {
    /// The speed of the board as a share of that of its texture.
    fn share(&self) -> f64 {
        self.board_m_per_s / BOARD_M_PER_S
    }
}

fn touched(direction: DVec3, mechanics: &str, takes: DVec3) -> Felt {
    let scene = panel(direction, mechanics);
    let (mechanics, path) = object_of(&scene, PANEL).unwrap().unwrap();
    let mut ideal = MovingObject::new(mechanics).unwrap();
    let mut walls = Walls::from(maps_of(&scene, &iiwa()).unwrap());
    walls.waiting = Some(with_room());
    let mut session = session_on(scene, walls, by_gaze(), config());
    let level = Level {
        scan: ScanAngle::from_deg(90.0).unwrap(),
        speed_mm_per_s: 1e3 * BOARD_M_PER_S,
        magnitude: 1.0,
    };
    session.set_texture_levels(TextureLevels::of_level(level, &Board::default()).unwrap());
    let mut arm = ServoArm::new(Arc::new(iiwa()), with_room(), ServoConfig::default()).unwrap();
    let finger = HandContact::default();
    let (mut frames, mut felt, mut count, mut started) = (0, Felt::default(), 0, false);
    for cycle in 0..(LEAVE_S / DT_S) as u32 {
        let now_s = f64::from(cycle) * DT_S;
        while f64::from(frames) * TRACKER_S <= now_s {
            let t_s = f64::from(frames) * TRACKER_S;
            frames += 1;
            let head_m = DVec3::new(1.35, -0.15, 1.05);
            session.frame(&HandFrame {
                palm_m: Some(tip_m(t_s, takes) + DVec3::X * 0.15),
                tips_m: [None, Some(tip_m(t_s, takes)), None, None, None],
                head_m: Some(head_m),
                gaze: Some((TARGET_M - head_m).normalize()),
                ..HandFrame::empty(t_s)
            });
        }
        let state = arm.state().unwrap();
        let command = session.step(now_s, &state);
        session.plan();
        arm.command(command).unwrap();
        arm.advance(DT_S).unwrap();
        let next_s = now_s + DT_S;
        let at_m = tip_m(next_s, takes);
        let finger_m_per_s = (tip_m(next_s + 1e-5, takes) - tip_m(next_s - 1e-5, takes)) / 2e-5;
        let board_m_per_s = arm.twist().linear_m_per_s;
        let over = finger_m_per_s - board_m_per_s;
        let pose = arm.pose();
        let pressed = finger.wrench(&pose, at_m, over).unwrap();
        let wrench = pressed.map_or(Wrench::default(), |pressed| {
            let over = over.reject_from_normalized(pose.rotation().z_axis);
            let drag_n = over * (0.5 * pressed.force_n.length() / (over.length() + 0.03));
            Wrench {
                force_n: pressed.force_n + drag_n,
                moment_n_m: pressed.moment_n_m + (at_m - pose.position_m()).cross(drag_n),
            }
        });
        arm.apply_wrench(wrench).unwrap();
        while let Some(event) = session.next_event() {
            started |= matches!(event.kind, EventKind::TextureStarted(_));
        }
        let moving = session.control().moving().next().unwrap();
        if moving.touched {
            let force_n = path.generalized_force(pose.position_m(), &wrench);
            ideal.step(force_n, DT_S).unwrap();
            felt.moved_m = moving.position;
            felt.off_m = felt.off_m.max((moving.position - ideal.position()).abs());
        }
        if now_s >= PRESS_S + 0.2 {
            let beside = board_m_per_s - direction * moving.velocity;
            felt.board_m_per_s -= beside.dot(SCAN);
            count += 1;
        }
    }
    assert!(started);
    felt.board_m_per_s /= f64::from(count);
    felt
}

#[test]
fn a_panel_goes_along_with_the_finger_and_its_texture_moves_across() {
    let mechanics = "mass_kg = 6\ndamping_n_s_per_m = 1\n";
    let felt = touched(DVec3::Z, mechanics, DVec3::Z * 0.04);
    assert!(felt.moved_m > 0.004, "{felt:?}");
    assert!(felt.off_m < 0.1 * felt.moved_m, "{felt:?}");
    assert!((felt.share() - 1.0).abs() < 0.05, "{felt:?}");
}

#[test]
fn a_panel_that_friction_holds_has_its_texture_along_its_path() {
    let felt = touched(SCAN, "friction_n = 15\n", DVec3::ZERO);
    assert_eq!((felt.moved_m, felt.off_m), (0.0, 0.0));
    assert!((felt.share() - 1.0).abs() < 0.03, "{felt:?}");
}

#[test]
fn a_panel_that_gives_way_along_the_scan_has_no_texture_of_its_own() {
    let felt = touched(SCAN, "mass_kg = 6\ndamping_n_s_per_m = 1\n", DVec3::ZERO);
    assert!(felt.moved_m > 0.005, "{felt:?}");
    assert!(felt.off_m < 0.1 * felt.moved_m, "{felt:?}");
    assert!(felt.share().abs() < 0.1, "{felt:?}");
}

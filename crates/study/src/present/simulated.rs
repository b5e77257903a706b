//! Trials on the simulated arm, each presented by its own session.

use super::hand::{END_S, LEAVE_S, PRESS_S, StudyHand};
use super::stimulus::{Fault, LEAST_SPEED_SHARE, Rendered, Stimulus, Surface};
use crate::error::StudyError;
use hwall::arrival::reachability::Target;
use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::geometry::{Pose, Wrench};
use hwall::glam::DVec3;
use hwall::hand::HandFilterConfig;
use hwall::haptics::{Arm, Board};
use hwall::kinematics::{JointPositions, SrsArm};
use hwall::scene::{Scene, SceneError};
use hwall::sim::{HandContact, ServoArm, ServoConfig};
use hwall::texton::{Level, ScanAngle};
use hwall::texture::TextureLevels;
use hwall::{EventKind, LikelyTouches, Session, SessionConfig, SessionError, Walls, WallsConfig};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::sync::{Arc, OnceLock};

/// Control period, s, and that of the tracker.
const DT_S: f64 = 1e-3;
const TRACKER_S: f64 = 1.0 / 90.0;
/// Distance of the surface in front of the base, m.
const WALL_M: f64 = 0.6;
/// Nominal point of touch, and largest offset from it, m.
const TARGET_M: DVec3 = DVec3::new(WALL_M, 0.0, 0.6);
const TARGET_OFF_M: f64 = 0.02;
/// Aim of the finger beyond the face, m: 5 to 10 N at 500 N/m.
const DEPTH_M: [f64; 2] = [0.010, 0.020];
/// Scan speed of the finger, m/s: above the threshold for a resting finger.
const SCAN_M_PER_S: [f64; 2] = [0.058, 0.066];
/// Direction of the scan. A door or a panel moves under it.
const SCAN: DVec3 = DVec3::Y;
/// Upward acceleration of the hand that drags a panel along while the finger scans, m/s², ...
const LIFT_M_PER_S2: f64 = 0.03;
/// ... by friction: coefficient, and slip speed at which friction reaches half its maximum, m/s.
const FRICTION: f64 = 0.5;
const SLIPS_M_PER_S: f64 = 0.03;
/// Averages start this long after the touch and the start of the scan, s, when the motion has settled.
const SETTLED_S: f64 = 0.2;
/// A touch counts as felt if it lasts at least this much longer, s.
const LEAST_FELT_S: f64 = 0.1;
/// Roughness of the surface: arbitrary, because the session presents the condition's level at any roughness.
const ROUGHNESS: f64 = 1.0;

/// One arm, one board and the surfaces of a study; trials do not affect each other.
#[derive(Debug, Clone)]
pub struct SimulatedStage {
    arm: SrsArm,
    board: Board,
    /// One per surface, except the whiteboard. Created on first use: each takes about a second.
    rooms: [OnceLock<Room>; 3],
}

#[derive(Debug, Clone)]
struct Room {
    scene: Scene,
    walls: Walls,
}

/// All participants touch the same place, so the arm waits there.
fn likely_touches() -> LikelyTouches {
    let off_m = [-TARGET_OFF_M, 0.0, TARGET_OFF_M];
    let places = off_m
        .iter()
        .flat_map(|y| off_m.map(|z| DVec3::new(0.0, *y, z)));
    let touch = |off_m| Target {
        point_m: TARGET_M + off_m,
        normal: DVec3::X,
    };
    LikelyTouches::Such(places.map(|off_m| touch(off_m).into()).collect())
}

impl SimulatedStage {
    /// The iiwa with its board at a wall, a door and a panel.
    ///
    /// # Errors
    /// None that a user can cause.
    pub fn new() -> Result<Self, StudyError> {
        let board = Board::default();
        let arm =
            SrsArm::iiwa7().with_tool(board.flange_from_board_face().map_err(SessionError::from)?);
        let stage = Self {
            arm,
            board,
            rooms: Default::default(),
        };
        stage.room(Surface::Wall)?;
        Ok(stage)
    }

    fn room(&self, surface: Surface) -> Result<&Room, StudyError> {
        let place = &self.rooms[surface as usize];
        if let Some(room) = place.get() {
            return Ok(room);
        }
        let scene = scene_of(surface).map_err(SessionError::from)?;
        let config = WallsConfig {
            touches: likely_touches(),
            ..WallsConfig::default()
        };
        let walls = Walls::of(&scene, &self.arm, &self.board, &config)?;
        Ok(place.get_or_init(|| Room { scene, walls }))
    }

    /// Presents a stimulus once: approach, touch, motion of the texture, release.
    ///
    /// `seed` shifts the point of touch by up to 2 cm and sets the finger's force and scan speed. Same
    /// stimulus and seed, same result.
    ///
    /// # Errors
    /// A stimulus outside its range.
    pub fn present(&self, stimulus: &Stimulus, seed: u64) -> Result<Rendered, StudyError> {
        let scan = ScanAngle::from_deg(stimulus.angle_deg).map_err(SessionError::from)?;
        let level = Level {
            scan,
            speed_mm_per_s: stimulus.speed_mm_per_s,
            magnitude: ROUGHNESS,
        };
        let levels = TextureLevels::of_level(level, &self.board)?;
        let mut numbers = Pcg64::seed_from_u64(seed);
        let mut within = |[low, high]: [f64; 2]| numbers.random_range(low..high);
        let off = [-TARGET_OFF_M, TARGET_OFF_M];
        let target_m = TARGET_M + DVec3::new(0.0, within(off), within(off));
        let (depth_m, scan_m_per_s) = (within(DEPTH_M), within(SCAN_M_PER_S));
        if stimulus.surface == Surface::Whiteboard {
            return Ok(touched_whiteboard(depth_m));
        }
        let room = self.room(stimulus.surface)?;
        let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led());
        let predictor = predictor.map_err(SessionError::from)?;
        let config = SessionConfig {
            hand: HandFilterConfig::simulated(),
            ..SessionConfig::default()
        };
        let mut session = Session::new(
            &self.arm,
            &self.board,
            room.scene.clone(),
            room.walls.clone(),
            predictor,
            config,
        )?;
        session.set_texture_levels(levels);
        let hand = StudyHand {
            target_m,
            depth_m,
            slide_m_per_s: SCAN * scan_m_per_s,
            takes_m_per_s2: match stimulus.surface {
                Surface::Panel => DVec3::Z * LIFT_M_PER_S2,
                _ => DVec3::ZERO,
            },
        };
        let home = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        let servo = ServoConfig {
            seed,
            ..ServoConfig::default()
        };
        let start = room.walls.waiting.unwrap_or(home);
        let servo = ServoArm::new(Arc::new(self.arm.clone()), start, servo)?;
        let mut trial = Trial {
            servo,
            hand,
            finger: HandContact::default(),
            felt: Felt::default(),
        };
        trial.run(&mut session, stimulus)
    }
}

/// A touch of a whiteboard, which neither moves nor yields.
fn touched_whiteboard(depth_m: f64) -> Rendered {
    Rendered {
        force_n: Some(HandContact::default().stiffness_n_per_m * depth_m),
        contact_s: LEAVE_S - PRESS_S,
        ..Rendered::default()
    }
    .rounded()
}

/// A wall, a door or a panel, 0.6 m in front of the base and facing +x, with a roughness: what the simulated arm presents.
///
/// # Errors
/// None that a user can cause.
pub fn scene_of(surface: Surface) -> Result<Scene, SceneError> {
    let obj = format!(
        "o surface\nv {WALL_M} -1 0\nv {WALL_M} 1 0\nv {WALL_M} 1 2\nv {WALL_M} -1 2\nf 1 2 3 4\n"
    );
    let kind = match surface {
        Surface::Wall | Surface::Whiteboard => String::new(),
        // Damping: the door yields for a whole touch without running ahead of the finger.
        Surface::Door => format!(
            "kind = \"revolving_door\"\nhinge_point_m = [{WALL_M}, -1, 0]\nhinge_axis = [0, 0, 1]\nrange_deg = [-60, 60]\n\
             inertia_kg_m2 = 40\ndamping_n_m_s_per_rad = 600\n"
        ),
        // A light sash: it moves up with the finger, and its texture moves across that motion.
        Surface::Panel => {
            "kind = \"sliding_panel\"\ndirection = [0, 0, 1]\nrange_m = [-0.5, 0.5]\n\
             mass_kg = 6\ndamping_n_s_per_m = 1\n"
                .to_owned()
        }
    };
    let sidecar = format!("[surface.surface]\nroughness = {ROUGHNESS}\n{kind}");
    Ok(Scene::from_obj_str(&obj, Some(&sidecar))?.0)
}

/// The wrench of a pressing finger on the board, including friction of sliding.
fn with_friction(
    pressed: &Wrench,
    base_from_board: &Pose,
    tip_m: DVec3,
    relative_m_per_s: DVec3,
) -> Wrench {
    let over = relative_m_per_s.reject_from_normalized(base_from_board.rotation().z_axis);
    let share = FRICTION * pressed.force_n.length() / (over.length() + SLIPS_M_PER_S);
    let drag_n = over * share;
    Wrench {
        force_n: pressed.force_n + drag_n,
        moment_n_m: pressed.moment_n_m + (tip_m - base_from_board.position_m()).cross(drag_n),
    }
}

/// Sums over the felt part of a touch.
#[derive(Debug, Clone, Copy, Default)]
struct Felt {
    count: usize,
    /// Velocity over the board, along and across the bumps, m/s.
    along_m_per_s: f64,
    across_m_per_s: f64,
    board_mm_per_s: f64,
    finger_mm_per_s: f64,
    force_n: f64,
}

struct Trial {
    servo: ServoArm,
    hand: StudyHand,
    finger: HandContact,
    felt: Felt,
}

impl Trial {
    fn run(
        &mut self,
        session: &mut Session<DeterministicPredictor>,
        stimulus: &Stimulus,
    ) -> Result<Rendered, StudyError> {
        let cycles = (END_S / DT_S) as usize;
        let (mut frames, mut touched_s, mut contact_s) = (0_usize, None, 0.0);
        let (mut late, mut started, mut ended, mut stopped) = (false, false, false, false);
        let mut moved: Option<f64> = None;
        for cycle in 0..cycles {
            let now_s = cycle as f64 * DT_S;
            while frames as f64 * TRACKER_S <= now_s {
                session.frame(&self.hand.frame(frames as f64 * TRACKER_S));
                frames += 1;
            }
            let state = self.servo.state()?;
            let command = session.step(now_s, &state);
            session.plan();
            self.servo.command(command)?;
            self.servo.advance(DT_S)?;
            let next_s = now_s + DT_S;
            let pose = self.servo.pose();
            let board_m_per_s = self.servo.twist().linear_m_per_s;
            let finger_m_per_s = self.hand.velocity_m_per_s(next_s);
            let relative = finger_m_per_s - board_m_per_s;
            let tip_m = self.hand.tip_m(next_s);
            let pressed = self.finger.wrench(&pose, tip_m, relative)?;
            let wrench = match stimulus.surface {
                Surface::Panel => {
                    pressed.map(|pressed| with_friction(&pressed, &pose, tip_m, relative))
                }
                _ => pressed,
            };
            self.servo.apply_wrench(wrench.unwrap_or_default())?;
            while let Some(event) = session.next_event() {
                match event.kind {
                    EventKind::Touched { .. } => touched_s = touched_s.or(Some(event.t_s)),
                    EventKind::Late => late |= now_s < PRESS_S,
                    EventKind::TextureStarted(_) => started = true,
                    EventKind::TextureEnded => ended |= now_s < LEAVE_S,
                    EventKind::Safe(_) => stopped |= session.control().is_latched(),
                    _ => {}
                }
            }
            let Some(pressed) = pressed else {
                continue;
            };
            contact_s += DT_S;
            let object = session.control().moving().next();
            moved = object.map(|o| o.position).or(moved);
            let settled = touched_s.is_some_and(|t_s| now_s >= t_s.max(PRESS_S) + SETTLED_S);
            let moves = !ended || stimulus.speed_mm_per_s == 0.0;
            if settled && moves && next_s < LEAVE_S {
                let normal = pose.rotation().z_axis;
                let in_plane = |v: DVec3| v - normal * v.dot(normal);
                let (relative, long) = (in_plane(relative), pose.rotation().x_axis);
                let scan = in_plane(SCAN).normalize_or_zero();
                self.felt.count += 1;
                self.felt.along_m_per_s += relative.dot(long);
                self.felt.across_m_per_s += relative.dot(pose.rotation().y_axis);
                self.felt.board_mm_per_s -= 1e3 * board_m_per_s.dot(scan);
                self.felt.finger_mm_per_s += 1e3 * relative.length();
                self.felt.force_n += pressed.force_n.length();
            }
        }
        let felt = self.felt;
        let enough = felt.count as f64 * DT_S >= LEAST_FELT_S;
        let mean = |sum: f64| {
            enough
                .then(|| sum / felt.count as f64)
                .filter(|m| m.is_finite())
        };
        let least = LEAST_SPEED_SHARE * stimulus.speed_mm_per_s;
        let slow = mean(felt.board_mm_per_s).is_some_and(|v| v < least);
        let fault = if stopped {
            Fault::Stopped
        } else if touched_s.is_none() || !enough {
            if late { Fault::Late } else { Fault::NoTouch }
        } else if stimulus.speed_mm_per_s > 0.0 && (!started || slow) {
            Fault::NoTexture
        } else {
            Fault::None
        };
        Ok(Rendered {
            angle_deg: mean(felt.across_m_per_s).map(|_| {
                felt.across_m_per_s
                    .abs()
                    .atan2(felt.along_m_per_s.abs())
                    .to_degrees()
            }),
            speed_mm_per_s: mean(felt.board_mm_per_s),
            felt_mm_per_s: mean(felt.finger_mm_per_s),
            force_n: mean(felt.force_n),
            contact_s,
            moved,
            patch: stimulus.patch,
            fault,
        }
        .rounded())
    }
}

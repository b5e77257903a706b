//! A board with bumps that is rolled before a touch and moved during it, so that it feels as rough as the surface it represents.

use crate::error::SessionError;
use crate::fingertip::Fingertip;
use crate::response::Task;
use glam::{DVec2, DVec3};
use hwall_contact::ContactPrediction;
use hwall_geometry::Pose;
use hwall_haptics::{Board, Slide, board_pose, surface_axes};
use hwall_kinematics::{ArmKinematics, ArmScratch, BranchPolicy, JointPositions, NearestConfig};
use hwall_scene::{Scene, SurfaceId};
use hwall_texton::{
    Encoding, FingerState, Level, Limit, MotionLimits, RoughnessModel, ScanAngle, ScanConfig,
    Texture, TextureMotion, Vibration,
};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Orientations of the published study, degrees.
const ORIENTATIONS_DEG: [f64; 5] = [0.0, 45.0, 63.43, 71.57, 90.0];
/// Speeds of the published study, mm/s, without 0: on a board at rest, a finger at rest feels no texture.
const SPEEDS_MM_PER_S: [f64; 4] = [20.0, 40.0, 60.0, 80.0];

/// A finger slower than this counts as resting, m/s; tremor and tracker noise reach half of it.
const RESTS_M_PER_S: f64 = 0.05;
/// After landing, a finger still carries the motion of its reach for this time, s; that is not a scan.
const LANDING_S: f64 = 0.2;
/// Points of the stroke that are tested in a step; even at 5 ms a step, they stay ahead of the fastest board.
const PROBES: usize = 2;
/// Unit vectors that differ by less are equal: a measured pose is no more accurate.
const TURNED: f64 = 1e-6;
/// Time constant of the estimated scan of a resting finger, s, and its fastest turn, rad/s: a circle of 20 mm diameter at 0.2 m/s.
const SCAN_S: f64 = 0.05;
const SCAN_RAD_PER_S: f64 = 20.0;

/// Orientation and speed of the released bumpy patch for each roughness of a scene.
#[derive(Debug, Clone)]
pub struct TextureLevels {
    texture: Texture,
    model: Vibration,
    encoding: Encoding,
    /// Motion at rest; gives the roll at which a level is presented.
    motion: TextureMotion,
}

impl TextureLevels {
    /// Levels of the released patch for the roughnesses of a scene; `None` if it has none.
    ///
    /// # Errors
    /// More roughnesses than there are levels.
    pub fn for_scene(scene: &Scene, board: &Board) -> Result<Option<Self>, SessionError> {
        let touchable = scene.surfaces().iter().filter(|s| s.touchable());
        let mut roughness: Vec<f64> = touchable.filter_map(|s| s.roughness).collect();
        roughness.sort_by(f64::total_cmp);
        roughness.dedup();
        if roughness.is_empty() {
            return Ok(None);
        }
        Ok(Some(Self {
            texture: Texture::released(),
            model: Vibration::default(),
            encoding: Encoding::new(&roughness, &Self::available()?)?,
            motion: motion(board)?,
        }))
    }

    /// All levels that the released patch can present, with the roughness that the model predicts for them.
    ///
    /// # Errors
    /// None in practice: angles and speeds are those of the published study.
    pub fn available() -> Result<Vec<Level>, SessionError> {
        levels(&Texture::released(), &Vibration::default())
    }

    /// One level for all surfaces that have a roughness, whatever its value: a study's condition.
    ///
    /// # Errors
    /// A level with a speed or a magnitude that is not finite.
    pub fn of_level(level: Level, board: &Board) -> Result<Self, SessionError> {
        Ok(Self {
            texture: Texture::released(),
            model: Vibration::default(),
            encoding: Encoding::new(&[level.magnitude], &[level])?,
            motion: motion(board)?,
        })
    }

    /// The levels for the scene's roughnesses, smoothest first.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        self.encoding.levels()
    }

    /// Perceived roughness of the patch at an orientation and a speed, by the model that chose the levels; `None` outside the range of the
    /// model.
    #[must_use]
    pub fn magnitude(&self, scan: ScanAngle, speed_mm_per_s: f64) -> Option<f64> {
        let predicted = self.model.predict(&self.texture, scan, speed_mm_per_s);
        predicted.ok()?.value()
    }

    /// Roll of the board that presents a roughness (the nearest one of the scene), rad, modulo half a turn; `None` for NaN.
    #[must_use]
    pub fn roll_of_rad(&self, roughness: f64) -> Option<f64> {
        let level = self.encoding.level_for(roughness)?;
        Some(self.motion.roll_for(level))
    }

    /// The roll of the board for a contact, rad; `None` if the surface has no roughness or the arm
    /// cannot hold the board with that roll.
    pub(crate) fn roll_rad(
        &self,
        presenter: &mut Presenter,
        contact: &ContactPrediction,
    ) -> Option<f64> {
        let roll_rad = self.roll_of_rad(contact.roughness?)?;
        let mut presents =
            |roll_rad: f64| presenter.presents(contact.point_m, contact.normal, roll_rad);
        (presents(roll_rad) || presents(roll_rad + PI)).then_some(roll_rad)
    }
}

/// Tests whether the arm can present the board at a place. For any arm, without allocation.
#[derive(Debug, Clone)]
pub(crate) struct Presenter {
    arm: Arc<dyn ArmKinematics>,
    scratch: ArmScratch,
    /// Start of the next search; if it fails, the search restarts at `first`, which is necessary on the other side of a stroke.
    reference: JointPositions,
    first: JointPositions,
    policy: BranchPolicy,
}

impl Presenter {
    pub(crate) fn new(arm: Arc<dyn ArmKinematics>) -> Self {
        let middle = arm.limits().map(|l| l.middle_rad());
        Self {
            scratch: arm.scratch(),
            arm,
            reference: JointPositions(middle),
            first: JointPositions(middle),
            policy: BranchPolicy::Any,
        }
    }

    /// From now on only solutions next to these joints (rad), or next to the last solution, count, as for a motion that starts there. The
    /// board is first turned by `roll_rad`.
    fn near(&mut self, q: &JointPositions, roll_rad: f64) {
        (self.reference, self.first) = (*q, *q);
        // If the last joint does not turn the board, solutions are sought on the same branch.
        self.policy = BranchPolicy::Keep;
        let Some(last) = self.arm.joint_count().checked_sub(1) else {
            return;
        };
        let mut turned = *q;
        turned[last] = self.arm.limits()[last].nearest_turn(q[last] + roll_rad, q[last]);
        let [here, there] = [q, &turned].map(|q| self.arm.forward(q).rotation());
        let wanted = here.x_axis * roll_rad.cos() + here.y_axis * roll_rad.sin();
        if there.x_axis.distance(wanted) < TURNED && self.arm.limits()[last].contains(turned[last])
        {
            (self.reference, self.first, self.policy) = (turned, turned, BranchPolicy::Beside);
        }
    }

    fn presents(&mut self, point_m: DVec3, normal: DVec3, roll_rad: f64) -> bool {
        let config = NearestConfig {
            policy: self.policy,
            ..NearestConfig::default()
        };
        let Ok(pose) = board_pose(point_m, normal, roll_rad) else {
            return false;
        };
        let tries = match self.policy {
            BranchPolicy::Beside => 2,
            _ => 1,
        };
        let (arm, scratch) = (&self.arm, &mut self.scratch);
        let found = ([self.reference, self.first].iter().take(tries))
            .find_map(|reference| arm.nearest(&pose, reference, &config, scratch).ok());
        if let Some(solution) = &found {
            self.reference = solution.q;
        }
        found.is_some()
    }
}

/// A touch of a surface that has a roughness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexturedTouch {
    /// The surface that the board represents.
    pub surface: SurfaceId,
    /// Roughness of that surface in the scene.
    pub roughness: f64,
    /// The orientation and speed that are presented for it.
    pub level: Level,
    /// The board's x and y axes at roll 0, unit vectors in the base frame.
    pub axes: [DVec3; 2],
}

/// The motion of a touched board that presents a level.
#[derive(Debug, Clone)]
pub struct BoardTexture {
    presenter: Presenter,
    encoding: Encoding,
    motion: TextureMotion,
    touch: Option<Touched>,
    /// The newest finger; if the tracker loses it during a touch, it is assumed to stay in place.
    fingertip: Option<Fingertip>,
    /// The present touch is answered by a board at rest.
    stands: bool,
}

/// A touch under way.
#[derive(Debug, Clone, Copy)]
struct Touched {
    touch: TexturedTouch,
    /// From when on the finger scans, s.
    scans_from_s: f64,
    /// Middle of the board at zero displacement, m; on a moving object, where this point was when the touch began.
    origin_m: DVec3,
    /// Where its stroke starts, m; the normal of the face and the roll of the board there, rad.
    stroke_from_m: DVec3,
    normal: DVec3,
    roll_rad: f64,
    /// The board may still move.
    going: bool,
}

/// The inputs of one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TextureInput {
    /// Is the board touched?
    pub(crate) touched: bool,
    /// The surface that the board represents, and its roughness in the scene.
    pub(crate) surface: Option<SurfaceId>,
    pub(crate) roughness: Option<f64>,
    /// The finger, while the hand is tracked.
    pub(crate) fingertip: Option<Fingertip>,
    /// What the hand is doing.
    pub(crate) gesture: Option<Task>,
    /// How the surface itself moves under the hand.
    pub(crate) surface_motion: SurfaceMotion,
}

/// Motion of a touched panel or drawer, base frame; zero for fixed surfaces.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SurfaceMotion {
    /// Displacement since the touch began, m.
    pub(crate) by_m: DVec3,
    /// m/s.
    pub(crate) velocity_m_per_s: DVec3,
}

/// The result of one step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TextureStep {
    pub(crate) slide: Option<Slide>,
    /// The touch that begins with this step.
    pub(crate) started: Option<TexturedTouch>,
    /// From this step on the motion comes to an end: the end of the stroke or of the face is near.
    pub(crate) ended: bool,
}

impl BoardTexture {
    pub(crate) fn new(levels: &TextureLevels, arm: Arc<dyn ArmKinematics>) -> Self {
        Self {
            presenter: Presenter::new(arm),
            encoding: levels.encoding.clone(),
            motion: levels.motion.clone(),
            touch: None,
            fingertip: None,
            stands: false,
        }
    }

    /// Estimated direction of the scan in the axes of the touch ([`TexturedTouch::axes`]), rad.
    #[must_use]
    pub const fn scan_rad(&self) -> f64 {
        self.motion.scan_rad()
    }

    /// One control step; `base_from_board` as measured. Inputs are finite.
    pub(crate) fn step(
        &mut self,
        now_s: f64,
        q: &JointPositions,
        base_from_board: &Pose,
        input: &TextureInput,
    ) -> TextureStep {
        self.fingertip = match (input.fingertip, self.fingertip) {
            (Some(seen), _) => Some(seen),
            (None, last) => last.map(|last| Fingertip {
                velocity_m_per_s: DVec3::ZERO,
                ..last
            }),
        };
        let mut step = TextureStep::default();
        let Some(fingertip) = self.fingertip.filter(|_| input.touched) else {
            step.ended = self.rest(now_s, input.roughness);
            self.stands = false;
            return step;
        };
        if self.touch.is_none() {
            self.stands |= matches!(input.gesture, Some(Task::Push | Task::Grasp));
            if self.stands {
                return step;
            }
            self.touch = self.begin(now_s, q, base_from_board, input, &fingertip);
            step.started = self.touch.map(|t| t.touch);
        }
        let Some(touch) = &mut self.touch else {
            return step;
        };
        let [x, y] = touch.touch.axes;
        let Touched {
            stroke_from_m: at_m,
            normal,
            roll_rad,
            ..
        } = *touch;
        let presenter = &mut self.presenter;
        for _ in 0..PROBES {
            self.motion.probe_stroke(|off_m, _| {
                presenter.presents(at_m + x * off_m.x + y * off_m.y, normal, roll_rad)
            });
        }
        let in_plane = |v: DVec3| DVec2::new(v.dot(x), v.dot(y));
        let landed = now_s >= touch.scans_from_s;
        // A finger that moves along with the surface does not scan it.
        let surface = input.surface_motion;
        let finger = FingerState {
            point_m: in_plane(fingertip.point_m - touch.origin_m - surface.by_m),
            velocity_m_per_s: if landed {
                in_plane(fingertip.velocity_m_per_s - surface.velocity_m_per_s)
            } else {
                DVec2::ZERO
            },
        };
        // Inputs are finite and the renderer accepted the clock; if the motion still rejects them, the board stands still.
        let Ok(moved) = self.motion.step(now_s, Some(finger), &touch.touch.level) else {
            return step;
        };
        let at_end = matches!(moved.limited, Some(Limit::Face | Limit::Stroke));
        // While the end of a stroke is still being probed, the limit is preliminary.
        if touch.going && at_end && !self.motion.is_probing() {
            touch.going = false;
            step.ended = true;
        }
        let in_space = |v: DVec2| x * v.x + y * v.y;
        step.slide = Some(Slide {
            velocity_m_per_s: in_space(moved.velocity_m_per_s),
            turn_rad_per_s: moved.roll_rad_per_s,
        });
        step
    }

    fn begin(
        &mut self,
        now_s: f64,
        q: &JointPositions,
        base_from_board: &Pose,
        input: &TextureInput,
        finger: &Fingertip,
    ) -> Option<Touched> {
        let (surface, roughness) = (input.surface?, input.roughness?);
        let level = *self.encoding.level_for(roughness)?;
        let normal = base_from_board.rotation().z_axis;
        let axes = surface_axes(normal).ok()?;
        let rest = self.motion.step(now_s, None, &level).ok()?.displacement_m;
        let in_space = |v: DVec2| axes[0] * v.x + axes[1] * v.y;
        let at_m = base_from_board.position_m();
        // Both directions along the bumps feel the same; choose the one with more of the face ahead.
        let off_m = (finger.point_m - at_m).dot(axes[0]);
        let [along, up] = axes.map(|axis| finger.velocity_m_per_s.dot(axis));
        let strokes = input.gesture == Some(Task::Stroke) && along.hypot(up) > RESTS_M_PER_S;
        let expected_rad = match strokes {
            true => up.atan2(along),
            false if off_m > 0.0 => PI,
            false => 0.0,
        };
        self.motion.scan_mut().expect(expected_rad).ok()?;
        let long = base_from_board.rotation().x_axis;
        let roll_rad = long.dot(axes[1]).atan2(long.dot(axes[0]));
        self.motion.stands_at(roll_rad).ok()?;
        self.motion.begin_stroke(&level);
        // Half a turn more feels the same.
        let turn_rad = self.motion.roll_for(&level) - roll_rad;
        let turn_rad = (turn_rad + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2;
        self.presenter.near(q, turn_rad);
        Some(Touched {
            touch: TexturedTouch {
                surface,
                roughness,
                level,
                axes,
            },
            scans_from_s: now_s + if strokes { 0.0 } else { LANDING_S },
            origin_m: at_m - in_space(rest),
            stroke_from_m: at_m,
            normal,
            roll_rad: roll_rad + turn_rad,
            going: true,
        })
    }

    /// Without a touch, the motion returns to its start. Returns whether this stopped a moving board.
    fn rest(&mut self, now_s: f64, roughness: Option<f64>) -> bool {
        let ended = self.touch.take();
        if ended.is_some() {
            // The next touch may scan in any direction; the roll of the board must not depend on the last one.
            let _ = self.motion.scan_mut().expect(0.0);
        }
        let level = roughness.and_then(|roughness| self.encoding.level_for(roughness));
        let level = level.or(self.encoding.levels().first()).copied();
        let _ = level.map(|level| self.motion.step(now_s, None, &level));
        ended.is_some_and(|touch| touch.going)
    }
}

/// The motion of a board of this size at rest.
fn motion(board: &Board) -> Result<TextureMotion, SessionError> {
    Ok(TextureMotion::new(MotionLimits {
        half_face_m: [board.half_width_m, board.half_height_m],
        scan: ScanConfig {
            time_constant_s: SCAN_S,
            least_speed_m_per_s: RESTS_M_PER_S,
            turn_rad_per_s: SCAN_RAD_PER_S,
        },
        ..MotionLimits::default()
    })?)
}

/// All levels that the patch can present, with their roughness predicted by a model.
fn levels(texture: &Texture, model: &dyn RoughnessModel) -> Result<Vec<Level>, SessionError> {
    let mut levels = Vec::new();
    for deg in ORIENTATIONS_DEG {
        for speed_mm_per_s in SPEEDS_MM_PER_S {
            let scan = ScanAngle::from_deg(deg)?;
            let predicted = model.predict(texture, scan, speed_mm_per_s)?;
            if let Some(magnitude) = predicted.value() {
                levels.push(Level {
                    scan,
                    speed_mm_per_s,
                    magnitude,
                });
            }
        }
    }
    Ok(levels)
}

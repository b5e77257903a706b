//! The board of the main job carries bumps: turned and moved so that it feels as rough as what is touched.

use anyhow::Context;
use glam::{DVec2, DVec3};
use hwall_contact::ContactPrediction;
use hwall_haptics::{Board, Slide, board_pose, surface_axes};
use hwall_kinematics::{Pose, SrsArm, Verdict};
use hwall_scene::Scene;
use hwall_testkit::quantile;
use hwall_texton::{
    Encoding, FingerState, Level, MotionLimits, RoughnessModel, ScanAngle, ScanConfig, Texture,
    TextureMotion, Vibration,
};
use std::f64::consts::PI;

/// Orientations of the published study, degrees, ...
const ORIENTATIONS_DEG: [f64; 5] = [0.0, 45.0, 63.43, 71.57, 90.0];
/// ... and its speeds, mm/s, without the resting board: a finger at rest feels no texture then.
const SPEEDS_MM_PER_S: [f64; 4] = [20.0, 40.0, 60.0, 80.0];

/// The wanted speed counts as reached within this share.
const WITHIN: f64 = 0.05;
/// The board has this long to reach it, s.
const RAMP_S: f64 = 0.05;

/// A finger slower than this rests, m/s: tremor and the noise of a tracker come to half of that.
const RESTS_M_PER_S: f64 = 0.05;
/// A finger that lands still carries the motion of its reach for so long, s: that is no scan.
const LANDING_S: f64 = 0.2;
/// Time constant of the scan's estimate, s.
const SCAN_S: f64 = 0.05;

/// What one touch of a textured surface felt like.
#[derive(Debug, Clone, PartialEq)]
pub struct TextureTouch {
    /// The surface that the board stood for.
    pub surface: String,
    /// Its roughness in the scene.
    pub roughness: f64,
    /// When the touch was felt, s.
    pub felt_s: f64,
    /// What was to be presented.
    pub wanted: Level,
    /// What was: medians from 50 ms after the touch was felt until the stroke or the touch ended; `None`
    /// for a touch that was shorter.
    pub rendered: Option<Level>,
    /// From when on the speed stayed within 5 % until then, s after the touch was felt.
    pub reached_s: Option<f64>,
    /// How long the board moved at the wanted speed or tried to, s.
    pub lasted_s: f64,
}

/// Chooses levels for surfaces, and the motion that presents them.
pub struct TexturedBoard {
    texture: Texture,
    model: Vibration,
    encoding: Encoding,
    motion: TextureMotion,
    touch: Option<Touch>,
    done: Vec<TextureTouch>,
}

/// A touch under way.
struct Touch {
    surface: String,
    roughness: f64,
    level: Level,
    felt_s: f64,
    axes: [DVec3; 2],
    /// Middle of the board where the motion's displacement is zero, m.
    origin_m: DVec3,
    /// Time since the touch was felt, s, speed of the texture under the finger against the scan, m/s,
    /// and angle between scan and bumps, rad.
    felt: Vec<(f64, f64, f64)>,
    /// The board still may move on.
    going: bool,
}

impl TexturedBoard {
    /// The released patch, for the roughnesses of a scene; `None` for a scene without any.
    ///
    /// # Errors
    /// More roughnesses than there are levels.
    pub fn for_scene(scene: &Scene, board: &Board) -> anyhow::Result<Option<Self>> {
        let touchable = scene.surfaces().iter().filter(|s| s.touchable());
        let mut roughness: Vec<f64> = touchable.filter_map(|s| s.roughness).collect();
        roughness.sort_by(f64::total_cmp);
        roughness.dedup();
        if roughness.is_empty() {
            return Ok(None);
        }
        let (texture, model) = (Texture::released(), Vibration::default());
        let levels = levels(&texture, &model)?;
        let encoding = Encoding::new(&roughness, &levels)
            .with_context(|| format!("{} roughnesses in one scene", roughness.len()))?;
        let motion = TextureMotion::new(MotionLimits {
            half_face_m: [board.half_width_m, board.half_height_m],
            scan: ScanConfig {
                time_constant_s: SCAN_S,
                least_speed_m_per_s: RESTS_M_PER_S,
                ..ScanConfig::default()
            },
            ..MotionLimits::default()
        })?;
        Ok(Some(Self {
            texture,
            model,
            encoding,
            motion,
            touch: None,
            done: Vec::new(),
        }))
    }

    /// The levels of the scene's roughnesses, from the smoothest.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        self.encoding.levels()
    }

    /// The roll of the board for a prediction, rad; `None` where the surface has no roughness or the arm
    /// cannot present it so.
    #[must_use]
    pub fn roll_rad(&self, arm: &SrsArm, prediction: &ContactPrediction) -> Option<f64> {
        let level = self.encoding.level_for(prediction.roughness?)?;
        let roll_rad = self.motion.roll_for(level);
        let reaches = |roll_rad: f64| {
            let pose = board_pose(prediction.point_m, prediction.normal, roll_rad);
            pose.is_ok_and(|pose| matches!(arm.verdict(&pose), Verdict::Reachable(_)))
        };
        (reaches(roll_rad) || reaches(roll_rad + PI)).then_some(roll_rad)
    }

    /// The motion of a touched board, for the finger where the tracker sees it. `found`: what the board stands for.
    ///
    /// # Errors
    /// A finger that is no number.
    pub fn slide(
        &mut self,
        t_s: f64,
        scene: &Scene,
        arm: &SrsArm,
        (found, board): (&ContactPrediction, &Pose),
        (finger_m, finger_m_per_s): (DVec3, DVec3),
    ) -> anyhow::Result<Option<Slide>> {
        if self.touch.is_none() {
            let Some(touch) = self.begin(t_s, scene, arm, (found, board), finger_m)? else {
                return Ok(None);
            };
            self.touch = Some(touch);
        }
        let Some(touch) = &mut self.touch else {
            return Ok(None);
        };
        let [x, y] = touch.axes;
        let in_plane = |v: DVec3| DVec2::new(v.dot(x), v.dot(y));
        let landed = t_s - touch.felt_s >= LANDING_S;
        let finger = FingerState {
            point_m: in_plane(finger_m - touch.origin_m),
            velocity_m_per_s: if landed {
                in_plane(finger_m_per_s)
            } else {
                DVec2::ZERO
            },
        };
        let step = self.motion.step(t_s, Some(finger), &touch.level)?;
        // Once it slows down for the end of its stroke it is not compared any more.
        use hwall_texton::Limit::{Face, Stroke};
        touch.going &= !matches!(step.limited, Some(Face | Stroke));
        let in_space = |v: DVec2| x * v.x + y * v.y;
        Ok(Some(Slide {
            velocity_m_per_s: in_space(step.velocity_m_per_s),
            turn_rad_per_s: step.roll_rad_per_s,
        }))
    }

    fn begin(
        &mut self,
        t_s: f64,
        scene: &Scene,
        arm: &SrsArm,
        (found, board): (&ContactPrediction, &Pose),
        finger_m: DVec3,
    ) -> anyhow::Result<Option<Touch>> {
        let level = |roughness: f64| self.encoding.level_for(roughness).copied();
        let Some((roughness, level)) = found.roughness.and_then(|r| Some((r, level(r)?))) else {
            return Ok(None);
        };
        let normal = board.rotation().z_axis;
        let axes = surface_axes(normal)?;
        let rest = self.motion.step(t_s, None, &level)?.displacement_m;
        let in_space = |v: DVec2| axes[0] * v.x + axes[1] * v.y;
        let at_m = board.position_m();
        // Either way along the bumps feels the same: the one that has more of the face to go.
        let off_m = (finger_m - at_m).dot(axes[0]);
        let expected_rad = if off_m > 0.0 { PI } else { 0.0 };
        self.motion.scan_mut().expect(expected_rad)?;
        let long = board.rotation().x_axis;
        let roll_rad = long.dot(axes[1]).atan2(long.dot(axes[0]));
        self.motion.stands_at(roll_rad)?;
        self.motion
            .limit_stroke(&level, |displacement_m, roll_rad| {
                let pose = board_pose(at_m + in_space(displacement_m), normal, roll_rad);
                pose.is_ok_and(|pose| matches!(arm.verdict(&pose), Verdict::Reachable(_)))
            });
        Ok(Some(Touch {
            surface: scene.surface(found.surface).name.clone(),
            roughness,
            level,
            felt_s: t_s,
            axes,
            origin_m: at_m - in_space(rest),
            felt: Vec::new(),
            going: true,
        }))
    }

    /// What really passes under the finger: the true board, and its velocity there, m/s.
    pub fn feel(&mut self, t_s: f64, board: &Pose, board_m_per_s: DVec3) {
        let Some(touch) = self.touch.as_mut().filter(|touch| touch.going) else {
            return;
        };
        let [x, y] = touch.axes;
        let in_plane = |v: DVec3| DVec2::new(v.dot(x), v.dot(y));
        let scan = DVec2::from_angle(self.motion.scan_rad());
        let long = in_plane(board.rotation().x_axis);
        let angle_rad = long.perp_dot(scan).atan2(long.dot(scan));
        let since_s = t_s - touch.felt_s;
        let speed = -in_plane(board_m_per_s).dot(scan);
        touch.felt.push((since_s, speed, angle_rad));
    }

    /// No touch: the motion goes back to where it began.
    ///
    /// # Errors
    /// A time that is no number.
    pub fn rest(&mut self, t_s: f64, level_of: Option<f64>) -> anyhow::Result<()> {
        if let Some(touch) = self.touch.take() {
            let ended = self.ended(touch);
            self.done.push(ended);
            // The next touch may scan any way again; the board's roll must not depend on the last one.
            self.motion.scan_mut().expect(0.0)?;
        }
        let level = level_of.and_then(|roughness| self.encoding.level_for(roughness));
        let level = *level.unwrap_or(&self.encoding.levels()[0]);
        self.motion.step(t_s, None, &level)?;
        Ok(())
    }

    fn ended(&self, touch: Touch) -> TextureTouch {
        let wanted_m_per_s = 1e-3 * touch.level.speed_mm_per_s;
        let steady = touch.felt.iter().filter(|f| f.0 >= RAMP_S);
        let median = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            quantile(&values, 0.5)
        };
        let folded = |rad: f64| ScanAngle::from_rad(rad).map_or(f64::NAN, ScanAngle::rad);
        let (speeds, angles): (Vec<f64>, Vec<f64>) = steady.map(|f| (f.1, folded(f.2))).unzip();
        let rendered = (!speeds.is_empty()).then(|| (1e3 * median(speeds), median(angles)));
        let rendered = rendered.and_then(|(speed_mm_per_s, angle_rad)| {
            let scan = ScanAngle::from_rad(angle_rad).ok()?;
            let predicted = self
                .model
                .predict(&self.texture, scan, speed_mm_per_s)
                .ok()?;
            Some(Level {
                scan,
                speed_mm_per_s,
                magnitude: predicted.value()?,
            })
        });
        let off = |speed: f64| (speed - wanted_m_per_s).abs() > WITHIN * wanted_m_per_s;
        let reached = match touch.felt.iter().rposition(|f| off(f.1)) {
            Some(last) => touch.felt.get(last + 1),
            None => touch.felt.first(),
        };
        TextureTouch {
            surface: touch.surface,
            roughness: touch.roughness,
            felt_s: touch.felt_s,
            wanted: touch.level,
            rendered,
            reached_s: reached.map(|f| f.0),
            lasted_s: touch.felt.last().map_or(0.0, |f| f.0),
        }
    }

    /// Every touch of a textured surface, once the last one is over.
    #[must_use]
    pub fn into_touches(mut self) -> Vec<TextureTouch> {
        if let Some(touch) = self.touch.take() {
            let ended = self.ended(touch);
            self.done.push(ended);
        }
        self.done
    }
}

/// What the patch can be, by how rough a model takes it to feel.
fn levels(texture: &Texture, model: &dyn RoughnessModel) -> anyhow::Result<Vec<Level>> {
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

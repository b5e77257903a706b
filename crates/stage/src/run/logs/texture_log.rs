//! Log of textured touches: wanted and rendered texture.

use glam::{DVec2, DVec3};
use hwall::texture::{TextureLevels, TexturedTouch};
use hwall::{Event, EventKind};
use hwall_geometry::{Pose, Twist};
use hwall_scene::Scene;
use hwall_testkit::quantile;
use hwall_texton::{Level, ScanAngle};

/// Relative tolerance for the wanted speed to count as reached.
const WITHIN: f64 = 0.05;
/// Time allowed for the board to reach it, s.
const RAMP_S: f64 = 0.05;

/// One touch of a textured surface.
#[derive(Debug, Clone, PartialEq)]
pub struct TextureTouch {
    /// The surface that the board represented.
    pub surface: String,
    /// Its roughness in the scene.
    pub roughness: f64,
    /// When the touch was felt, s.
    pub felt_s: f64,
    /// The wanted level.
    pub wanted: Level,
    /// The rendered level: medians from 50 ms after the touch was felt until the stroke or the touch ended; `None`
    /// for a shorter touch.
    pub rendered: Option<Level>,
    /// Time after the touch was felt from which the speed stayed within 5 % until then, s.
    pub reached_s: Option<f64>,
    /// Duration for which the board moved, or tried to move, at the wanted speed, s.
    pub lasted_s: f64,
}

/// Records the events of a session and the true motion of the arm.
pub struct TextureLog {
    /// Names of the scene's surfaces, by their number.
    names: Vec<String>,
    levels: TextureLevels,
    feeling: Option<Feeling>,
    done: Vec<TextureTouch>,
}

/// The current touch.
struct Feeling {
    touch: TexturedTouch,
    surface: String,
    felt_s: f64,
    /// Time since the touch was felt, s, speed of the texture under the finger against the scan, m/s,
    /// and angle between scan and bumps, rad.
    felt: Vec<(f64, f64, f64)>,
    /// The board may still move.
    going: bool,
}

impl TextureLog {
    /// For the levels of a scene.
    #[must_use]
    pub fn new(scene: &Scene, levels: TextureLevels) -> Self {
        Self {
            names: scene.surfaces().iter().map(|s| s.name.clone()).collect(),
            levels,
            feeling: None,
            done: Vec::new(),
        }
    }

    /// Processes an event of the session.
    pub fn event(&mut self, event: &Event) {
        match event.kind {
            EventKind::TextureStarted(touch) => {
                self.feeling = Some(Feeling {
                    touch,
                    surface: self.names.get(touch.surface.0).cloned().unwrap_or_default(),
                    felt_s: event.t_s,
                    felt: Vec::new(),
                    going: true,
                });
            }
            EventKind::TextureEnded => {
                if let Some(feeling) = &mut self.feeling {
                    feeling.going = false;
                }
            }
            EventKind::Released => self.end(),
            _ => {}
        }
    }

    /// Records the true motion under the finger: true board, its velocity, and the estimate of the scan, rad.
    pub fn feel(
        &mut self,
        t_s: f64,
        board: &Pose,
        finger_m: Option<DVec3>,
        twist: &Twist,
        scan_rad: f64,
    ) {
        let Some(feeling) = self.feeling.as_mut().filter(|feeling| feeling.going) else {
            return;
        };
        let arm_m = finger_m.map_or(DVec3::ZERO, |finger_m| finger_m - board.position_m());
        let under_finger = twist.linear_m_per_s + twist.angular_rad_per_s.cross(arm_m);
        let [x, y] = feeling.touch.axes;
        let in_plane = |v: DVec3| DVec2::new(v.dot(x), v.dot(y));
        let scan = DVec2::from_angle(scan_rad);
        let long = in_plane(board.rotation().x_axis);
        let angle_rad = long.perp_dot(scan).atan2(long.dot(scan));
        let speed = -in_plane(under_finger).dot(scan);
        feeling.felt.push((t_s - feeling.felt_s, speed, angle_rad));
    }

    fn end(&mut self) {
        if let Some(feeling) = self.feeling.take() {
            let ended = self.ended(feeling);
            self.done.push(ended);
        }
    }

    fn ended(&self, touch: Feeling) -> TextureTouch {
        let wanted_m_per_s = 1e-3 * touch.touch.level.speed_mm_per_s;
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
            Some(Level {
                scan,
                speed_mm_per_s,
                magnitude: self.levels.magnitude(scan, speed_mm_per_s)?,
            })
        });
        let off = |speed: f64| (speed - wanted_m_per_s).abs() > WITHIN * wanted_m_per_s;
        let reached = match touch.felt.iter().rposition(|f| off(f.1)) {
            Some(last) => touch.felt.get(last + 1),
            None => touch.felt.first(),
        };
        TextureTouch {
            surface: touch.surface,
            roughness: touch.touch.roughness,
            felt_s: touch.felt_s,
            wanted: touch.touch.level,
            rendered,
            reached_s: reached.map(|f| f.0),
            lasted_s: touch.felt.last().map_or(0.0, |f| f.0),
        }
    }

    /// All touches of textured surfaces; ends the current one.
    #[must_use]
    pub fn into_touches(mut self) -> Vec<TextureTouch> {
        self.end();
        self.done
    }
}

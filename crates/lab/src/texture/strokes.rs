//! Human-like strokes over the released patch, presented by a session: rendered and wanted roughness.

use super::stroke::{Stroke, StrokePath};
use glam::{DVec2, DVec3};
use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::hand::{HandFilterConfig, HandFrame};
use hwall::haptics::{Arm, Board, surface_axes};
use hwall::texture::TextureLevels;
use hwall::{EventKind, LikelyTouches, Session};
use hwall_sim::{HandContact, minimum_jerk};
use hwall_stage::input::arms::BoardArm;
use hwall_stage::person::predictors::TrainingPeople;
use hwall_stage::person::responses::Scenery;
use hwall_stage::run::simulated_arm::SimulatedArm;
use hwall_stage::run::stage::SessionSettings;
use hwall_study::{Surface, scene_of};
use hwall_testkit::{Column, MarkdownTable, Sampler, percent_of, quantiles, table_of};
use hwall_texton::{Level, ScanAngle, Texture};
use rayon::prelude::*;
use std::sync::Arc;

/// Control period, period of the tracker, and time between two judged moments, s.
const DT_S: f64 = 1e-3;
const TRACKER_S: f64 = 1.0 / 90.0;
const JUDGED_S: f64 = 5e-3;
/// Standard deviation of the tracker's noise, m.
const NOISE_M: f64 = 3e-4;
/// Middle of the strokes, on the wall of [`scene_of`], and rest position of the hand relative to it, m.
const MIDDLE_M: DVec3 = DVec3::new(0.6, 0.0, 0.6);
const REST_M: DVec3 = DVec3::new(0.4, 0.1, 0.1);
/// The head relative to the middle, m.
const HEAD_M: DVec3 = DVec3::new(0.7, -0.1, 0.4);
/// Aim of the finger beyond the face, m: 7.5 N at 500 N/m.
const DEPTH_M: f64 = 0.015;
/// Times at which the hand starts, presses and begins its stroke, s.
const START_S: f64 = 0.2;
const PRESS_S: f64 = 1.8;
const STROKE_S: f64 = 2.1;
/// Longest stroke, s.
const LASTS_S: f64 = 2.0;
/// Ranges of the mean speed of a stroke, m/s; used in turn.
const SPEEDS_M_PER_S: [[f64; 2]; 3] = [[0.02, 0.06], [0.06, 0.12], [0.12, 0.3]];
/// Speeds of the levels, mm/s, as in the study.
const LEVELS_MM_PER_S: [f64; 4] = [20.0, 40.0, 60.0, 80.0];

/// Below this speed over the texture, a finger has no direction, m/s.
const LEAST_M_PER_S: f64 = 2e-3;

/// The texture that a finger meets at a moment.
#[derive(Debug, Clone, Copy)]
struct Met {
    /// NaN without a direction.
    angle_deg: f64,
    bumps_hz: f64,
    roughness: f64,
}

impl Met {
    /// For a speed over the texture, m/s, by the model that chose the levels.
    fn of(levels: &TextureLevels, scan: ScanAngle, speed_m_per_s: f64) -> Option<Self> {
        let speed_mm_per_s = 1e3 * speed_m_per_s;
        Some(Self {
            angle_deg: match speed_m_per_s < LEAST_M_PER_S {
                true => f64::NAN,
                false => scan.deg(),
            },
            bumps_hz: Texture::released().encounter_frequency_hz(scan, speed_mm_per_s),
            roughness: levels.magnitude(scan, speed_mm_per_s)?,
        })
    }

    /// For a velocity over the texture, m/s, whose bumps have their long axis along `long`.
    fn over(levels: &TextureLevels, velocity_m_per_s: DVec2, long: DVec2) -> Option<Self> {
        let scan = ScanAngle::from_rad(long.angle_to(velocity_m_per_s)).ok()?;
        Self::of(levels, scan, velocity_m_per_s.length())
    }
}

/// A moment of a stroke.
#[derive(Debug, Clone, Copy)]
struct Moment {
    finger_m_per_s: f64,
    turns_rad_per_s: f64,
    /// Reference: a straight stroke at the speed of the finger over a board that presents the level exactly.
    wanted: Met,
    /// This stroke on a board that keeps the motion for the initial direction of the stroke.
    held: Met,
    /// This stroke on the board of the session; `None` if the board did not move.
    rendered: Option<Met>,
    /// Is the board at least half as fast as its level?
    board_moves: bool,
}

impl Moment {
    /// Wanted texture, and texture on a held board, at a time since the stroke began, s.
    fn of(levels: &TextureLevels, level: &Level, stroke: &Stroke, since_s: f64) -> Option<Self> {
        let begins = stroke.velocity_m_per_s(JUDGED_S).normalize_or(DVec2::X);
        let finger = stroke.velocity_m_per_s(since_s);
        let board_m_per_s = 1e-3 * level.speed_mm_per_s;
        let along = begins * begins.dot(finger).signum();
        let long = begins.rotate(DVec2::from_angle(level.scan.rad()));
        Some(Self {
            finger_m_per_s: finger.length(),
            turns_rad_per_s: stroke.turns_rad_per_s(since_s),
            wanted: Met::of(levels, level.scan, finger.length() + board_m_per_s)?,
            held: Met::over(levels, finger + along * board_m_per_s, long)?,
            rendered: None,
            board_moves: false,
        })
    }
}

/// A stroke over a level, as it was felt.
#[derive(Debug, Clone)]
pub struct Felt {
    path: StrokePath,
    /// Which of [`SPEEDS_M_PER_S`].
    range: usize,
    moments: Vec<Moment>,
}

/// Common data of all strokes.
struct Place {
    arm: BoardArm,
    scene: hwall_scene::Scene,
    walls: hwall::Walls,
    axes: [DVec3; 2],
}

impl Place {
    fn new() -> anyhow::Result<Self> {
        let arm = BoardArm::named("iiwa7", &Board::default())?;
        let scene = scene_of(Surface::Wall)?;
        let likely = hwall::arrival::reachability::Target {
            point_m: MIDDLE_M,
            normal: DVec3::X,
        };
        let likely = LikelyTouches::Such(vec![likely.into()]);
        Ok(Self {
            walls: arm.walls_of(&scene, likely, true)?,
            axes: surface_axes(DVec3::X)?,
            arm,
            scene,
        })
    }

    fn lift(&self, v: DVec2) -> DVec3 {
        self.axes[0] * v.x + self.axes[1] * v.y
    }

    fn in_plane(&self, v: DVec3) -> DVec2 {
        DVec2::new(v.dot(self.axes[0]), v.dot(self.axes[1]))
    }

    /// Free position of the fingertip, m.
    fn tip_m(&self, stroke: &Stroke, t_s: f64) -> DVec3 {
        let out = minimum_jerk((t_s - START_S) / (PRESS_S - START_S));
        let inside_m = self.lift(stroke.at_m((t_s - STROKE_S).max(0.0))) - DVec3::X * DEPTH_M;
        MIDDLE_M + REST_M.lerp(inside_m, out)
    }

    fn frame(&self, tip_m: DVec3, t_s: f64, noise: &mut Sampler) -> HandFrame {
        let mut noisy = |off_m: DVec3| {
            Some(tip_m + off_m + NOISE_M * DVec3::from([(); 3].map(|()| noise.normal())))
        };
        HandFrame {
            palm_m: noisy(DVec3::X * 0.15),
            tips_m: [None, noisy(DVec3::ZERO), None, None, None],
            head_m: noisy(MIDDLE_M + HEAD_M - tip_m),
            gaze: Some(-HEAD_M.normalize()),
            ..HandFrame::empty(t_s)
        }
    }

    /// A session that presents a level, and its arm.
    fn session(
        &self,
        levels: &TextureLevels,
        seed: u64,
    ) -> anyhow::Result<(Session<DeterministicPredictor>, SimulatedArm)> {
        let people = TrainingPeople::default();
        let scenery = Scenery::of(&self.scene, &self.arm, &self.walls, &people);
        let settings = SessionSettings {
            filter: HandFilterConfig::default(),
            ..SessionSettings::of(scenery)
        };
        let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led())?;
        let mut session = settings.session(predictor)?;
        session.set_texture_levels(levels.clone());
        let model = Arc::clone(session.control().arm());
        let start = scenery.start();
        let arm = SimulatedArm::new(settings.level, &self.arm, model, start, seed)?;
        Ok((session, arm))
    }

    /// A stroke over a level.
    fn felt(&self, stroke: &Stroke, level: &Level, seed: u64) -> anyhow::Result<Vec<Moment>> {
        let tip_m = |t_s| self.tip_m(stroke, t_s);
        let levels = TextureLevels::of_level(*level, &Board::default())?;
        let (mut session, mut arm) = self.session(&levels, seed)?;
        let (finger, mut noise) = (HandContact::default(), Sampler::new(seed));
        let (mut moments, mut frames, mut going) = (Vec::new(), 0_u32, false);
        let (mut due_s, end_s) = (STROKE_S, STROKE_S + stroke.lasts_s(LASTS_S));
        for cycle in 0..(end_s / DT_S) as u32 {
            let now_s = f64::from(cycle) * DT_S;
            while f64::from(frames) * TRACKER_S <= now_s {
                let t_s = f64::from(frames) * TRACKER_S;
                session.frame(&self.frame(tip_m(t_s), t_s, &mut noise));
                frames += 1;
            }
            let command = session.step(now_s, &arm.state()?);
            session.plan();
            arm.command(command)?;
            arm.advance(DT_S)?;
            let t_s = now_s + DT_S;
            let (pose, twist) = (arm.pose(), arm.twist());
            let lever_m = tip_m(t_s) - pose.position_m();
            let under_m_per_s = twist.linear_m_per_s + twist.angular_rad_per_s.cross(lever_m);
            let over_m_per_s = (tip_m(t_s) - tip_m(now_s)) / DT_S - under_m_per_s;
            let pressed = finger.wrench(&pose, tip_m(t_s), over_m_per_s)?;
            arm.apply_wrench(pressed.unwrap_or_default())?;
            while let Some(event) = session.next_event() {
                match event.kind {
                    EventKind::TextureStarted(_) => going = true,
                    EventKind::Released => going = false,
                    _ => {}
                }
            }
            if t_s >= due_s {
                due_s += JUDGED_S;
                let [over, long] = [over_m_per_s, pose.rotation().x_axis].map(|v| self.in_plane(v));
                let rendered = Met::over(&levels, over, long);
                let rendered = rendered.filter(|_| going && pressed.is_some());
                let board = under_m_per_s.length();
                let moment = Moment::of(&levels, level, stroke, t_s - STROKE_S);
                moments.extend(moment.map(|moment| Moment {
                    rendered,
                    board_moves: board > 0.5e-3 * level.speed_mm_per_s,
                    ..moment
                }));
            }
        }
        Ok(moments)
    }
}

/// Runs this many strokes of each path, with levels, speeds and sizes drawn from the seed.
///
/// # Errors
/// A configuration that a crate refuses.
pub fn run(seed: u64, strokes: usize) -> anyhow::Result<Vec<Felt>> {
    let place = Place::new()?;
    let all = StrokePath::ALL.into_iter();
    let all: Vec<_> = all
        .flat_map(|path| (0..strokes).map(move |n| (path, n)))
        .collect();
    let felt = all.into_par_iter().map(|(path, number)| {
        // The same levels, speeds and sizes for every path.
        let mut sampler = Sampler::new(seed.wrapping_add(number as u64));
        let range = number % SPEEDS_M_PER_S.len();
        let level = Level {
            scan: ScanAngle::from_deg(sampler.uniform(0.0, 90.0))?,
            speed_mm_per_s: LEVELS_MM_PER_S[sampler.index(LEVELS_MM_PER_S.len())],
            magnitude: 1.0,
        };
        let stroke = Stroke::drawn(path, SPEEDS_M_PER_S[range], LASTS_S, &mut sampler);
        let moments = place.felt(&stroke, &level, seed.wrapping_add(number as u64))?;
        Ok(Felt {
            path,
            range,
            moments,
        })
    });
    felt.collect()
}

/// The texture met at a moment, if any.
type What = fn(&Moment) -> Option<Met>;
/// An error of the met texture relative to the wanted one.
type Off = fn(Met, Met) -> f64;

/// Moments at which the session renders nothing are evaluated for neither.
const HELD: What = |moment| moment.rendered.map(|_| moment.held);
const SESSION: What = |moment| moment.rendered;
const DEGREES: Off = |is, wanted| is.angle_deg - wanted.angle_deg;
const BUMPS: Off = |is, wanted| 100.0 * (is.bumps_hz / wanted.bumps_hz - 1.0);
const ROUGH: Off = |is, wanted| 100.0 * (is.roughness / wanted.roughness - 1.0);

/// Strokes under a name.
struct Row<'a> {
    name: String,
    felt: Vec<&'a Felt>,
}

impl<'a> Row<'a> {
    fn of(name: String, felt: &'a [Felt], keep: impl Fn(&Felt) -> bool) -> Self {
        Self {
            name,
            felt: felt.iter().filter(|f| keep(f)).collect(),
        }
    }

    fn moments(&self) -> impl Iterator<Item = &Moment> {
        self.felt.iter().flat_map(|f| &f.moments)
    }

    /// Median and 90th percentile of an error over all moments.
    fn off(&self, met: What, off: Off) -> String {
        let off = self
            .moments()
            .filter_map(|m| Some(off(met(m)?, m.wanted).abs()));
        pair(off.filter(|off| off.is_finite()), 0)
    }

    /// The same for roughness summed over a stroke, relative to the wanted sum over the same moments.
    fn whole(&self, met: What) -> String {
        let off = self.felt.iter().filter_map(|felt| {
            let both = felt.moments.iter();
            let both = both.filter_map(|m| Some((met(m)?.roughness, m.wanted.roughness)));
            let (is, wanted) = both.fold((0.0, 0.0), |sum, (a, b)| (sum.0 + a, sum.1 + b));
            (wanted > 0.0).then(|| 100.0 * (is / wanted - 1.0).abs())
        });
        pair(off, 0)
    }
}

/// Median and 90th percentile.
fn pair(values: impl Iterator<Item = f64>, decimals: usize) -> String {
    let [median, most] = quantiles(values, [0.5, 0.9]);
    format!("{median:.decimals$} / {most:.decimals$}")
}

/// Strokes by path and by speed.
pub fn table(felt: &[Felt]) -> MarkdownTable {
    let paths = StrokePath::ALL.into_iter();
    let mut rows: Vec<Row<'_>> = paths
        .map(|path| Row::of(path.name().to_owned(), felt, |f| f.path == path))
        .collect();
    for (range, speeds) in SPEEDS_M_PER_S.into_iter().enumerate() {
        let [low, high] = speeds.map(|speed| 1e3 * speed);
        for (name, curved) in [("straight", false), ("curved", true)] {
            let name = format!("{name}, {low:.0} to {high:.0} mm/s");
            rows.push(Row::of(name, felt, |f| {
                f.range == range && f.path.is_curved() == Some(curved)
            }));
        }
    }
    let columns: [Column<'_, Row<'_>>; 12] = [
        ("stroke", &|row| row.name.clone()),
        ("strokes", &|row| row.felt.len().to_string()),
        ("finger, mm/s", &|row| {
            pair(row.moments().map(|m| 1e3 * m.finger_m_per_s), 0)
        }),
        ("turns, rad/s", &|row| {
            pair(row.moments().map(|m| m.turns_rad_per_s), 1)
        }),
        ("board moves, % of the time", &|row| {
            let moves = row.moments().filter(|m| m.board_moves).count();
            percent_of(moves, row.moments().count(), 0, "none")
        }),
        ("angle off, degrees, held", &|row| row.off(HELD, DEGREES)),
        ("session", &|row| row.off(SESSION, DEGREES)),
        ("bumps per s off, %, held", &|row| row.off(HELD, BUMPS)),
        ("session", &|row| row.off(SESSION, BUMPS)),
        ("roughness off, %, held", &|row| row.off(HELD, ROUGH)),
        ("session", &|row| row.off(SESSION, ROUGH)),
        ("of a whole stroke, %, held, session", &|row| {
            format!("{}, {}", row.whole(HELD), row.whole(SESSION))
        }),
    ];
    table_of(rows, &columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board that only turns has errors of 24 and 31 degrees on these.
    #[test]
    fn strokes_meet_the_bumps_at_the_angle_of_the_level() {
        let felt = run(1, 6).unwrap();
        for (path, most_deg) in [(StrokePath::OneWay, 12.0), (StrokePath::Circle, 18.0)] {
            let own = felt.iter().filter(|f| f.path == path);
            let moments = own.flat_map(|f| &f.moments);
            let off =
                moments.filter_map(|m| Some((m.rendered?.angle_deg - m.wanted.angle_deg).abs()));
            let [median_deg] = quantiles(off.filter(|off| off.is_finite()), [0.5]);
            assert!(median_deg < most_deg, "{}: {median_deg}", path.name());
        }
        let table = table(&felt).to_string();
        assert_eq!(table.lines().count(), 2 + StrokePath::ALL.len() + 6);
        assert!(!table.contains("NaN"), "{table}");
    }
}

//! One push at one object in several control modes: pushes, a figure, a table.

use super::push::{Hand, Profile, Push, Sample, Trace, run};
use super::rig::{Rig, Way};
use super::subject::{Subject, of_scene};
use clap::ValueEnum;
use hwall_haptics::{ObjectPath, ObjectRenderingConfig};
use hwall_sim::HandBodyConfig;
use hwall_stage::figures::{COLOURS, Sign, legend_beside, width_of};
use hwall_stage::report::figure::{Axes, Plot, figure};
use hwall_stage::setting::load_scene;
use hwall_testkit::{MarkdownTable, Timing, titled};
use plotters::prelude::*;
use std::path::Path;

/// Who pushes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum HandKind {
    /// A force that is given.
    Profile,
    /// A mass that aims behind the face.
    Body,
}

/// A push that is simulated in several control modes.
#[derive(Debug, Clone, Copy)]
pub struct SinglePush {
    /// The pushing hand.
    pub hand: HandKind,
    /// Peak force, N.
    pub force_n: f64,
    /// Duration, s; the hand pushes for the first third.
    pub seconds: f64,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

impl SinglePush {
    /// Runs the push in each mode; returns the results with the mode's name.
    ///
    /// # Errors
    /// Settings outside their ranges; a simulation that fails.
    pub fn run(
        &self,
        rig: &Rig,
        subject: &Subject,
        ways: &[Way],
    ) -> anyhow::Result<Vec<(String, Trace)>> {
        let made = |&way: &Way| {
            let push = Push {
                way,
                hand: self.hand(),
                seconds: self.seconds,
                seed: self.seed,
                config: ObjectRenderingConfig::default(),
            };
            Ok((way.name(), run(rig, subject, &push)?))
        };
        ways.iter().map(made).collect()
    }

    fn hand(&self) -> Hand {
        let until_s = self.seconds / 3.0;
        match self.hand {
            HandKind::Profile => Hand::Profile(Profile::held(self.force_n, until_s)),
            HandKind::Body => Hand::Body {
                config: HandBodyConfig::default(),
                depth_m: self.force_n / HandBodyConfig::default().arm_stiffness_n_per_m + 0.1,
                rise_s: 0.5 * until_s,
                until_s,
            },
        }
    }
}

/// A force of 10 N for a second at the door of the built-in room, in all control modes, as a figure.
///
/// # Errors
/// A file that cannot be written.
pub fn draw_door(path: &Path, seed: u64) -> anyhow::Result<()> {
    let rig = Rig::new()?;
    let (scene, _) = load_scene(None)?;
    let subject = of_scene(&rig, &scene, None)?;
    let push = SinglePush {
        hand: HandKind::Profile,
        force_n: 10.0,
        seconds: 3.0,
        seed,
    };
    draw(path, &subject, &push.run(&rig, &subject, &Way::ALL)?)
}

/// Draws the pushes, and summarises them as text.
///
/// # Errors
/// A file that cannot be written.
pub fn report(path: &Path, subject: &Subject, lines: &[(String, Trace)]) -> anyhow::Result<String> {
    draw(path, subject, lines)?;
    let place_m = subject.face.position_m();
    Ok(format!(
        "{}, pushed at ({:.2}, {:.2}, {:.2}) m; positions in mrad or mm\n\n{}\nwrote {}",
        subject.name,
        place_m.x,
        place_m.y,
        place_m.z,
        table(lines),
        path.display()
    ))
}

fn table(lines: &[(String, Trace)]) -> MarkdownTable {
    let mut table = titled(
        "arm, way | peak force, N | opened | ideal | largest difference | rms | given, J | returned, J | largest joint torque, N m \
         | inertia as rendered | held back, steps | step p50, us | p99, us",
    );
    for (name, trace) in lines {
        let all = &trace.samples;
        let most = |f: &dyn Fn(&Sample) -> f64| all.iter().map(f).fold(0.0, f64::max);
        let off = |s: &Sample| 1e3 * (s.position - s.ideal).abs();
        let squares: f64 = all.iter().map(|s| off(s).powi(2)).sum();
        let gained = |sign: f64| -> f64 {
            let steps = all.windows(2).map(|p| p[1].given_j - p[0].given_j);
            steps.map(|step_j| (sign * step_j).max(0.0)).sum()
        };
        let timing = Timing::from_samples_ns(trace.step_ns.clone());
        table.row([
            name.clone(),
            format!("{:.1}", most(&|s| s.force_n)),
            format!("{:.1}", 1e3 * most(&|s| s.position.abs())),
            format!("{:.1}", 1e3 * most(&|s| s.ideal.abs())),
            format!("{:.2}", most(&off)),
            format!("{:.2}", (squares / all.len() as f64).sqrt()),
            format!("{:.3}", gained(1.0)),
            format!("{:.3}", gained(-1.0)),
            format!("{:.1}", most(&|s| s.torque_n_m)),
            format!("{:.2}", trace.inertia),
            trace.unreachable.to_string(),
            format!("{:.1}", 1e-3 * timing.median_ns),
            format!("{:.1}", 1e-3 * timing.p99_ns),
        ]);
    }
    table
}

/// Widths of the axes and of the legend beside them, pixels.
const WIDTH: u32 = 860;
const BESIDE: u32 = 190;

/// Force, position and energy over time, for all control modes and the ideal object.
///
/// # Errors
/// A file that cannot be written.
fn draw(path: &Path, subject: &Subject, lines: &[(String, Trace)]) -> anyhow::Result<()> {
    let (scale, unit) = match subject.object.path {
        ObjectPath::Turning { .. } => (180.0 / std::f64::consts::PI, "opening, degrees"),
        ObjectPath::Sliding { .. } => (1e3, "opening, mm"),
    };
    type Value<'a> = &'a dyn Fn(&Sample) -> f64;
    let rows: [(&str, &str, Value<'_>, Option<Value<'_>>); 3] = [
        ("Force of the hand", "force, N", &|s| s.force_n, None),
        (
            "Opening: rendered, and that of the ideal object under the same force",
            unit,
            &|s| scale * s.position,
            Some(&|s| scale * s.ideal),
        ),
        (
            "Energy given to the board, less what came back",
            "energy, J",
            &|s| s.given_j,
            Some(&|s| s.ideal_given_j),
        ),
    ];
    let samples = || lines.iter().flat_map(|(_, trace)| &trace.samples);
    let most_s = samples().map(|s| s.t_s).fold(0.0, f64::max);
    figure(path, (WIDTH + BESIDE, 1000), |root| {
        for (area, (title, unit, value, ideal)) in root.split_evenly((3, 1)).iter().zip(rows) {
            let all = || samples().flat_map(|s| [Some(value(s)), ideal.map(|f| f(s))]);
            let (low, high) = all()
                .flatten()
                .fold((0.0, 1e-6), |(l, h), v| (f64::min(l, v), f64::max(h, v)));
            let room = 0.08 * (high - low);
            let axes = Axes {
                title,
                names: ["time, s", unit],
                labels: [70, 46],
                margin: 12,
                beside: BESIDE,
                ..Axes::default()
            };
            let mut chart = axes.on(area, 0.0..most_s, low - room..high + room)?;
            let mut keys = Vec::new();
            for (place, ((name, trace), colour)) in (0..).zip(lines.iter().zip(COLOURS)) {
                let line = trace.samples.iter().step_by(5).map(|s| (s.t_s, value(s)));
                let width = width_of(place, lines.len());
                chart.line(line, colour.stroke_width(width))?;
                keys.push((Sign::Line(width), colour, name.as_str()));
            }
            if let (Some(ideal), Some((_, trace))) = (ideal, lines.first()) {
                let shown = trace.samples.iter().step_by(60);
                chart.series(
                    shown.map(|s| Circle::new((s.t_s, ideal(s)), 3, BLACK.stroke_width(1))),
                )?;
                keys.push((Sign::Ring, BLACK, "ideal object"));
            }
            legend_beside(area, (WIDTH as i32, 50), keys)?;
        }
        Ok(())
    })
}

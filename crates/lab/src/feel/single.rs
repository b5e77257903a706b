//! One push at one object in several ways: pushes, a figure, a table.

use super::figures;
use super::push::{Hand, Profile, Push, Trace, run};
use super::rig::{Rig, Way};
use super::subject::Subject;
use clap::ValueEnum;
use hwall_haptics::ObjectRenderingConfig;
use hwall_sim::HandBodyConfig;
use hwall_testkit::{MarkdownTable, Timing};
use std::path::Path;

/// Who pushes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum HandKind {
    /// A force that is given.
    Profile,
    /// A mass that aims behind the face.
    Body,
}

/// A push that is made in several ways.
#[derive(Debug, Clone, Copy)]
pub struct SinglePush {
    /// Who pushes.
    pub hand: HandKind,
    /// Peak force, N.
    pub force_n: f64,
    /// Length, s; the hand pushes for the first third.
    pub seconds: f64,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

impl SinglePush {
    /// The push in each way, with the way's name.
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
            HandKind::Profile => Hand::Profile(Profile {
                mean_n: self.force_n,
                sines: Vec::new(),
                until_s,
            }),
            HandKind::Body => Hand::Body {
                config: HandBodyConfig::default(),
                depth_m: self.force_n / HandBodyConfig::default().arm_stiffness_n_per_m + 0.1,
                rise_s: 0.5 * until_s,
                until_s,
            },
        }
    }
}

/// Draws the pushes, and says in words what came of them.
///
/// # Errors
/// A file that cannot be written.
pub fn report(path: &Path, subject: &Subject, lines: &[(String, Trace)]) -> anyhow::Result<String> {
    figures::push(path, subject, lines)?;
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
    let mut table = MarkdownTable::new([
        "arm, way",
        "peak force, N",
        "opened",
        "ideal",
        "largest difference",
        "rms",
        "given, J",
        "returned, J",
        "largest joint torque, N m",
        "inertia as rendered",
        "held back, steps",
        "step p50, us",
        "p99, us",
    ]);
    for (name, trace) in lines {
        let most = |f: &dyn Fn(usize) -> f64| (0..trace.samples.len()).map(f).fold(0.0, f64::max);
        let s = &trace.samples;
        let off = |i: usize| 1e3 * (s[i].position - s[i].ideal).abs();
        let squares: f64 = (0..s.len()).map(|i| off(i).powi(2)).sum();
        let gained = |sign: f64| -> f64 {
            s.windows(2)
                .map(|p| (sign * (p[1].given_j - p[0].given_j)).max(0.0))
                .sum()
        };
        let timing = Timing::from_samples_ns(trace.step_ns.clone());
        table.row([
            name.clone(),
            format!("{:.1}", most(&|i| s[i].force_n)),
            format!("{:.1}", 1e3 * most(&|i| s[i].position.abs())),
            format!("{:.1}", 1e3 * most(&|i| s[i].ideal.abs())),
            format!("{:.2}", most(&off)),
            format!("{:.2}", (squares / s.len() as f64).sqrt()),
            format!("{:.3}", gained(1.0)),
            format!("{:.3}", gained(-1.0)),
            format!("{:.1}", most(&|i| s[i].torque_n_m)),
            format!("{:.2}", trace.inertia),
            trace.unreachable.0.to_string(),
            format!("{:.1}", 1e-3 * timing.median_ns),
            format!("{:.1}", 1e-3 * timing.p99_ns),
        ]);
    }
    table
}

//! Units of a recording, given by flags.

use crate::input::numbers::positive;
use anyhow::bail;
use clap::ValueEnum;
use hwall_hand::Recording;

/// Unit of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum TimeUnit {
    /// Seconds
    #[default]
    S,
    /// Milliseconds
    Ms,
    /// Microseconds
    Us,
    /// Nanoseconds
    Ns,
}

impl TimeUnit {
    /// Each with its length, s, its name and its flag.
    const ALL: [(Self, f64, &str, &str); 4] = [
        (Self::S, 1.0, "seconds", "s"),
        (Self::Ms, 1e-3, "milliseconds", "ms"),
        (Self::Us, 1e-6, "microseconds", "us"),
        (Self::Ns, 1e-9, "nanoseconds", "ns"),
    ];

    const fn seconds(self) -> f64 {
        Self::ALL[self as usize].1
    }
}

/// Units of a recording, as flags of a command line.
#[derive(Debug, Clone, Copy, PartialEq, clap::Args)]
pub struct RecordingUnits {
    /// Metres in a unit of the recording's positions: 0.01 for centimetres, 0.001 for millimetres
    #[arg(long, requires = "recorded", default_value_t = 1.0, value_parser = positive, value_name = "METRES", allow_negative_numbers = true)]
    pub hand_scale: f64,
    /// Unit of the recording's times
    #[arg(long, requires = "recorded", value_enum, default_value_t)]
    pub time_unit: TimeUnit,
}

impl RecordingUnits {
    /// Metres and seconds.
    pub const SI: Self = Self {
        hand_scale: 1.0,
        time_unit: TimeUnit::S,
    };

    /// Brings a recording to metres and seconds.
    ///
    /// # Errors
    /// A recording that cannot be a person's in these units; the error suggests likely units.
    pub fn apply(self, recording: &mut Recording) -> anyhow::Result<()> {
        recording.scale(self.hand_scale, self.time_unit.seconds());
        let Some(hint) = recording.unit_hint() else {
            return Ok(());
        };
        let mut hints = Vec::new();
        if let Some(metres) = hint.metres {
            let unit = if metres < 0.005 {
                "millimetres"
            } else {
                "centimetres"
            };
            hints.push(format!(
                "looks like {unit}: --hand-scale {}",
                self.hand_scale * metres
            ));
        }
        let wanted = hint
            .seconds
            .map(|seconds| seconds * self.time_unit.seconds());
        for (_, seconds, name, flag) in TimeUnit::ALL {
            if wanted.is_some_and(|wanted| (seconds / wanted - 1.0).abs() < 0.1) {
                hints.push(format!("looks like {name}: --time-unit {flag}"));
            }
        }
        bail!(
            "no person's hand in metres and seconds: {}",
            hints.join("; ")
        );
    }
}

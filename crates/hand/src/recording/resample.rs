//! Resampling of recordings at regular times.

use super::in_memory::{Quantity, Recording, Sample};
use crate::error::HandError;
use crate::frame::HandFrame;
use glam::DVec3;
use hwall_numeric::check::{positive, that};

/// Largest number of samples in total, and per recorded sample: beyond both, the period or a time stamp is probably in the wrong unit, and memory
/// would run out.
const MOST_SAMPLES: f64 = 1e6;
const MOST_FOR_EACH: f64 = 100.0;

impl Recording {
    /// The same motion at regular times from the first sample on, `period_s` apart.
    ///
    /// Each quantity is interpolated linearly between the neighbouring samples that have it, and gaze directions are normalised again; `contact` is
    /// that of the previous sample. If the neighbouring samples are further apart than `longest_gap_s`, the quantity stays missing: nothing is
    /// extrapolated over a dropout, before the first or after the last sample that has it.
    ///
    /// Error of linear interpolation: at most `a h² / 8` for an acceleration `a` and samples `h` apart: 0.5 mm at 10 m/s² and 20 ms.
    ///
    /// # Errors
    /// See [`Recording::validate`]; a period or a gap that is not finite and positive, more than 1e6 samples and more than 100 per recorded sample.
    pub fn resampled(&self, period_s: f64, longest_gap_s: f64) -> Result<Self, HandError> {
        self.validate()?;
        positive("period", period_s)?;
        positive("longest gap", longest_gap_s)?;
        let steps = self.duration_s() / period_s;
        that(
            steps <= MOST_SAMPLES.max(MOST_FOR_EACH * self.samples.len() as f64),
            "period",
            period_s,
            "long enough for at most 1e6 samples, or 100 for each recorded one",
        )?;
        let start_s = self.samples[0].frame.t_s;
        // Includes a last step that passes the end only by rounding.
        let count = (steps + 1e-9).floor() as usize + 1;
        let mut samples: Vec<Sample> = (0..count)
            .map(|k| Sample {
                frame: HandFrame::empty(start_s + k as f64 * period_s),
                ..Sample::default()
            })
            .collect();
        for quantity in Quantity::ALL {
            self.fill(quantity, longest_gap_s, &mut samples);
        }
        let mut before = 0;
        for sample in &mut samples {
            while before + 1 < self.samples.len()
                && self.samples[before + 1].frame.t_s <= sample.frame.t_s
            {
                before += 1;
            }
            sample.contact = self.samples[before].contact;
        }
        Ok(Self {
            samples,
            ..self.clone()
        })
    }

    pub(super) fn fill(&self, quantity: Quantity, longest_gap_s: f64, out: &mut [Sample]) {
        let known: Vec<(f64, DVec3)> = self
            .samples
            .iter()
            .filter_map(|s| Some((s.frame.t_s, s.get(quantity)?)))
            .collect();
        let mut next = 0;
        for sample in out {
            let t_s = sample.frame.t_s;
            while next < known.len() && known[next].0 < t_s {
                next += 1;
            }
            let value = match (next.checked_sub(1).map(|b| known[b]), known.get(next)) {
                (_, Some(&(at, value))) if at == t_s => Some(value),
                (Some((before, a)), Some(&(after, b))) if after - before <= longest_gap_s => {
                    Some(a.lerp(b, (t_s - before) / (after - before)))
                }
                // Repeat the last one if the resampled times end a rounding error after it.
                (Some((before, a)), None) if t_s - before <= 1e-9 * longest_gap_s => Some(a),
                _ => None,
            };
            let value = match quantity {
                Quantity::Gaze => value.and_then(DVec3::try_normalize),
                _ => value,
            };
            sample.set(quantity, value);
        }
    }
}

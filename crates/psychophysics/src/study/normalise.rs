//! Magnitude estimates of all subjects on one scale.

use super::complete::Study;
use crate::error::{PsychophysicsError, Result};

/// Scaling of the subjects' answers to a common mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Normalisation {
    /// Values stay as they are.
    #[default]
    None,
    /// Each answer is divided by the subject's arithmetic mean and multiplied by the arithmetic mean of all answers.
    Arithmetic,
    /// Each answer is divided by the subject's geometric mean and multiplied by the geometric mean of all answers.
    Geometric,
}

impl Study {
    /// The study with the answers of every subject scaled to the same mean.
    ///
    /// In magnitude estimation subjects choose their own scales; only ratios within a subject are
    /// meaningful. `y' = y m / m_s`, with `m_s` the mean of subject s over all its cells and `m` the mean
    /// over all subjects, both arithmetic or both geometric. The geometric variant averages logarithms,
    /// because Stevens' law is linear in them. Rounds are averaged arithmetically beforehand.
    ///
    /// Source: the dissertation, V.D.5 (its text, read literally, divides a mean by itself). Gescheider 1997,
    /// ch. 11, has both variants.
    ///
    /// # Errors
    /// A negative answer; for the geometric mean also a zero; for the arithmetic mean a subject whose
    /// answers are all zero; results outside the range of [`Study::from_values`].
    pub fn normalise(&self, how: Normalisation) -> Result<Self> {
        if how == Normalisation::None {
            return Ok(self.clone());
        }
        let geometric = how == Normalisation::Geometric;
        self.check_ratios(geometric)?;
        let log_or_value = |v: &f64| if geometric { v.ln() } else { *v };
        let count = self.values().len() as f64;
        let all = self.values().iter().map(log_or_value).sum::<f64>() / count;
        let mut values = Vec::with_capacity(self.values().len());
        for (row, subject) in self.rows().zip(self.subjects()) {
            let own = row.iter().map(log_or_value).sum::<f64>() / row.len() as f64;
            let scale = if geometric {
                (all - own).exp()
            } else {
                all / own
            };
            if !scale.is_finite() {
                return Err(PsychophysicsError::SubjectMean {
                    subject: subject.clone(),
                    mean: own,
                });
            }
            values.extend(row.iter().map(|v| v * scale));
        }
        let scaled = self.with_values(values);
        scaled.check_scale()?;
        Ok(scaled)
    }

    /// Refuses answers that are not magnitudes.
    fn check_ratios(&self, without_zero: bool) -> Result<()> {
        let cells = self.cells();
        for (at, (&mean, least)) in self.values().iter().zip(&self.least).enumerate() {
            let wanted = if without_zero && mean == 0.0 {
                "above zero"
            } else if least.value < 0.0 {
                "zero or above"
            } else {
                continue;
            };
            return Err(PsychophysicsError::NotPositive {
                line: least.line,
                subject: self.subjects()[at / cells].clone(),
                cell: self.cell_name(at % cells),
                value: least.value,
                wanted,
            });
        }
        Ok(())
    }
}

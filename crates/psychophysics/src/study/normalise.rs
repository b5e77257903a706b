//! Magnitude estimates of different subjects on one scale.

use crate::{PsychophysicsError, Study};

/// How the scales of the subjects are brought together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Normalisation {
    /// Values stay as they are.
    #[default]
    None,
    /// Divided by the subject's arithmetic mean, times the arithmetic mean of all.
    Arithmetic,
    /// Divided by the subject's geometric mean, times the geometric mean of all.
    Geometric,
}

impl Study {
    /// The study with every subject's estimates scaled to the same mean.
    ///
    /// In magnitude estimation everybody chooses a scale of their own; only ratios within a subject
    /// mean something. `y' = y m / m_s`: `m_s` the mean of subject s over all its cells, `m` the
    /// mean over all subjects, both arithmetic or both geometric. The geometric variant leaves
    /// ratios between cells to the logarithm that Stevens' law asks for. Rounds were averaged
    /// arithmetically before.
    ///
    /// Source: the dissertation, V.D.5. Read literally, its text divides a mean by itself, which
    /// changes nothing; this is what it means. Gescheider 1997, ch. 11, has both variants.
    ///
    /// # Errors
    /// A negative trial; for the geometric mean also a zero; for the arithmetic mean a subject whose
    /// estimates are all zero; results outside the range that a study holds.
    pub fn normalise(&self, how: Normalisation) -> Result<Self, PsychophysicsError> {
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

    /// Refuses estimates that are no magnitudes.
    pub(crate) fn check_ratios(&self, without_zero: bool) -> Result<(), PsychophysicsError> {
        let cells = self.cells();
        for (at, (&mean, least)) in self.values().iter().zip(self.least()).enumerate() {
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

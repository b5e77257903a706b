//! The combination of the sources in files of learned models.

use crate::error::ContactError;
use crate::learned::blend::combination::Blend;
use hwall_numeric::check::{non_negative, positive, that};

impl Blend {
    /// Moments and variances must not be negative.
    pub(super) fn validate(&self) -> Result<(), ContactError> {
        for region in &self.regions {
            for (what, value) in [
                ("size of a region", region.size_m2),
                ("spread of a region", region.spread),
                ("time of a region", region.time_s2),
            ] {
                positive(what, value)?;
            }
            for (source, moments) in region.moments.iter().enumerate() {
                non_negative("moment of an error", moments[source])?;
            }
            for axis in 0..3 {
                non_negative("variance of an error", region.shape.col(axis)[axis])?;
            }
        }
        for factor in self.factors {
            positive("factor at a time left", factor)?;
        }
        for typical in self.typical_distances {
            positive("typical distance", typical)?;
        }
        self.validate_personal()?;
        for pair in self.arrival.keys.windows(2) {
            non_negative("step between speeds", pair[1] - pair[0])?;
        }
        for share in &self.arrival.shares {
            let ok = (0.0..=1.0).contains(share);
            that(ok, "share of the way", *share, "0 to 1")?;
        }
        for way_m in &self.arrival.ways_m {
            non_negative("way of a slow hand", *way_m)?;
        }
        Ok(())
    }

    fn validate_personal(&self) -> Result<(), ContactError> {
        let sources = self.personal.sources.as_flattened();
        for share in sources.iter().chain(&self.personal.time) {
            let ok = (0.0..1.0).contains(share);
            that(ok, "share that is a person's own", *share, "0 to below 1")?;
        }
        for habits in &self.personal.habits {
            positive("scatter of the way left", habits.scatter_m)?;
            non_negative("variance of the offsets of people", habits.offset)?;
            non_negative("variance of the slopes of people", habits.slope)?;
        }
        Ok(())
    }
}

//! The combination of the sources in files of learned models.

use super::length;
use crate::error::ContactError;
use crate::learned::blend::arrival::Arrival;
use crate::learned::blend::combination::{Axes, Blend, Personal, Region};
use crate::learned::blend::habit::Habits;
use crate::learned::blend::knots::KNOTS;
use crate::learned::blend::sources::SOURCES;
use hwall_numeric::check::{non_negative, positive, that};
use serde::{Deserialize, Serialize};

/// First version whose files contain habits.
const WITH_HABITS: u64 = 7;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileBlend {
    axes: Axes,
    regions: Vec<Region>,
    by_disagreement: f64,
    knots: [f64; KNOTS],
    factors: [f64; KNOTS],
    usual_distances: [f64; KNOTS],
    /// One value for all times left, in files older than version 6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    personal: Option<[f64; SOURCES]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    own: Option<FilePersonal>,
    /// Keys of speeds, shares at them, and displacements, m; absent if there was too little data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    arrival: Option<[[f64; 6]; 3]>,
}

/// Between-person shares, at the knots of the time left.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilePersonal {
    sources: [[f64; SOURCES]; KNOTS],
    time: [f64; KNOTS],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    habits: Option<[Habits; KNOTS]>,
    /// From version 6, whose habits only scaled the displacement; no longer used.
    #[serde(default, skip_serializing)]
    stretch: Option<[f64; KNOTS]>,
}

impl FileBlend {
    pub(super) fn of(blend: &Blend) -> Self {
        let Arrival {
            keys,
            shares,
            ways_m,
        } = blend.arrival;
        Self {
            axes: blend.axes,
            regions: blend.regions.clone(),
            by_disagreement: blend.by_disagreement,
            knots: blend.knots,
            factors: blend.factors,
            usual_distances: blend.usual_distances,
            personal: None,
            own: Some(FilePersonal {
                sources: blend.personal.sources,
                time: blend.personal.time,
                habits: Some(blend.personal.habits),
                stretch: None,
            }),
            arrival: (blend.arrival != Arrival::NONE).then_some([keys, shares, ways_m]),
        }
    }

    pub(super) fn regions(&self) -> usize {
        self.regions.len()
    }

    /// Checks a file of this version. Moments and variances must not be negative.
    pub(super) fn validate(&self, version: u64) -> Result<(), ContactError> {
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
        for usual in self.usual_distances {
            positive("usual distance", usual)?;
        }
        self.validate_personal(version)?;
        let Some([keys, shares, ways_m]) = &self.arrival else {
            return Ok(());
        };
        for pair in keys.windows(2) {
            non_negative("step between speeds", pair[1] - pair[0])?;
        }
        for share in shares {
            let ok = (0.0..=1.0).contains(share);
            that(ok, "share of the way", *share, "0 to 1")?;
        }
        for way_m in ways_m {
            non_negative("way of a slow hand", *way_m)?;
        }
        Ok(())
    }

    fn validate_personal(&self, version: u64) -> Result<(), ContactError> {
        let own = self.own.as_ref();
        let sources = own.map(|own| own.sources.as_flattened());
        let shares = sources.or(self.personal.as_ref().map(|shares| &shares[..]));
        length("what is a person's own", 1, usize::from(shares.is_some()))?;
        let times = own.map(|own| &own.time[..]);
        for share in shares.into_iter().chain(times).flatten() {
            let ok = (0.0..1.0).contains(share);
            that(ok, "share that is a person's own", *share, "0 to below 1")?;
        }
        for variance in own.and_then(|own| own.stretch).iter().flatten() {
            non_negative("variance of the stretch", *variance)?;
        }
        let habits = own.and_then(|own| own.habits);
        if version >= WITH_HABITS {
            length("habits of people", 1, usize::from(habits.is_some()))?;
        }
        for habits in habits.iter().flatten() {
            positive("scatter of the way left", habits.scatter_m)?;
            non_negative("variance of the offsets of people", habits.offset)?;
            non_negative("variance of the slopes of people", habits.slope)?;
        }
        Ok(())
    }

    /// From a valid file.
    pub(super) fn into_blend(self) -> Blend {
        let arrival = self.arrival.map(|[keys, shares, ways_m]| Arrival {
            keys,
            shares,
            ways_m,
        });
        Blend {
            axes: self.axes,
            regions: self.regions,
            by_disagreement: self.by_disagreement,
            knots: self.knots,
            factors: self.factors,
            usual_distances: self.usual_distances,
            personal: match (self.own, self.personal) {
                (Some(own), _) => Personal {
                    sources: own.sources,
                    time: own.time,
                    habits: own.habits.unwrap_or([Habits::NONE; KNOTS]),
                },
                // Files older than version 6 did not adapt times and displacements.
                (None, sources) => Personal {
                    sources: [sources.unwrap_or_default(); KNOTS],
                    ..Personal::even(0.0)
                },
            },
            arrival: arrival.unwrap_or(Arrival::NONE),
        }
    }
}

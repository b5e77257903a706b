//! Maps as files: versioned, checksummed, the same bytes on every machine.
//!
//! Layout: a [`BinaryFormat`]. The body contains the arm, the solver's settings, the grids, and each line's intervals and bands, without rounding.

use super::grid::{WallGrid, checked_line_count};
use super::keep_out::KeepOut;
use super::reachability_map::ReachabilityMap;
use crate::binary_file::{BinaryFileError, BinaryFormat};
use crate::error::{ReachabilityError, Result};
use crate::line::{ExactConfig, Interval, LineReachability, ReachableInterval};
use hwall_kinematics::{BranchSet, SrsArm, SrsParameters};
use serde::{Deserialize, Serialize};
use std::path::Path;

const FORMAT: BinaryFormat = BinaryFormat {
    magic: *b"HWALLMAP",
    format: 1,
};

#[derive(Serialize, Deserialize)]
struct Body {
    arm: SrsParameters,
    config: ExactConfig,
    walls: Vec<WallGrid>,
    keep_out: Vec<KeepOut>,
    lines: Vec<StoredLine>,
}

#[derive(Serialize, Deserialize)]
struct StoredLine {
    intervals: Vec<(f64, f64, u8)>,
    unknown: Vec<(f64, f64)>,
}

impl ReachabilityMap {
    /// The map as bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let lines = self.lines().map(|index| {
            let intervals = self.intervals(index).iter();
            let unknown = self.unknown(index).iter();
            StoredLine {
                intervals: intervals
                    .map(|i| (i.span.lo_m, i.span.hi_m, i.branches.bits()))
                    .collect(),
                unknown: unknown.map(|band| (band.lo_m, band.hi_m)).collect(),
            }
        });
        let body = Body {
            arm: *self.arm().parameters(),
            config: self.config().clone(),
            walls: self.walls().cloned().collect(),
            keep_out: self.keep_out().to_vec(),
            lines: lines.collect(),
        };
        FORMAT.to_bytes(&body)
    }

    /// A map from bytes written by [`to_bytes`](Self::to_bytes).
    ///
    /// # Errors
    /// Foreign, newer, truncated, damaged or malformed bytes: each has its own variant of `BinaryFileError`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let malformed = |what| BinaryFileError::Malformed { what };
        let body: Body = FORMAT.from_bytes(bytes)?;
        if checked_line_count(&body.walls)? != body.lines.len() {
            return Err(malformed("count of lines").into());
        }
        let arm = SrsArm::new(body.arm)?;
        for keep_out in &body.keep_out {
            keep_out.carried.validate()?;
        }
        let lines = body.lines.into_iter().map(StoredLine::checked);
        let lines: Option<Vec<LineReachability>> = lines.collect();
        let lines = lines.ok_or(malformed("intervals"))?;
        Self::from_lines(&arm, &body.config, body.walls, &lines, body.keep_out)
    }

    /// Writes the map to a file.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        hwall_files::write(path, self.to_bytes())
            .map_err(|error| ReachabilityError::file(path, &error))
    }

    /// Reads a map from a file.
    ///
    /// # Errors
    /// A file that cannot be read, or as [`from_bytes`](Self::from_bytes).
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|error| ReachabilityError::file(path, &error))?;
        Self::from_bytes(&bytes)
    }

    /// One row for each interval, with a header; metres and radians.
    ///
    /// `wall`, `plane` and `height` count from 0; `branches` has a bit for each branch that holds
    /// the whole interval; ends are within the map's accuracy.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn write_csv(&self, mut out: impl std::io::Write) -> std::io::Result<()> {
        writeln!(
            out,
            "wall,plane,height,heading_rad,distance_m,height_m,s_lo_m,s_hi_m,branches"
        )?;
        for index in self.lines() {
            let Some(line) = self.line(index) else {
                continue;
            };
            for i in self.intervals(index) {
                writeln!(
                    out,
                    "{},{},{},{},{},{},{},{},{}",
                    index.wall,
                    index.plane,
                    index.height,
                    line.plane.heading_rad(),
                    line.plane.distance_m(),
                    line.height_m,
                    i.span.lo_m,
                    i.span.hi_m,
                    i.branches.bits()
                )?;
            }
        }
        out.flush()
    }
}

impl StoredLine {
    /// The line, if its intervals and bands are finite, sorted and disjoint.
    fn checked(self) -> Option<LineReachability> {
        let apart = |ends: &mut dyn Iterator<Item = (f64, f64)>| {
            let mut last = f64::NEG_INFINITY;
            for (lo, hi) in ends {
                if !(lo.is_finite() && hi.is_finite() && last < lo && lo <= hi) {
                    return false;
                }
                last = hi;
            }
            true
        };
        let sound = apart(&mut self.intervals.iter().map(|i| (i.0, i.1)))
            && apart(&mut self.unknown.iter().copied());
        let interval = |&(lo, hi, branches): &(f64, f64, u8)| ReachableInterval {
            span: Interval::new(lo, hi),
            branches: BranchSet::from_bits(branches),
        };
        let band = |&(lo, hi): &(f64, f64)| Interval::new(lo, hi);
        sound.then(|| LineReachability {
            intervals: self.intervals.iter().map(interval).collect(),
            unknown: self.unknown.iter().map(band).collect(),
        })
    }
}

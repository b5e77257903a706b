//! Maps as files: versioned, checksummed, the same bytes on every machine.
//!
//! Layout: 8 bytes `HWALLMAP`, format (u16), length of the body (u64), the body (postcard), CRC-32
//! of everything before it (u32); integers little-endian. The body holds the arm, the solver's
//! settings, the grids, and each line's intervals and bands as they are: nothing is rounded.

use super::grid::{WallGrid, checked_line_count};
use super::keep_out::KeepOut;
use super::reachability_map::ReachabilityMap;
use crate::error::ReachabilityError;
use crate::line::{ExactConfig, Interval, LineReachability, ReachableInterval};
use hwall_kinematics::{BranchSet, SrsArm, SrsParameters};
use serde::{Deserialize, Serialize};
use std::path::Path;

const MAGIC: &[u8; 8] = b"HWALLMAP";
const FORMAT: u16 = 1;
const HEADER: usize = 8 + 2 + 8;
const CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

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
        let lines = self.lines().map(|index| StoredLine {
            intervals: self
                .intervals(index)
                .iter()
                .map(|i| (i.span.lo_m, i.span.hi_m, i.branches.bits()))
                .collect(),
            unknown: self
                .unknown(index)
                .iter()
                .map(|band| (band.lo_m, band.hi_m))
                .collect(),
        });
        let body = Body {
            arm: *self.arm().parameters(),
            config: self.config().clone(),
            walls: self.walls().cloned().collect(),
            keep_out: self.keep_out().to_vec(),
            lines: lines.collect(),
        };
        // Plain numbers and lists of known length: postcard has no reason to refuse.
        let body = postcard::to_stdvec(&body).unwrap_or_default();
        let mut bytes = Vec::with_capacity(HEADER + body.len() + 4);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&FORMAT.to_le_bytes());
        bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&body);
        let checksum = CHECKSUM.checksum(&bytes);
        bytes.extend_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// A map from bytes that [`to_bytes`](Self::to_bytes) made.
    ///
    /// # Errors
    /// Foreign, newer, truncated, damaged or malformed bytes: each has its own variant.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReachabilityError> {
        let number = |at: usize, count: usize| {
            let mut value = [0; 8];
            value[..count].copy_from_slice(bytes.get(at..at + count)?);
            Some(u64::from_le_bytes(value))
        };
        if !bytes.starts_with(MAGIC) {
            return Err(ReachabilityError::ForeignFile);
        }
        let too_short = ReachabilityError::WrongFileLength {
            expected: (HEADER + 4) as u64,
            found: bytes.len() as u64,
        };
        let (Some(format), Some(length)) = (number(8, 2), number(10, 8)) else {
            return Err(too_short);
        };
        if format == 0 {
            return Err(ReachabilityError::MalformedFile { what: "format 0" });
        }
        if format > u64::from(FORMAT) {
            return Err(ReachabilityError::NewerFile {
                found: format as u16,
                known: FORMAT,
            });
        }
        let expected = length.saturating_add(HEADER as u64 + 4);
        if bytes.len() as u64 != expected {
            return Err(ReachabilityError::WrongFileLength {
                expected,
                found: bytes.len() as u64,
            });
        }
        let end = bytes.len() - 4;
        let stored = number(end, 4).ok_or(too_short)? as u32;
        let found = CHECKSUM.checksum(&bytes[..end]);
        if found != stored {
            return Err(ReachabilityError::DamagedFile {
                expected: stored,
                found,
            });
        }
        let malformed = |what| ReachabilityError::MalformedFile { what };
        let (body, rest) = postcard::take_from_bytes::<Body>(&bytes[HEADER..end])
            .map_err(|_| malformed("body"))?;
        if !rest.is_empty() {
            return Err(malformed("bytes behind the body"));
        }
        if checked_line_count(&body.walls)? != body.lines.len() {
            return Err(malformed("count of lines"));
        }
        let arm = SrsArm::new(body.arm)?;
        let lines = body.lines.into_iter().map(StoredLine::checked);
        let lines: Option<Vec<LineReachability>> = lines.collect();
        let lines = lines.ok_or(malformed("intervals"))?;
        Self::from_lines(&arm, &body.config, body.walls, &lines, body.keep_out)
    }

    /// Writes the map to a file.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ReachabilityError> {
        let path = path.as_ref();
        hwall_files::write(path, self.to_bytes())
            .map_err(|error| ReachabilityError::file(path, &error))
    }

    /// Reads a map from a file.
    ///
    /// # Errors
    /// A file that cannot be read, or as [`from_bytes`](Self::from_bytes).
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ReachabilityError> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|error| ReachabilityError::file(path, &error))?;
        Self::from_bytes(&bytes)
    }

    /// One row for each interval, with a header; metres and radians.
    ///
    /// `wall`, `plane` and `height` count from 0; `branches` has a bit for each branch that holds
    /// all of the interval; ends lie within the map's accuracy.
    ///
    /// # Errors
    /// Those of the writer.
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
    /// The line, if its intervals and bands are finite, sorted and apart.
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
        sound.then(|| LineReachability {
            intervals: self
                .intervals
                .iter()
                .map(|&(lo, hi, branches)| ReachableInterval {
                    span: Interval::new(lo, hi),
                    branches: BranchSet::from_bits(branches),
                })
                .collect(),
            unknown: self
                .unknown
                .iter()
                .map(|&(lo, hi)| Interval::new(lo, hi))
                .collect(),
        })
    }
}

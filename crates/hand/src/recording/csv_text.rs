//! Recordings as CSV.
//!
//! One header line, then one row per sample, in metres and seconds, as read by [`Table`]:
//! `person,trial,t,palm_x,palm_y,palm_z,thumb_x,...,little_z,head_x,...,gaze_x,...,object_x,...,target_x,...,contact`, optionally with `wrist`,
//! `forearm`, `elbow`, `shoulder`, `grip` and `aim` after the hand. Columns are found by name, in any order. Only `t` and one point of the hand
//! are required; an empty cell, `NaN`, `NA` or `N/A` is a missing value; other columns are ignored and listed. Rows of several trials may share a
//! file and even alternate: `person` and `trial` distinguish them.

use super::in_memory::{Quantity, Recording, Sample};
use crate::body_point::NamedPoint;
use crate::error::HandError;
use glam::DVec3;
use hwall_files::{Row, Table};
use std::collections::HashMap;
use std::io::{BufReader, Read, Write};
use std::path::Path;
use std::sync::Arc;

const AXES: [&str; 3] = ["x", "y", "z"];

/// A shorter gaze vector has no direction.
const MIN_GAZE_LENGTH: f64 = 1e-6;

/// A gaze vector whose length deviates from 1 by more than this is normalised; one that is nearer stays unchanged, so that a written file reads
/// back bit for bit.
const GAZE_LENGTH_TOLERANCE: f64 = 1e-9;

impl Recording {
    /// Reads a CSV that holds one trial.
    ///
    /// # Errors
    /// Any fault of the text, by line and column; several trials.
    pub fn from_csv(reader: impl Read) -> Result<Self, HandError> {
        let mut all = read_recordings(reader)?;
        match (all.pop(), all.len()) {
            (Some(only), 0) => Ok(only),
            (_, others) => Err(HandError::SeveralTrials { count: others + 1 }),
        }
    }

    /// Reads a CSV file that holds one trial.
    ///
    /// # Errors
    /// As [`Recording::from_csv`], and a file that cannot be opened.
    pub fn from_csv_path(path: impl AsRef<Path>) -> Result<Self, HandError> {
        let path = path.as_ref();
        let file = std::fs::File::open(path).map_err(|e| HandError::Io {
            path: path.display().to_string(),
            kind: e.kind(),
            message: e.to_string(),
        })?;
        Self::from_csv(file)
    }

    /// Writes this trial as CSV; see [`write_recordings`].
    ///
    /// # Errors
    /// As [`write_recordings`].
    pub fn to_csv(&self, writer: impl Write) -> Result<(), HandError> {
        write_recordings(writer, std::slice::from_ref(self))
    }
}

/// Reads all trials of a CSV, in the order in which they first appear. A point at exactly 0,0,0 between rows that show it elsewhere counts as
/// missing; [`Recording::zero_rows`] counts them.
///
/// # Errors
/// Any fault of the text, by line and column: see [`HandError`].
pub fn read_recordings(reader: impl Read) -> Result<Vec<Recording>, HandError> {
    let mut table = Table::new(BufReader::new(reader))?;
    let columns = Columns::from_header(table.header())?;

    let mut recordings: Vec<Recording> = Vec::new();
    let mut by_name: HashMap<(String, String), usize> = HashMap::new();
    let mut row = Row::default();
    while table.next_row(&mut row)? {
        if row.cells().all(str::is_empty) {
            continue;
        }
        let line = row.line();
        let name = |column: Option<usize>| column.map_or("", |i| row.cell(i)).to_owned();
        let key = (name(columns.person), name(columns.trial));
        let index = *by_name.entry(key).or_insert_with_key(|(person, trial)| {
            let some = |s: &String| (!s.is_empty()).then(|| s.clone());
            recordings.push(Recording {
                person: some(person),
                trial: some(trial),
                samples: Vec::new(),
                ignored_columns: Arc::clone(&columns.ignored),
                zero_rows: 0,
            });
            recordings.len() - 1
        });
        let samples = &mut recordings[index].samples;
        let sample = columns.sample(&row)?;
        if let Some(previous_s) = samples.last().map(|s| s.frame.t_s)
            && sample.frame.t_s <= previous_s
        {
            return Err(HandError::TimeNotIncreasing {
                line,
                t_s: sample.frame.t_s,
                previous_s,
            });
        }
        samples.push(sample);
    }
    if recordings.is_empty() {
        return Err(HandError::NoSamples);
    }
    recordings.iter_mut().for_each(Recording::without_zeros);
    Ok(recordings)
}

/// Writes trials as one CSV, with the columns of every quantity that any sample holds.
///
/// Numbers are written with enough digits to read back the same value.
///
/// # Errors
/// A recording that [`Recording::validate`] rejects or that holds no point of the hand;
/// a stream that cannot be written.
pub fn write_recordings(writer: impl Write, recordings: &[Recording]) -> Result<(), HandError> {
    for recording in recordings {
        recording.validate()?;
    }
    let samples = || recordings.iter().flat_map(|r| &r.samples);
    let held: Vec<Quantity> = Quantity::ALL
        .into_iter()
        .filter(|&q| samples().any(|s| s.get(q).is_some()))
        .collect();
    if !held.iter().any(|q| matches!(q, Quantity::Hand(_))) {
        return Err(HandError::NoHandColumns);
    }
    let person = recordings.iter().any(|r| r.person.is_some());
    let trial = recordings.iter().any(|r| r.trial.is_some());
    let contact = samples().any(|s| s.contact.is_some());

    let mut csv = csv::Writer::from_writer(writer);
    let mut row: Vec<String> = Vec::new();
    row.extend(person.then(|| "person".into()));
    row.extend(trial.then(|| "trial".into()));
    row.push("t".into());
    row.extend(
        held.iter()
            .flat_map(|q| AXES.map(|axis| column_name(*q, axis))),
    );
    row.extend(contact.then(|| "contact".into()));
    csv.write_record(&row).map_err(|e| csv_error(&e))?;

    for recording in recordings {
        for sample in &recording.samples {
            row.clear();
            row.extend(person.then(|| recording.person.clone().unwrap_or_default()));
            row.extend(trial.then(|| recording.trial.clone().unwrap_or_default()));
            row.push(sample.frame.t_s.to_string());
            for &quantity in &held {
                match sample.get(quantity) {
                    Some(v) => row.extend(v.to_array().map(|c| c.to_string())),
                    None => row.extend([const { String::new() }; 3]),
                }
            }
            row.extend(contact.then(|| {
                sample
                    .contact
                    .map_or("", |c| if c { "1" } else { "0" })
                    .into()
            }));
            csv.write_record(&row).map_err(|e| csv_error(&e))?;
        }
    }
    csv.flush().map_err(|e| io_error(&e))
}

/// Column indices of each quantity.
struct Columns {
    t: usize,
    person: Option<usize>,
    trial: Option<usize>,
    contact: Option<usize>,
    vectors: Vec<(Quantity, [usize; 3])>,
    ignored: Arc<[String]>,
}

impl Columns {
    fn from_header(header: &[String]) -> Result<Self, HandError> {
        let mut place: HashMap<&str, usize> = HashMap::new();
        for (i, name) in header.iter().enumerate() {
            if !name.is_empty() && place.insert(name, i).is_some() {
                return Err(HandError::DuplicateColumn {
                    column: name.into(),
                });
            }
        }
        let missing = |column: &str| HandError::MissingColumn {
            column: column.into(),
        };
        let t = place.remove("t").ok_or_else(|| missing("t"))?;
        let [person, trial, contact] =
            ["person", "trial", "contact"].map(|name| place.remove(name));
        let mut vectors = Vec::new();
        for quantity in Quantity::ALL {
            let named = |name: &&str| {
                AXES.iter()
                    .any(|a| place.contains_key(&*format!("{name}_{a}")))
            };
            let name = names(quantity).find(named).unwrap_or(quantity.name());
            let names = AXES.map(|axis| format!("{name}_{axis}"));
            // Older recordings may have other columns of such a name: ignore incomplete ones.
            let is_whole = names.iter().all(|n| place.contains_key(n.as_str()));
            if matches!(quantity, Quantity::Body(_)) && !is_whole {
                continue;
            }
            let found = [0, 1, 2].map(|i| place.remove(names[i].as_str()));
            match found {
                [Some(x), Some(y), Some(z)] => vectors.push((quantity, [x, y, z])),
                [None, None, None] => {}
                _ => {
                    let absent = found.iter().position(Option::is_none).unwrap_or(0);
                    return Err(missing(&names[absent]));
                }
            }
        }
        if !vectors.iter().any(|(q, _)| matches!(q, Quantity::Hand(_))) {
            return Err(HandError::NoHandColumns);
        }
        let ignored = header
            .iter()
            .filter(|name| place.contains_key(name.as_str()))
            .cloned()
            .collect();
        Ok(Self {
            t,
            person,
            trial,
            contact,
            vectors,
            ignored,
        })
    }

    fn sample(&self, row: &Row) -> Result<Sample, HandError> {
        let line = row.line();
        let mut sample = Sample::default();
        sample.frame.t_s =
            number(row, self.t, || "t".into())?.ok_or_else(|| HandError::MissingCell {
                line,
                column: "t".into(),
            })?;
        for &(quantity, places) in &self.vectors {
            let mut cells = [None; 3];
            for (axis, cell) in cells.iter_mut().enumerate() {
                *cell = number(row, places[axis], || column_name(quantity, AXES[axis]))?;
            }
            let value = match cells {
                [Some(x), Some(y), Some(z)] => DVec3::new(x, y, z),
                [None, None, None] => continue,
                _ => {
                    let axis = cells.iter().position(Option::is_none).unwrap_or(0);
                    let column = column_name(quantity, AXES[axis]);
                    return Err(HandError::MissingCell { line, column });
                }
            };
            let value = match quantity {
                // A zero gaze vector means that the eyes are not seen.
                Quantity::Gaze if value == DVec3::ZERO => continue,
                Quantity::Gaze => unit_gaze(value, line)?,
                _ => value,
            };
            sample.set(quantity, Some(value));
        }
        if let Some(place) = self.contact {
            sample.contact = number(row, place, || "contact".into())?.map(|c| c != 0.0);
        }
        Ok(sample)
    }
}

/// The names of a quantity in headers, its own first.
fn names(quantity: Quantity) -> impl Iterator<Item = &'static str> {
    let others = match quantity {
        Quantity::Hand(point) => NamedPoint::Hand(point).other_names(),
        Quantity::Body(point) => NamedPoint::Body(point).other_names(),
        _ => Vec::new(),
    };
    std::iter::once(quantity.name()).chain(others)
}

fn column_name(quantity: Quantity, axis: &str) -> String {
    format!("{}_{axis}", quantity.name())
}

/// A cell as a finite number; `None` if missing. The name is built only for an error.
fn number(row: &Row, place: usize, column: impl Fn() -> String) -> Result<Option<f64>, HandError> {
    let line = row.line();
    row.number(place).map_err(|text| match text.parse() {
        Ok(value) => HandError::NonFiniteCell {
            line,
            column: column(),
            value,
        },
        Err(_) => HandError::NotANumber {
            line,
            column: column(),
            text: text.chars().take(40).collect(),
        },
    })
}

fn unit_gaze(gaze: DVec3, line: u64) -> Result<DVec3, HandError> {
    let length = gaze.length();
    if length < MIN_GAZE_LENGTH || !length.is_finite() {
        return Err(HandError::ZeroGaze { line, length });
    }
    Ok(if (length - 1.0).abs() > GAZE_LENGTH_TOLERANCE {
        gaze / length
    } else {
        gaze
    })
}

fn io_error(error: &std::io::Error) -> HandError {
    HandError::Io {
        path: "(stream)".into(),
        kind: error.kind(),
        message: error.to_string(),
    }
}

fn csv_error(error: &csv::Error) -> HandError {
    match error.kind() {
        csv::ErrorKind::Io(error) => io_error(error),
        _ => HandError::Io {
            path: "(stream)".into(),
            kind: std::io::ErrorKind::InvalidData,
            message: error.to_string(),
        },
    }
}

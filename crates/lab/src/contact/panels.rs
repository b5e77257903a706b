//! Reaches to remembered objects in a room: a recording, and a table of end points and object boxes.

use anyhow::Context;
use glam::DVec3;
use hwall_files::{Row, Table};
use hwall_hand::{HandError, HandFrame, HandPoint, LabelledReach, Recording, read_recordings};
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// A reach in a room.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Name of the room.
    pub room: String,
    /// The person.
    pub person: String,
    /// The target object.
    pub object: String,
    /// Centre and size of its axis-aligned box, m.
    pub box_m: [DVec3; 2],
    /// All samples, from before the reach on.
    pub frames: Vec<HandFrame>,
    /// From `t = 0` to the end of the reach.
    pub reach: LabelledReach,
}

impl Trial {
    /// From the end of the reach to where the head is first seen, m.
    ///
    /// # Errors
    /// The head is never seen.
    pub fn towards_head_m(&self) -> Result<DVec3, HandError> {
        let head_m = self.frames.iter().find_map(|frame| frame.head_m);
        let head_m = head_m.ok_or_else(|| HandError::Reach {
            reach: self.reach.name(),
            what: "the head is never seen, which the panel faces",
        })?;
        Ok(head_m - self.reach.contact_m)
    }
}

/// Reads a recording and the table of its trials.
///
/// # Errors
/// A file that cannot be opened; as [`read`].
pub fn read_files(stream: &Path, trials: &Path) -> anyhow::Result<Vec<Trial>> {
    let open = |path: &Path| File::open(path).with_context(|| path.display().to_string());
    let recordings = read_recordings(open(stream)?);
    let recordings = recordings.with_context(|| stream.display().to_string())?;
    let table = BufReader::new(open(trials)?);
    read(recordings, table).with_context(|| trials.display().to_string())
}

/// Reads the trials of a table, with their samples from the recordings; ignores other recorded data.
///
/// The table has the columns `person,trial,scene,target`, the centre `cx,cy,cz` and size `sx,sy,sz` of the box of the target, m,
/// the duration `dur` of the reach, s, and its end `rx,ry,rz`, m.
///
/// # Errors
/// A missing column, a cell that is not a number, a trial without samples, a text that is not a table.
pub fn read(recordings: Vec<Recording>, trials: impl BufRead) -> Result<Vec<Trial>, HandError> {
    let mut table = Table::new(trials)?;
    let header = table.header().to_vec();
    let named = |r: Recording| {
        let frames = r.samples.iter().map(|s| s.frame).collect();
        let name = |name: Option<String>| name.unwrap_or_default();
        ((name(r.person), name(r.trial)), frames)
    };
    let recordings = recordings.into_iter().map(named);
    let mut recorded: HashMap<_, Vec<HandFrame>> = recordings.collect();
    let (mut found, mut row) = (Vec::new(), Row::default());
    while table.next_row(&mut row)? {
        let text = |name: &str| Ok::<_, HandError>(row.cell(place(&header, name)?).to_owned());
        let vector = |name: char| {
            let number = |axis| number(&header, &row, &format!("{name}{axis}"));
            Ok::<_, HandError>(DVec3::new(number('x')?, number('y')?, number('z')?))
        };
        let name = (text("person")?, text("trial")?);
        let contact_s = number(&header, &row, "dur")?;
        let frames = recorded.remove(&name).unwrap_or_default();
        let under_way = frames.iter().filter(|f| (0.0..=contact_s).contains(&f.t_s));
        let under_way = under_way.copied().collect();
        let reach = LabelledReach::new(HandPoint::Index, under_way, vector('r')?, contact_s);
        let reach = reach.by(&*name.0, name.1);
        reach.validate()?;
        found.push(Trial {
            room: text("scene")?,
            person: name.0,
            object: text("target")?,
            box_m: [vector('c')?, vector('s')?],
            frames,
            reach,
        });
    }
    Ok(found)
}

fn place(header: &[String], column: &str) -> Result<usize, HandError> {
    let place = header.iter().position(|name| name == column);
    place.ok_or_else(|| HandError::MissingColumn {
        column: column.to_owned(),
    })
}

fn number(header: &[String], row: &Row, column: &str) -> Result<f64, HandError> {
    let place = place(header, column)?;
    let number = row.number(place).ok().flatten();
    number.ok_or_else(|| HandError::NotANumber {
        line: row.line(),
        column: column.to_owned(),
        text: row.cell(place).chars().take(40).collect(),
    })
}

//! `--replay FILE`.

use super::rerun::Rebuilt;
use crate::input::numbers::counted;
use anyhow::bail;
use hwall_record::{Ending, RecordError, Recording, Replayed};
use std::io::Write;
use std::path::Path;

/// Runs the sessions of a recording again and says whether every command is the same, bit by bit.
///
/// # Errors
/// A recording that cannot be read or made again; a command that differs.
pub fn replay(path: &Path, out: &mut dyn Write) -> anyhow::Result<()> {
    let recording = Recording::open(path)?;
    let rebuilt = Rebuilt::new(recording.setup())?;
    let replayed = hwall_record::replay(&recording, |_, run| {
        rebuilt.session(run).map_err(Failure::Setup)
    });
    let replayed = match replayed {
        Ok(replayed) => replayed,
        Err(Failure::Setup(error)) => return Err(error),
        Err(Failure::Record(error)) => return Err(error.into()),
    };
    let Replayed {
        runs,
        frames,
        cycles,
        ..
    } = replayed;
    writeln!(
        out,
        "replayed {} and {} of {}",
        counted(cycles as usize, "cycle", "cycles"),
        counted(frames as usize, "frame", "frames"),
        counted(runs as usize, "run", "runs")
    )?;
    match replayed.ending {
        Ending::Finished => {}
        Ending::Unfinished => {
            writeln!(
                out,
                "the recording was not finished: its last half second may be missing"
            )?;
        }
        Ending::Followed { offset } => writeln!(
            out,
            "the file goes on behind the end of the recording, at byte {offset}: another program wrote to it, or the recorder was killed as it ended"
        )?,
        Ending::Cut { offset } => writeln!(
            out,
            "the recording is cut at byte {offset}: what was recorded after that is missing"
        )?,
        Ending::CutBehind { offset } => writeln!(
            out,
            "the file is cut at byte {offset}, behind all that was recorded: other programs may not open it"
        )?,
    }
    if replayed.missing > 0 {
        writeln!(
            out,
            "{} messages were left out when it was recorded",
            replayed.missing
        )?;
    }
    if let Some(difference) = replayed.difference {
        bail!(
            "{}: the commands differ, first in {difference}",
            path.display()
        );
    }
    let all = match replayed.ending {
        Ending::Unfinished | Ending::Cut { .. } => "all commands that are there",
        _ => "all commands",
    };
    writeln!(out, "{all} are the recorded ones, bit by bit")?;
    Ok(())
}

enum Failure {
    Record(RecordError),
    Setup(anyhow::Error),
}

impl From<RecordError> for Failure {
    fn from(error: RecordError) -> Self {
        Self::Record(error)
    }
}

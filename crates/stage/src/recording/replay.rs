//! `--replay FILE`.

use super::rerun::Rebuilt;
use crate::input::numbers::counted;
use anyhow::{Context, bail};
use hwall_record::{Ending, RecordError, Recording, Replayed};
use std::io::Write;
use std::path::Path;

/// Reruns the sessions of a recording and checks that every command is identical bit by bit.
///
/// # Errors
/// A recording that cannot be read or rebuilt; a command that differs.
pub fn replay(path: &Path, out: &mut dyn Write) -> anyhow::Result<()> {
    let name = || path.display().to_string();
    let named = |error: RecordError| match error {
        // These errors already name the file.
        RecordError::Io { .. } | RecordError::InUse { .. } => error.into(),
        other => anyhow::Error::from(other).context(name()),
    };
    let recording = Recording::open(path).map_err(named)?;
    let rebuilt = Rebuilt::new(recording.setup()).with_context(name)?;
    let replayed = hwall_record::replay(&recording, |_, run| {
        rebuilt.session(run).map_err(Failure::Setup)
    });
    let replayed = match replayed {
        Ok(replayed) => replayed,
        Err(Failure::Setup(error)) => return Err(error.context(name())),
        Err(Failure::Record(error)) => return Err(named(error)),
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
    let ended = match replayed.ending {
        Ending::Finished => None,
        Ending::Unfinished => {
            Some("the recording was not finished: its last half second may be missing".to_owned())
        }
        Ending::Followed { offset } => Some(format!(
            "the file goes on behind the end of the recording, at byte {offset}: another program wrote to it, or the recorder was killed as it ended"
        )),
        Ending::Cut { offset } => Some(format!(
            "the recording is cut at byte {offset}: what was recorded after that is missing"
        )),
        Ending::CutBehind { offset } => Some(format!(
            "the file is cut at byte {offset}, behind all that was recorded: other programs may not open it"
        )),
    };
    let missing = replayed.missing;
    let left_out =
        (missing > 0).then(|| format!("{missing} messages were left out when it was recorded"));
    for line in ended.iter().chain(&left_out) {
        writeln!(out, "{line}")?;
    }
    if let Some(difference) = replayed.difference {
        bail!("{}: the commands differ, first in {difference}", name());
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: the error did not name the file.
    #[test]
    fn what_is_no_recording_is_named() {
        let path = std::env::temp_dir().join(format!("hwall_replay_{}.md", std::process::id()));
        let said = |path: &Path| {
            let error = replay(path, &mut Vec::new()).unwrap_err();
            let text = format!("{error:#}");
            assert_eq!(text.matches(path.to_str().unwrap()).count(), 1, "{text}");
            text
        };
        assert!(said(&path).contains("No such file"));
        std::fs::write(&path, "# H-Wall").unwrap();
        assert!(said(&path).contains("not an MCAP file"));
        let _ = std::fs::remove_file(&path);
    }
}

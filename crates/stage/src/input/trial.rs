//! Selects one trial of a recording with several.

use anyhow::{Context, bail};
use hwall_hand::{Recording, read_recordings};
use std::fs::File;
use std::path::Path;

/// Largest number of names in a message.
const NAMED: usize = 5;

/// Reads the only trial of a CSV file, or the requested one: by its name in the column `trial`, or by `person/trial`
/// if several people have a trial of that name.
///
/// # Errors
/// A file that is missing or malformed; several trials and none chosen; none or several of that name (the error lists the names).
pub fn read(path: &Path, wanted: Option<&str>) -> anyhow::Result<Recording> {
    let place = || path.display().to_string();
    let mut trials = read_recordings(File::open(path).with_context(place)?).with_context(place)?;
    let Some(wanted) = wanted else {
        if trials.len() > 1 {
            bail!(
                "{}: {} trials, and one hand can follow only one: --trial chooses, here {}",
                place(),
                trials.len(),
                names(&trials)
            );
        }
        return trials.pop().with_context(place);
    };
    let is_it = |trial: &Recording| name(trial) == wanted || trial.trial.as_deref() == Some(wanted);
    let mut found: Vec<usize> = (0..trials.len()).filter(|&i| is_it(&trials[i])).collect();
    if found.len() > 1 {
        // The full name of one trial may equal another's trial name.
        found.retain(|&i| name(&trials[i]) == wanted);
    }
    match found[..] {
        [only] => Ok(trials.swap_remove(only)),
        _ if trials.iter().all(|trial| name(trial).is_empty()) => bail!(
            "{}: --trial {wanted}: the recording names no trials",
            place()
        ),
        _ => bail!(
            "{}: --trial {wanted}: no trial, or several, of that name; there are {}",
            place(),
            names(&trials)
        ),
    }
}

/// `person/trial`, or the part that is present.
fn name(trial: &Recording) -> String {
    let parts = [&trial.person, &trial.trial];
    let parts: Vec<&str> = parts.into_iter().flatten().map(String::as_str).collect();
    parts.join("/")
}

/// The first few names.
fn names(trials: &[Recording]) -> String {
    let mut names: Vec<String> = trials.iter().take(NAMED).map(name).collect();
    if trials.len() > NAMED {
        names.push("...".to_owned());
    }
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(file: &str, text: &str, wanted: Option<&str>) -> Result<usize, String> {
        let path = std::env::temp_dir().join(format!("hwall-trial-{}-{file}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let read = read(&path, wanted).map(|trial| trial.samples.len());
        std::fs::remove_file(&path).unwrap();
        read.map_err(|error| format!("{error:#}"))
    }

    /// Regression: "3 trials in a file of which one was expected" named no remedy.
    #[test]
    fn one_of_several_trials_is_chosen_by_its_name() {
        let rows = "person,trial,t,palm_x,palm_y,palm_z\n\
                    ann,1,0,0,0,0\nann,1,1,0,0,0\nann,2,0,0,0,0\nbob,2,0,0,0,0\nbob,2,1,0,0,0\nbob,2,2,0,0,0\n";
        let read = |wanted| said("several.csv", rows, wanted);
        let refused = read(None).unwrap_err();
        for part in ["3 trials", "--trial chooses, here ann/1, ann/2, bob/2"] {
            assert!(refused.contains(part), "{refused}");
        }
        assert_eq!(read(Some("1")), Ok(2));
        assert_eq!(read(Some("bob/2")), Ok(3));
        for wrong in ["2", "3", "", "ann"] {
            let refused = read(Some(wrong)).unwrap_err();
            assert!(refused.contains("there are ann/1"), "{refused}");
        }
        let nobody = "trial,t,palm_x,palm_y,palm_z\n1,0,0,0,0\n2,0,0,0,0\n";
        let refused = said("nobody.csv", nobody, None).unwrap_err();
        assert!(refused.contains("here 1, 2"), "{refused}");
        let one = "t,palm_x,palm_y,palm_z\n0,0,0,0\n";
        assert_eq!(said("one.csv", one, None), Ok(1));
        assert!(said("one.csv", one, Some("1")).is_err());
        assert!(said("none.csv", "t,palm_x\n", None).is_err());
    }
}

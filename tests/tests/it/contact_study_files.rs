//! Recordings as studies bring them, with columns, cells and names missing, through the whole comparison.

use hwall_hand::{HandPoint, Quantity, Recording, write_recordings};
use hwall_lab::contact::candidates::Candidate;
use hwall_lab::contact::recordings::{FoundSources, read};
use hwall_lab::contact::report::{Choice, recordings};
use hwall_lab::demonstrations::generate::{
    DemonstrationConfig, PartSize, SimulatedReach, generate,
};
use hwall_lab::study::arguments::Arguments;
use std::fs;
use std::path::{Path, PathBuf};

const PEOPLE: usize = 3;
const REACHES: usize = 15;

fn people() -> Vec<SimulatedReach> {
    let config = DemonstrationConfig::pointing();
    generate(&DemonstrationConfig {
        train: PartSize {
            people: PEOPLE,
            reaches: REACHES,
        },
        ..config
    })
    .unwrap()
}

fn empty_folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("contact_study_files")
        .join(name);
    // Nothing may be left of an earlier run.
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

/// What a study may leave out.
#[derive(Clone, Copy)]
struct Kept {
    palm: bool,
    head: bool,
    target: bool,
    contact: bool,
    person: bool,
    trial: bool,
}

/// Index and palm of named people and trials.
const PALM: Kept = Kept {
    palm: true,
    head: false,
    target: false,
    contact: false,
    person: true,
    trial: true,
};

fn thinned(made: &[SimulatedReach], kept: Kept) -> Vec<Recording> {
    let mut all: Vec<Recording> = made.iter().map(|d| d.recording.clone()).collect();
    for recording in &mut all {
        recording.person = recording.person.take().filter(|_| kept.person);
        recording.trial = recording.trial.take().filter(|_| kept.trial);
        for sample in &mut recording.samples {
            let clear = [
                (kept.palm, Quantity::Hand(HandPoint::Palm)),
                (kept.head, Quantity::Head),
                (kept.target, Quantity::Target),
            ];
            for (_, quantity) in clear.into_iter().filter(|(keep, _)| !keep) {
                sample.set(quantity, None);
            }
            sample.contact = sample.contact.filter(|_| kept.contact);
        }
    }
    all
}

fn write(path: &Path, recordings: &[Recording]) {
    write_recordings(fs::File::create(path).unwrap(), recordings).unwrap();
}

fn quick() -> Vec<Candidate> {
    vec![
        Candidate::of("hold", |r| hwall_contact::Hold::train(r)),
        Candidate::of("ridge on five frames", |r| {
            hwall_contact::RidgeWindow::train(r)
        }),
    ]
}

/// Number of reaches, description of the split, and the report.
fn study(dir: &Path) -> (usize, String, String) {
    let FoundSources { sources, refused } = read(dir).unwrap();
    assert_eq!(refused, Vec::<String>::new());
    assert_eq!(sources.len(), 1, "one study");
    let out = dir.with_extension("out");
    fs::create_dir_all(&out).unwrap();
    let text = recordings(dir, &quick(), &Choice::default(), Some(&out))
        .unwrap()
        .text;
    assert!(!text.contains("Not run"), "{text}");
    assert!(!text.contains("NaN"), "{text}");
    let split = sources[0].split().description;
    (sources[0].reaches.len(), split, text)
}

#[test]
fn the_tip_of_one_finger_is_enough() {
    let dir = empty_folder("index");
    let kept = Kept {
        palm: false,
        ..PALM
    };
    let made = people();
    write(&dir.join("all.csv"), &thinned(&made, kept));
    let header = fs::read_to_string(dir.join("all.csv")).unwrap();
    let header = header.lines().next().unwrap();
    assert_eq!(header, "person,trial,t,index_x,index_y,index_z");
    let (reaches, split, text) = study(&dir);
    assert_eq!(reaches, REACHES);
    assert!(split.contains("each person held out: 3 folds"), "{split}");
    assert!(text.contains("1 file: index;"), "{text}");
    // The end of the movement stands in for the contact where none was recorded.
    let sources = read(&dir).unwrap().sources;
    for (reach, truth) in sources[0].reaches.iter().zip(&made) {
        let off_m = reach.contact_m.distance(truth.labelled.contact_m);
        assert!(off_m < 0.03, "{off_m}");
        assert!((reach.contact_s - truth.labelled.contact_s).abs() < 0.15);
    }
}

#[test]
fn targets_and_contacts_are_the_labels_where_there_are_any() {
    let dir = empty_folder("labelled");
    let kept = Kept {
        head: true,
        target: true,
        contact: true,
        ..PALM
    };
    let made = people();
    write(&dir.join("all.csv"), &thinned(&made, kept));
    let (reaches, _, text) = study(&dir);
    assert_eq!(reaches, REACHES);
    assert!(text.contains("palm, index, head, target"), "{text}");
    let sources = read(&dir).unwrap().sources;
    for (reach, truth) in sources[0].reaches.iter().zip(&made) {
        assert!(reach.contact_m.distance(truth.labelled.contact_m) < 1e-9);
        // A recording knows the contact to a sample: its first one in contact.
        let samples = &truth.recording.samples;
        let first = samples.iter().find(|s| s.contact == Some(true)).unwrap();
        assert!((reach.contact_s - first.frame.t_s).abs() < 1e-9);
    }
}

#[test]
fn people_need_no_names() {
    // Trials without people: recordings are held out. Neither, a file a trial: the same.
    let made = people();
    let kept = Kept {
        person: false,
        ..PALM
    };
    let dir = empty_folder("trials");
    let mut trials = thinned(&made, kept);
    for (number, recording) in trials.iter_mut().enumerate() {
        recording.trial = Some(number.to_string());
    }
    write(&dir.join("all.csv"), &trials);
    let (reaches, split, text) = study(&dir);
    assert_eq!(reaches, REACHES);
    assert!(split.contains("each recording held out"), "{split}");
    assert!(text.contains("palm, index;"), "{text}");

    let dir = empty_folder("files");
    let unnamed = thinned(
        &made,
        Kept {
            trial: false,
            ..kept
        },
    );
    for (number, recording) in unnamed.iter().enumerate() {
        let path = dir.join(format!("take{number:02}.csv"));
        write(&path, std::slice::from_ref(recording));
    }
    let (reaches, split, _) = study(&dir);
    assert!(reaches >= REACHES - 1, "{reaches}");
    assert!(split.contains("each recording held out"), "{split}");
}

#[test]
fn empty_cells_are_gaps_and_no_more() {
    let dir = empty_folder("gaps");
    let kept = Kept { head: true, ..PALM };
    let mut all = thinned(&people(), kept);
    for recording in &mut all {
        let n = recording.samples.len();
        for (i, sample) in recording.samples.iter_mut().enumerate() {
            // Every fifth tip, a fifth of the palm in one go, a head in the first half only.
            if i % 5 == 2 && i + 5 < n {
                sample.set(Quantity::Hand(HandPoint::Index), None);
            }
            if (2 * n / 5..3 * n / 5).contains(&i) {
                sample.set(Quantity::Hand(HandPoint::Palm), None);
            }
            if 2 * i > n {
                sample.set(Quantity::Head, None);
            }
        }
    }
    write(&dir.join("all.csv"), &all);
    assert!(
        fs::read_to_string(dir.join("all.csv"))
            .unwrap()
            .contains(",,,")
    );
    let (reaches, split, _) = study(&dir);
    assert_eq!(reaches, REACHES);
    assert!(split.contains("each person held out"), "{split}");
}

#[test]
fn predictions_are_written_at_the_moments_and_every_fifty_ms() {
    let dir = empty_folder("rows");
    palms(&dir.join("all.csv"));
    study(&dir);
    let rows = fs::read_to_string(dir.with_extension("out").join("all_predictions.csv")).unwrap();
    let per_reach = (rows.lines().count() - 1) as f64 / (2 * REACHES) as f64;
    // 13 moments, some in one sample, and about 18 stretches of 50 ms in 0.9 s; there are 80 samples.
    assert!((18.0..36.0).contains(&per_reach), "{per_reach}");
}

/// The output of the program with these arguments, or its error.
fn asked(words: &[&str]) -> Result<String, String> {
    let arguments = Arguments::of([&["contact_study"], words].concat()).unwrap();
    let said = arguments.run().map_err(|error| format!("{error:#}"));
    if let Err(why) = &said {
        assert!(!why.contains('\n'), "one line: {why}");
    }
    said
}

fn text_of(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// All reaches, with the palm alone.
fn palms(path: &Path) {
    write(path, &thinned(&people(), PALM));
}

#[test]
fn columns_that_mean_nothing_are_named() {
    let dir = empty_folder("columns");
    let file = dir.join("all.csv");
    palms(&file);
    let text = fs::read_to_string(&file).unwrap();
    let wider: Vec<String> = text
        .lines()
        .enumerate()
        .map(|(i, line)| line.to_owned() + if i == 0 { ",pinch,Palm_X" } else { ",1,2" })
        .collect();
    fs::write(&file, wider.join("\n")).unwrap();
    let text = recordings(&dir, &quick(), &Choice::default(), None)
        .unwrap()
        .text;
    assert!(text.contains("Ignored columns: pinch, Palm_X."), "{text}");
    palms(&file);
    let text = recordings(&dir, &quick(), &Choice::default(), None)
        .unwrap()
        .text;
    assert!(!text.contains("Ignored columns"), "{text}");
}

#[test]
fn a_folder_without_a_recording_says_why_of_every_file() {
    let dir = empty_folder("unreadable");
    let named = format!("no readable recording in {}", dir.display());
    let fails = || asked(&["--recordings", text_of(&dir)]).unwrap_err();
    assert_eq!(fails(), format!("{named}: no CSV file"));
    fs::write(dir.join("a.csv"), "t,palm_x,palm_y\n0,1,2\n").unwrap();
    fs::write(dir.join("b.csv"), "time,place\n0,1\n").unwrap();
    fs::write(dir.join("c.csv"), "t,palm_x,palm_y,palm_z\n0,1,2,x\n").unwrap();
    let why = fails();
    assert!(why.starts_with(&named), "{why}");
    for reason in ["a.csv: ", "palm_z", "b.csv: ", "c.csv: ", "line 2"] {
        assert!(why.contains(reason), "{reason}: {why}");
    }
    let why = asked(&["--recordings", text_of(&dir.join("nowhere"))]).unwrap_err();
    assert!(
        why.contains("--recordings") && why.contains("nowhere"),
        "{why}"
    );
}

#[test]
fn a_single_file_is_a_study_too() {
    let dir = empty_folder("single");
    palms(&dir.join("mine.csv"));
    palms(&dir.join("other.csv"));
    let FoundSources { sources, refused } = read(&dir.join("mine.csv")).unwrap();
    assert_eq!((sources.len(), refused.len()), (1, 0));
    assert_eq!(sources[0].name, "mine");
    assert_eq!(sources[0].reaches.len(), REACHES);
    fs::write(dir.join("bad.txt"), "no recording").unwrap();
    let why = asked(&["--recordings", text_of(&dir.join("bad.txt"))]).unwrap_err();
    assert!(why.contains("bad.txt: bad.txt: "), "{why}");
}

#[test]
fn studies_of_like_names_write_their_own_files() {
    let dir = empty_folder("names");
    for name in ["a/b", "a-b", "pointing"] {
        fs::create_dir_all(dir.join(name)).unwrap();
        palms(&dir.join(name).join("hands.csv"));
    }
    let sources = read(&dir).unwrap().sources;
    let names: Vec<&str> = sources.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["a-b", "a-b-2", "pointing-2"]);
}

#[test]
fn what_recordings_have_no_use_for_is_refused() {
    let dir = empty_folder("refused");
    palms(&dir.join("all.csv"));
    let others: [[&str; 2]; 4] = [
        ["--seed", "2"],
        ["--people", "3"],
        ["--reaches", "4"],
        ["--protocol", "rooms"],
    ];
    for other in others {
        let why = asked(&["--recordings", text_of(&dir), other[0], other[1]]).unwrap_err();
        assert!(why.starts_with(other[0]), "{why}");
        assert!(why.contains("--recordings"), "{why}");
    }
    let why = asked(&["--protocol", "rooms", "--people", "3"]).unwrap_err();
    assert!(why.starts_with("--people"), "{why}");
    let why = asked(&["--report", "x", "--protocol", "rooms"]).unwrap_err();
    assert!(why.starts_with("--protocol"), "{why}");
    let why = asked(&["--report", text_of(&dir.join("no/such.md"))]).unwrap_err();
    assert!(why.starts_with("--report"), "{why}");
    assert!(why.ends_with("such.md: no such folder"), "{why}");
}

#[test]
fn no_empty_folder_is_left_behind() {
    let dir = empty_folder("left");
    let out = dir.join("new/out");
    let nowhere = dir.join("nowhere");
    let study = |out: &Path| {
        asked(&["--recordings", text_of(&nowhere), "--out", text_of(out)]).unwrap_err();
    };
    study(&out);
    assert!(!dir.join("new").exists());
    // What was there before stays.
    fs::create_dir_all(&out).unwrap();
    study(&out);
    assert!(out.is_dir());
    let why = asked(&["--recordings", text_of(&dir), "--out", "/dev/null/x"]).unwrap_err();
    assert!(why.starts_with("--out /dev/null/x"), "{why}");
}

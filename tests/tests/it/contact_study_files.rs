//! Recordings as studies bring them, with columns, cells and names missing, through the whole comparison.

use crate::common::files::empty_folder;
use hwall_contact::{Hold, RidgeWindow};
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

const REACHES: usize = 15;

/// Reaches of three people.
fn people() -> Vec<SimulatedReach> {
    let config = DemonstrationConfig {
        train: PartSize {
            people: 3,
            reaches: REACHES,
        },
        ..DemonstrationConfig::pointing()
    };
    generate(&config).unwrap()
}

fn folder(name: &str) -> PathBuf {
    empty_folder(&format!("contact_study_files/{name}"))
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
        Candidate::of("hold", |r| Hold::train(r)),
        Candidate::of("ridge on five frames", |r| RidgeWindow::train(r)),
    ]
}

/// The report about the recordings of a folder.
fn text_of(dir: &Path, out: Option<&Path>) -> String {
    let report = recordings(dir, &quick(), &Choice::default(), out);
    report.unwrap().text
}

/// Number of reaches, description of the split, and the report.
fn study(dir: &Path) -> (usize, String, String) {
    let FoundSources { sources, refused } = read(dir).unwrap();
    assert_eq!(refused, Vec::<String>::new());
    assert_eq!(sources.len(), 1, "one study");
    let out = dir.with_extension("out");
    fs::create_dir_all(&out).unwrap();
    let text = text_of(dir, Some(&out));
    assert!(!text.contains("Not run"), "{text}");
    assert!(!text.contains("NaN"), "{text}");
    let split = sources[0].split().description;
    (sources[0].reaches.len(), split, text)
}

#[test]
fn the_tip_of_one_finger_is_enough() {
    let dir = folder("index");
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
    let dir = folder("labelled");
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
    let dir = folder("trials");
    let mut trials = thinned(&made, kept);
    for (number, recording) in trials.iter_mut().enumerate() {
        recording.trial = Some(number.to_string());
    }
    write(&dir.join("all.csv"), &trials);
    let (reaches, split, text) = study(&dir);
    assert_eq!(reaches, REACHES);
    assert!(split.contains("each recording held out"), "{split}");
    assert!(text.contains("palm, index;"), "{text}");

    let dir = folder("files");
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
    let dir = folder("gaps");
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
    let text = fs::read_to_string(dir.join("all.csv")).unwrap();
    assert!(text.contains(",,,"));
    let (reaches, split, _) = study(&dir);
    assert_eq!(reaches, REACHES);
    assert!(split.contains("each person held out"), "{split}");
}

#[test]
fn predictions_are_written_at_the_moments_and_every_fifty_ms() {
    let dir = folder("rows");
    palms(&dir.join("all.csv"));
    study(&dir);
    let rows = fs::read_to_string(dir.with_extension("out").join("all_predictions.csv")).unwrap();
    let per_reach = (rows.lines().count() - 1) as f64 / (2 * REACHES) as f64;
    // 13 moments, some in one sample, and about 18 stretches of 50 ms in 0.9 s; there are 80 samples.
    assert!((18.0..36.0).contains(&per_reach), "{per_reach}");
}

/// Why the program refuses these arguments; paths that begin with a dot are of the folder.
fn why_not(line: &str, dir: &Path) -> String {
    let path = |word: &str| match word.strip_prefix('.') {
        Some(below) => format!("{}{below}", dir.display()),
        None => word.to_owned(),
    };
    let words: Vec<String> = line.split(' ').map(path).collect();
    let words = words.iter().map(String::as_str);
    let arguments = Arguments::of(["contact_study"].into_iter().chain(words)).unwrap();
    let why = format!("{:#}", arguments.run().unwrap_err());
    assert!(!why.contains('\n'), "one line: {why}");
    why
}

/// All reaches, with the palm alone.
fn palms(path: &Path) {
    write(path, &thinned(&people(), PALM));
}

#[test]
fn columns_that_mean_nothing_are_named() {
    let dir = folder("columns");
    let file = dir.join("all.csv");
    palms(&file);
    let text = fs::read_to_string(&file).unwrap();
    let wider = text.trim_end().replace('\n', ",1,2\n") + ",1,2\n";
    let wider = wider.replacen(",1,2", ",pinch,Palm_X", 1);
    fs::write(&file, wider).unwrap();
    let text = text_of(&dir, None);
    assert!(text.contains("Ignored columns: pinch, Palm_X."), "{text}");
    palms(&file);
    let text = text_of(&dir, None);
    assert!(!text.contains("Ignored columns"), "{text}");
}

#[test]
fn a_folder_without_a_recording_says_why_of_every_file() {
    let dir = folder("unreadable");
    let named = format!("no readable recording in {}", dir.display());
    let fails = || why_not("--recordings .", &dir);
    assert_eq!(fails(), format!("{named}: no CSV file"));
    fs::write(dir.join("a.csv"), "t,palm_x,palm_y\n0,1,2\n").unwrap();
    fs::write(dir.join("b.csv"), "time,place\n0,1\n").unwrap();
    fs::write(dir.join("c.csv"), "t,palm_x,palm_y,palm_z\n0,1,2,x\n").unwrap();
    let why = fails();
    assert!(why.starts_with(&named), "{why}");
    for reason in ["a.csv: ", "palm_z", "b.csv: ", "c.csv: ", "line 2"] {
        assert!(why.contains(reason), "{reason}: {why}");
    }
    let why = why_not("--recordings ./nowhere", &dir);
    let is_named = why.contains("--recordings") && why.contains("nowhere");
    assert!(is_named, "{why}");
}

#[test]
fn a_single_file_is_a_study_too() {
    let dir = folder("single");
    palms(&dir.join("mine.csv"));
    palms(&dir.join("other.csv"));
    let FoundSources { sources, refused } = read(&dir.join("mine.csv")).unwrap();
    assert_eq!((sources.len(), refused.len()), (1, 0));
    assert_eq!(sources[0].name, "mine");
    assert_eq!(sources[0].reaches.len(), REACHES);
    fs::write(dir.join("bad.txt"), "no recording").unwrap();
    let why = why_not("--recordings ./bad.txt", &dir);
    assert!(why.contains("bad.txt: bad.txt: "), "{why}");
}

#[test]
fn studies_of_like_names_write_their_own_files() {
    let dir = folder("names");
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
    let dir = folder("refused");
    palms(&dir.join("all.csv"));
    for more in ["--seed 2", "--people 3", "--reaches 4", "--protocol rooms"] {
        let why = why_not(&format!("--recordings . {more}"), &dir);
        let flag = more.split(' ').next().unwrap();
        assert!(why.starts_with(flag), "{why}");
        assert!(why.contains("--recordings"), "{why}");
    }
    for (line, flag) in [
        ("--protocol rooms --people 3", "--people"),
        ("--report x --protocol rooms", "--protocol"),
        ("--report ./no/such.md", "--report"),
    ] {
        let why = why_not(line, &dir);
        assert!(why.starts_with(flag), "{line}: {why}");
        let no_folder = why.ends_with("such.md: no such folder");
        assert_eq!(no_folder, line.contains("such.md"), "{why}");
    }
}

#[test]
fn no_empty_folder_is_left_behind() {
    let dir = folder("left");
    let study = "--recordings ./nowhere --out ./new/out";
    why_not(study, &dir);
    assert!(!dir.join("new").exists());
    // What was there before stays.
    fs::create_dir_all(dir.join("new/out")).unwrap();
    why_not(study, &dir);
    assert!(dir.join("new/out").is_dir());
    let why = why_not("--recordings . --out /dev/null/x", &dir);
    assert!(why.starts_with("--out /dev/null/x"), "{why}");
}

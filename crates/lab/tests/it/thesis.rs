//! The dissertation's page: complete, by chapter, in one file, the same for the same seed.

use hwall_lab::documents::Documents;
use hwall_lab::thesis::Chapter;
use hwall_lab::thesis::document::{NAME, PAGE, Request, write};
use std::fs;
use std::path::{Path, PathBuf};

/// Figures, tables and experiments of the dissertation, and the chapter of each.
const ROWS: [(&str, &str); 18] = [
    ("IV-1, IV-2, IV-3", "maps"),
    ("one hour an orientation", "maps"),
    ("Experiment 1", "maps"),
    ("Experiment 2", "maps"),
    ("V-2, V-3", "roughness"),
    ("V-5, V-8", "roughness"),
    ("V-10, V-11, table V", "roughness"),
    ("V-12, V-13", "roughness"),
    ("V-14", "roughness"),
    ("VI-2, VI-3", "prediction"),
    ("choice of a basis", "prediction"),
    ("III: delays", "system"),
    ("avatar that is turned, and the hand that stops", "system"),
    ("VII: objects that move", "outlook"),
    ("smaller and finer textons", "outlook"),
    ("non-linear scanning", "outlook"),
    ("several objects with different physics", "outlook"),
    ("the discussions: the rest", "outlook"),
];
/// What the last of them answers in a table.
const REST: [&str; 4] = [
    "early recognition of gestures",
    "leave-one-out validation",
    "time of response by method",
    "a base that drives",
];

fn source(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(path)
}

#[test]
fn every_row_has_an_entry_with_its_command_and_a_verdict() {
    let tracked = fs::read_to_string(source("../../../docs/THESIS.md")).unwrap();
    for (row, chapter) in ROWS {
        let text = fs::read_to_string(source(&format!("thesis/{chapter}.md"))).unwrap();
        let entries = || text.split("\n### ").skip(1);
        let heads = |entry: &&str| entry.lines().next().unwrap_or_default().contains(row);
        assert_eq!(entries().filter(heads).count(), 1, "{row}");
        for entry in entries() {
            let heading = format!("### {}\n", entry.lines().next().unwrap_or_default());
            assert!(tracked.contains(&heading), "thesis --docs: {heading}");
            for part in ["- **Agrees.** ", "- **Differs.** ", "- **Beyond it.** "] {
                assert!(entry.contains(part), "{part}: {entry}");
            }
            let commands = ["Command: `", "Command: those in the table"];
            let has_command = commands.iter().any(|command| entry.contains(command));
            assert!(has_command, "{entry}");
        }
    }
}

#[test]
fn what_was_left_open_has_an_answer_and_a_command() {
    let text = fs::read_to_string(source("thesis/outlook.md")).unwrap();
    for row in REST {
        let head = format!("| {row} | ");
        let mut found = text.lines().filter_map(|line| line.strip_prefix(&head));
        let cells = found.next().unwrap_or_default().split(" | ");
        let cells: Vec<&str> = cells.collect();
        assert!(found.next().is_none() && cells.len() == 2, "{row}");
        assert!(cells[1].contains('`') && cells[1].contains(".md)"), "{row}");
    }
}

/// They were typed by hand, without the commit that the page promises.
#[test]
fn numbers_of_the_base_are_those_of_its_table_and_name_a_commit() {
    let of = |path| fs::read_to_string(source(path)).unwrap();
    let (open, system) = (of("thesis/outlook.md"), of("thesis/system.md"));
    assert!(system.contains("18 to 29 % ") && system.contains("(commit eba04b8a)"));
    let is_row = |line: &&str| line.starts_with("| a base that drives |");
    let row = open.lines().find(is_row).unwrap();
    assert!(row.contains("(commit "), "{row}");
    let text = of("../../../docs/ENVIRONMENTS.md");
    let table = text.split("<!-- base:begin -->").nth(1).unwrap();
    let rows = table.lines().filter(|line| line.starts_with('|'));
    let table: Vec<Vec<&str>> = rows
        .map(|line| line.split('|').map(str::trim).collect())
        .collect();
    let column = |name: &str, kinds: &[&str]| -> Vec<f64> {
        let at = table[0].iter().position(|cell| *cell == name).unwrap();
        let rows = table.iter().filter(|row| kinds.contains(&row[1]));
        rows.map(|row| row[at].parse().unwrap()).collect()
    };
    let span = |name: &str, kinds: &[&str]| {
        let numbers = column(name, kinds);
        let least = numbers.iter().copied().fold(f64::INFINITY, f64::min);
        let most = numbers.iter().copied().fold(0.0, f64::max);
        format!("{least:.0} to {most:.0} %")
    };
    let both = ["drives", "both"];
    let moved = column("steps in motion while touched", &both);
    let braked = moved.iter().filter(|steps| **steps > 0.0).count();
    let fastest = column("the fastest of them, m/s", &both);
    let fastest = fastest.into_iter().fold(0.0, f64::max);
    for said in [
        format!("at {} of all touches", span("in place, %", &both[..1])),
        format!("{} with redirection", span("in place, %", &both[1..])),
        format!("at {} of the first", span("first of a visit, %", &both)),
        format!("stands: {}", span("possible, %", &both)),
        format!("in {braked} of {} walks", moved.len()),
        format!("at up to {fastest:.2} m/s"),
    ] {
        assert!(row.contains(&said), "{said}: {row}");
    }
}

fn made(name: &str, chapter: &str, published: Option<&Path>) -> anyhow::Result<[String; 2]> {
    let folder = std::env::temp_dir().join(format!("hwall_thesis_{name}_{}", std::process::id()));
    let request = Request {
        chapter: Some(Chapter::numbered(chapter).unwrap()),
        seed: 7,
        published: published.map(Path::to_owned),
    };
    let made = write(&request, &Documents::in_folder(&folder)?, |_| {});
    let texts = made.map(|_| [NAME, PAGE].map(|f| fs::read_to_string(folder.join(f)).unwrap()));
    let _ = fs::remove_dir_all(&folder);
    texts
}

#[test]
fn a_chapter_alone_is_one_file_and_the_same_again() {
    for (chapter, heading) in [("5", "## Chapter V:"), ("vii", "## Chapter VII:")] {
        let [text, page] = made("first", chapter, None).unwrap();
        assert!(text.contains(heading), "{chapter}");
        assert_eq!(text.matches("\n## ").count(), 1, "{chapter}");
        for outside in ["://", " src=", "@import", "url("] {
            assert!(!page.contains(outside), "{outside}");
        }
        assert!(page.contains("<svg") && page.contains("</html>") && !page.contains("{{"));
        assert_eq!(page.matches("<figure>").count(), text.matches("![").count());
        let again = made("again", chapter, None).unwrap();
        assert_eq!([text, page], again);
    }
}

/// Measured times differ from run to run; nothing else does.
#[test]
fn maps_that_are_not_there_are_refused_when_named_and_else_skipped() {
    let nowhere = std::env::temp_dir().join("hwall_no_maps");
    let refused = format!("{:#}", made("nowhere", "4", Some(&nowhere)).unwrap_err());
    assert!(refused.contains("--published"), "{refused}");
    // Tests run in the folder of their package, from where the shared data are not found.
    let untimed = |[text, _]: [String; 2]| -> Vec<String> {
        let lines = text
            .lines()
            .filter(|line| !line.contains("time for the map"));
        lines.map(str::to_owned).collect()
    };
    let first = untimed(made("skipped", "IV", None).unwrap());
    assert!(first.iter().any(|line| line.starts_with("**Skipped**")));
    assert!(first.iter().any(|line| line.contains("reach_map")));
    assert_eq!(first, untimed(made("skipped_again", "4", None).unwrap()));
}

#[test]
fn chapters_have_two_names_each_and_no_others() {
    for (number, chapter) in (3..).zip(Chapter::ALL) {
        assert_eq!(Chapter::numbered(&format!("{number}")), Ok(chapter));
        assert_eq!(Chapter::numbered(chapter.name()), Ok(chapter));
    }
    for other in ["", "2", "8", "VIII", "-4", "IV.1"] {
        assert!(Chapter::numbered(other).unwrap_err().contains("3 to 7"));
    }
}

fn files_of(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => files_of(&path, found),
            false => found.push(path),
        }
    }
}

#[test]
fn published_numbers_are_in_one_table() {
    let mut files = Vec::new();
    files_of(&source(""), &mut files);
    let numbers = [
        "71.667", "15.873", "0.437", "3.62", "5.43", "6.95", "9.96", "12.83", "12.94", "11.7",
    ];
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let is_table =
            path.ends_with("dissertation.rs") && !path.ends_with("contact/dissertation.rs");
        for number in numbers {
            let word = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
            let is_there = code.match_indices(number).any(|(at, _)| {
                !word(&code[at + number.len()..])
                    && !code[..at].ends_with(|c: char| c.is_ascii_digit())
            });
            assert!(is_table || !is_there, "{}: {number}", path.display());
        }
    }
}

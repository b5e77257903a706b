//! Documents that programs write say what the programs of today would say: the same columns, the same rows, one commit for
//! what is quoted. A table that was left behind when its program changed fails here.

use hwall_lab::attack::findings;
use hwall_lab::faults::fault::Fault;
use hwall_lab::{feel, in_time};
use hwall_stage::person::kinds::PersonKind;
use std::path::{Path, PathBuf};

fn document(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn cells(line: &str) -> Vec<&str> {
    line.split('|').map(str::trim).collect()
}

/// The rows of the tables whose header is that of `table`.
fn rows_below<'a>(text: &'a str, table: &str) -> Vec<Vec<&'a str>> {
    let header = cells(table.lines().next().unwrap()).join("|");
    let mut rows = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if cells(line).join("|") == header {
            let own = lines.by_ref().skip(1).take_while(|l| l.starts_with('|'));
            rows.extend(own.map(cells));
        }
    }
    rows
}

#[test]
fn every_kind_of_person_is_in_the_table_of_times() {
    let text = document("docs/IN-TIME.md");
    let rows = rows_below(&text, &in_time::document::table(&[]).to_string());
    let people: Vec<&str> = rows.iter().map(|row| row[1]).collect();
    assert_eq!(people, PersonKind::ALL.map(PersonKind::name));
    let targets = rows_below(&text, &in_time::targets::table(&[]).to_string());
    assert!(!targets.is_empty());
}

#[test]
fn every_fault_is_in_the_matrix() {
    let text = document("docs/FAULTS.md");
    for fault in Fault::all() {
        let name = fault.name();
        let told = text
            .lines()
            .any(|line| cells(line).contains(&name.as_str()));
        assert!(told, "docs/FAULTS.md does not know {name:?}");
    }
}

#[test]
fn what_is_felt_has_the_columns_of_its_program() {
    let text = document("docs/FEEL.md");
    for table in [
        feel::document::table(&[]).to_string(),
        feel::document::verdicts(&[]).to_string(),
    ] {
        assert!(!rows_below(&text, &table).is_empty(), "{table}");
    }
}

/// Names of tests change: the table of findings changes with them, or this fails.
#[test]
fn findings_are_held_by_tests_that_there_are() {
    for finding in findings::all() {
        assert!(!finding.tests.is_empty(), "{}", finding.what);
        for (file, name) in finding.tests {
            let text = document(file);
            let function = text.find(&format!("fn {name}()"));
            let at = function.unwrap_or_else(|| panic!("{file} has no test {name}"));
            let attributes = text[..at].rsplit("\n}\n").next().unwrap_or_default();
            assert!(attributes.contains("#[test]"), "{file}: {name} is no test");
        }
    }
    let text = document("docs/ATTACKS.md");
    assert!(text.contains(findings::section()), "attack --docs");
}

/// The README quotes one run, that of the document.
#[test]
fn the_readme_quotes_the_speeds_at_hand() {
    let machine = |name: &str| {
        let text = document(name);
        let line = text.lines().find(|line| line.starts_with("CPU: "));
        line.map(str::to_owned).unwrap_or_else(|| panic!("{name}"))
    };
    assert_eq!(machine("README.md"), machine("docs/SPEED-AGAINST-ERROR.md"));
}

#[test]
fn the_columns_of_touches_are_those_of_the_readme() {
    let header = document("docs/figures/hwall/touches.csv");
    let header = header.lines().next().unwrap();
    let readme = document("README.md").replace('\n', "");
    assert!(readme.contains(&format!("`{header}`")), "{header}");
}

/// Whole paths of the files of a folder and of those in it.
fn files_in(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder);
    for entry in entries.unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => files_in(&path, found),
            false => found.push(path),
        }
    }
}

/// Files move: what is written about them goes along, or this fails.
#[test]
fn the_files_of_the_architecture_are_there() {
    let mut files = Vec::new();
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    files_in(&crates, &mut files);
    let is_of_path = |c: char| c.is_ascii_alphanumeric() || "_/.".contains(c);
    let mut named = 0;
    for document_of_files in ["docs/ARCHITECTURE.md", "docs/CONTRIBUTING.md"] {
        let text = document(document_of_files);
        for name in text
            .split(|c| !is_of_path(c))
            .filter(|w| w.ends_with(".rs"))
        {
            named += 1;
            let is_there = files.iter().any(|path| path.ends_with(name))
                || Path::new(env!("CARGO_MANIFEST_DIR"))
                    .join("..")
                    .join(name)
                    .is_file();
            assert!(is_there, "{document_of_files} names {name}");
        }
    }
    assert!(named > 120, "{named}");
}

/// By hand: everything else is written by a program.
const BY_HAND: [&str; 7] = [
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "NOTATION.md",
    "REAL-ARM.md",
    "SAFETY.md",
    "SIMULATORS.md",
    "STUDY.md",
];

#[test]
fn documents_of_numbers_name_their_command_commit_and_seed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let examples = document("examples/Cargo.toml") + &document("crates/lab/Cargo.toml");
    let mut by_program = 0;
    for entry in std::fs::read_dir(root.join("docs")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let is_document = name.ends_with(".md");
        if !is_document || BY_HAND.contains(&name.as_str()) {
            continue;
        }
        by_program += 1;
        let text = document(&format!("docs/{name}"));
        let head: Vec<&str> = text.lines().take(8).collect();
        let head = head.join("\n");
        let (_, command) = head
            .split_once("Written by `")
            .unwrap_or_else(|| panic!("docs/{name} does not say by which command it was written"));
        let command = command.split('`').next().unwrap();
        let words = command.strip_prefix("cargo run --release --example ");
        let program = words.unwrap_or(command).split(' ').next().unwrap();
        let is_there = examples.contains(&format!("name = \"{program}\""));
        assert!(is_there, "docs/{name}: there is no {program}");
        for word in ["CPU: ", "commit ", "seed "] {
            assert!(head.contains(word), "docs/{name}: no {word:?} in its head");
        }
    }
    assert!(by_program >= 10, "{by_program}");
    for name in BY_HAND {
        assert!(
            !document(&format!("docs/{name}")).contains("CPU: "),
            "{name}"
        );
    }
}

/// The README says how much earlier the fused predictor is in rooms of several surfaces: the medians of the study.
#[test]
fn the_readme_quotes_the_study_at_hand() {
    let readme = document("README.md").replace('\n', " ");
    let study = document("docs/CONTACT-STUDY.md");
    let header = "surfaces | touches";
    let start = study
        .lines()
        .position(|l| cells(l).join(" | ").contains(header));
    let rows = study
        .lines()
        .skip(start.expect("the table of the rooms") + 2);
    let rows = rows.take_while(|line| line.starts_with('|')).map(cells);
    let mut leads_ms: Vec<u32> = rows
        .filter(|row| row[1] != "1")
        .map(|row| row[row.len() - 2].parse().expect("a lead, ms"))
        .collect();
    leads_ms.sort_unstable();
    let (least, most) = (leads_ms[0], leads_ms[leads_ms.len() - 1]);
    let quoted = format!("by a median of {least} to {most} ms");
    assert!(
        readme.contains(&quoted),
        "README.md does not say {quoted:?}"
    );
}

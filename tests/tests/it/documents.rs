//! Documents that programs write say what the programs of today would say: the same columns, the same rows, one commit for
//! what is quoted. A table that was left behind when its program changed fails here.

#[allow(dead_code, unused_must_use)]
mod readme_lines;

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

/// The summary and the README quote one run, that of the document.
#[test]
fn the_readme_quotes_the_speeds_at_hand() {
    let machine = |name: &str| {
        let text = document(name);
        let line = text.lines().find(|line| line.starts_with("CPU: "));
        line.map(str::to_owned).unwrap_or_else(|| panic!("{name}"))
    };
    assert_eq!(
        machine("docs/CRATES.md"),
        machine("docs/SPEED-AGAINST-ERROR.md")
    );
    let crates = document("docs/CRATES.md");
    let row = crates
        .lines()
        .map(cells)
        .find(|row| row.contains(&"control step, 9 upright pieces"))
        .expect("the control step in docs/CRATES.md");
    let quoted = format!("median {}, p99 {}<!-- control-step:end -->", row[3], row[4]);
    assert!(document("README.md").contains(&quoted), "{quoted}");
}

/// Bold figures of the front page stand in the document that is linked in their row.
#[test]
fn the_figures_of_the_readme_are_those_of_their_documents() {
    let readme = document("README.md");
    assert!(readme.chars().count() <= 7_000, "a front page is short");
    let rows = rows_below(&readme, "| question | figure | compared with | document |");
    assert_eq!(rows.len(), 5);
    let mut figures = 0;
    for row in rows {
        let link = row[4].split("](").nth(1).expect("a link");
        let path = link.split(')').next().unwrap();
        let text = document(path);
        for figure in row.join("|").split("**").skip(1).step_by(2) {
            figures += 1;
            assert!(text.contains(figure), "{path} does not say {figure:?}");
        }
    }
    assert!(figures >= 9, "{figures}");
}

/// How often boards are in place, as the front page says it.
#[test]
fn the_readme_quotes_the_times_at_hand() {
    let text = document("docs/IN-TIME.md");
    let rows = rows_below(&text, &in_time::document::table(&[]).to_string());
    let of_possible = |kind: &str| {
        let row = rows.iter().find(|row| row[1] == kind);
        row.unwrap_or_else(|| panic!("{kind}"))[6]
    };
    let quoted = format!(
        "plain people **{}** %, varied people **{}** %",
        of_possible("plain"),
        of_possible("varied")
    );
    assert!(document("README.md").contains(&quoted), "{quoted}");
}

#[test]
fn the_columns_of_touches_are_those_of_the_contract() {
    let header = document("docs/figures/hwall/touches.csv");
    let header = header.lines().next().unwrap();
    let commands = document("docs/COMMANDS.md").replace('\n', "");
    assert!(commands.contains(&format!("`{header}`")), "{header}");
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
    let mut pages = vec!["docs/ARCHITECTURE.md".into(), "docs/CONTRIBUTING.md".into()];
    pages.extend(pages_of_design());
    let mut files = Vec::new();
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    files_in(&crates, &mut files);
    let is_of_path = |c: char| c.is_ascii_alphanumeric() || "_/.".contains(c);
    let mut named = 0;
    for page in pages {
        let text = document(&page);
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
            assert!(is_there, "{page} names {name}");
        }
    }
    assert!(named > 120, "{named}");
}

/// The pages about designs, by their paths in the project.
fn pages_of_design() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/design");
    let entries = std::fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.map(|name| format!("docs/design/{name}")).collect()
}

/// A text without the blocks that programs write into it.
fn by_hand_of(text: &str) -> String {
    let mut parts = text.split("<!-- speed:begin -->");
    let mut by_hand = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (block, rest) = part.split_once("<!-- speed:end -->").expect("an end");
        for word in ["CPU: ", "commit ", "seed "] {
            assert!(block.contains(word), "no {word:?} in a block of numbers");
        }
        by_hand += rest;
    }
    by_hand
}

/// By hand, but for blocks between markers: everything else is written by a program.
const BY_HAND: [&str; 14] = [
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "COMMANDS.md",
    "CONTRIBUTING.md",
    "CRATES.md",
    "ENVIRONMENTS.md",
    "NOTATION.md",
    "PROTOCOL.md",
    "README.md",
    "REAL-ARM.md",
    "ROS.md",
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
        let is_example = examples.contains(&format!("name = \"{program}\""));
        let is_there = is_example || root.join(program).is_file();
        assert!(is_there, "docs/{name}: there is no {program}");
        for word in ["CPU: ", "commit ", "seed "] {
            assert!(head.contains(word), "docs/{name}: no {word:?} in its head");
        }
    }
    assert!(by_program >= 10, "{by_program}");
    let by_hand = BY_HAND.iter().map(|name| format!("docs/{name}"));
    for page in by_hand.chain(pages_of_design()) {
        let text = by_hand_of(&document(&page));
        assert!(!text.contains("CPU: "), "{page}");
    }
}

/// README and contract say how much earlier the fused predictor is in rooms of several surfaces: the medians of the study.
#[test]
fn the_study_that_is_quoted_is_the_one_at_hand() {
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
    for page in ["README.md", "docs/COMMANDS.md"] {
        let text = document(page).replace('\n', " ").replace("**", "");
        assert!(text.contains(&quoted), "{page} does not say {quoted:?}");
    }
}

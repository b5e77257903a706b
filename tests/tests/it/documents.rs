//! Documents that programs write say what the programs of today would say: the same columns, the same rows, one commit for
//! what is quoted. A table that was left behind when its program changed fails here.

#[allow(dead_code, unused_must_use)]
mod readme_lines;

use crate::common::files::{entries, files_below, root, text as document};
use hwall_lab::attack::findings;
use hwall_lab::faults::fault::Fault;
use hwall_lab::{feel, in_time};
use hwall_stage::person::kinds::PersonKind;

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
        let told = text.lines().any(|line| cells(line).contains(&&*name));
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
    let crates = document("docs/CRATES.md");
    let speeds = machine("docs/SPEED-AGAINST-ERROR.md");
    assert_eq!(machine("docs/CRATES.md"), speeds);
    let step = "control step, 9 upright pieces";
    let row = crates.lines().map(cells).find(|row| row.contains(&step));
    let row = row.expect("the control step in docs/CRATES.md");
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
    let [plain, varied] = ["plain", "varied"].map(of_possible);
    let quoted = format!("plain people **{plain}** %, varied people **{varied}** %");
    assert!(document("README.md").contains(&quoted), "{quoted}");
}

#[test]
fn the_columns_of_touches_are_those_of_the_contract() {
    let header = document("docs/figures/hwall/touches.csv");
    let header = header.lines().next().unwrap();
    let commands = document("docs/COMMANDS.md").replace('\n', "");
    assert!(commands.contains(&format!("`{header}`")), "{header}");
}

/// Files move: what is written about them goes along, or this fails.
#[test]
fn the_files_of_the_architecture_are_there() {
    let mut pages = ["docs/ARCHITECTURE.md", "docs/CONTRIBUTING.md"]
        .map(String::from)
        .to_vec();
    pages.extend(pages_in("docs/design"));
    let files = files_below(&root().join("crates"), "rs");
    let is_of_path = |c: char| c.is_ascii_alphanumeric() || "_/.".contains(c);
    let mut named = 0;
    for page in pages {
        let text = document(&page);
        let words = text.split(|c| !is_of_path(c));
        for name in words.filter(|word| word.ends_with(".rs")) {
            named += 1;
            let is_of_crates = files.iter().any(|path| path.ends_with(name));
            let is_there = is_of_crates || root().join(name).is_file();
            assert!(is_there, "{page} names {name}");
        }
    }
    assert!(named > 120, "{named}");
}

/// The pages of a folder, by their paths in the project.
fn pages_in(folder: &str) -> Vec<String> {
    let paths = entries(&root().join(folder)).into_iter();
    let names = paths.map(|path| path.file_name().unwrap().to_str().unwrap().to_owned());
    let pages = names.filter(|name| name.ends_with(".md"));
    pages.map(|name| format!("{folder}/{name}")).collect()
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
const BY_HAND: &str = "ARCHITECTURE CHANGELOG COMMANDS CONTRIBUTING CRATES ENVIRONMENTS NOTATION PROTOCOL README \
                       REAL-ARM ROS SAFETY SIMULATORS STUDY";

#[test]
fn documents_of_numbers_name_their_command_commit_and_seed() {
    let examples = document("examples/Cargo.toml") + &document("crates/lab/Cargo.toml");
    let mut by_program = 0;
    let by_hand = BY_HAND.split(' ').map(|name| format!("docs/{name}.md"));
    let by_hand: Vec<String> = by_hand.collect();
    for page in pages_in("docs") {
        if by_hand.contains(&page) {
            continue;
        }
        by_program += 1;
        let text = document(&page);
        let head: Vec<&str> = text.lines().take(8).collect();
        let head = head.join("\n");
        let (_, command) = head
            .split_once("Written by `")
            .unwrap_or_else(|| panic!("{page} does not say by which command it was written"));
        let command = command.split('`').next().unwrap();
        let words = command.strip_prefix("cargo run --release --example ");
        let program = words.unwrap_or(command).split(' ').next().unwrap();
        let is_example = examples.contains(&format!("name = \"{program}\""));
        let is_there = is_example || root().join(program).is_file();
        assert!(is_there, "{page}: there is no {program}");
        for word in ["CPU: ", "commit ", "seed "] {
            assert!(head.contains(word), "{page}: no {word:?} in its head");
        }
    }
    assert!(by_program >= 10, "{by_program}");
    for page in by_hand.into_iter().chain(pages_in("docs/design")) {
        let text = by_hand_of(&document(&page));
        assert!(!text.contains("CPU: "), "{page}");
    }
}

/// README and contract say how much earlier the fused predictor is in rooms of several surfaces: the medians of the study.
#[test]
fn the_study_that_is_quoted_is_the_one_at_hand() {
    let study = document("docs/CONTACT-STUDY.md");
    let header = "surfaces | touches";
    let rows = study.lines();
    let rows = rows.skip_while(|line| !cells(line).join(" | ").contains(header));
    let rows = rows.skip(2).take_while(|line| line.starts_with('|'));
    let rows = rows.map(cells).filter(|row| row[1] != "1");
    let leads_ms = rows.map(|row| row[row.len() - 2].parse().expect("a lead, ms"));
    let mut leads_ms: Vec<u32> = leads_ms.collect();
    leads_ms.sort_unstable();
    let (least, most) = (leads_ms[0], leads_ms[leads_ms.len() - 1]);
    let quoted = format!("by a median of {least} to {most} ms");
    for page in ["README.md", "docs/COMMANDS.md"] {
        let text = document(page).replace('\n', " ").replace("**", "");
        assert!(text.contains(&quoted), "{page} does not say {quoted:?}");
    }
}

//! Command lines that lost data, ended in a panic or said nothing, and a shell that runs them.

use crate::common::files::{empty_folder, root};
use hwall_texton::HeightField;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const ROWS: usize = 3000;

/// The command of a line that begins with an example; `None` where this test runs without the examples having been built.
fn example(line: &str) -> Option<Command> {
    let mut words = line.split_whitespace();
    let name = words.next()?;
    let here = std::env::current_exe().ok()?;
    let path = here.parent()?.parent()?.join("examples").join(name);
    if path.is_file() {
        let mut command = Command::new(path);
        command.args(words);
        return Some(command);
    }
    println!("skipped: the example {name} is not built");
    None
}

/// The command of a line; the test ends where the example is not built.
macro_rules! built {
    ($line:expr) => {
        match example($line) {
            Some(command) => command,
            None => return,
        }
    };
}

fn scratch(name: &str) -> PathBuf {
    empty_folder(&format!("command_lines/{name}"))
}

fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let file = folder.join(name);
    std::fs::write(&file, text).unwrap();
    file
}

fn table(header: &str, row: &str) -> String {
    format!("{header}\n{}", format!("{row}\n").repeat(ROWS))
}

/// What a command prints on standard output and on standard error; it ends with a status.
fn ended(command: &mut Command, status: i32) -> [String; 2] {
    let output = command.stdin(Stdio::null()).output().unwrap();
    let texts = [output.stdout, output.stderr];
    let [out, error] = texts.map(|text| String::from_utf8_lossy(&text).into_owned());
    assert_eq!(output.status.code(), Some(status), "{command:?}: {error}");
    [out, error]
}

fn refused(command: &mut Command, because: &[&str]) {
    let [_, error] = ended(command, 2);
    assert_eq!(error.lines().count(), 1, "{error}");
    assert!(error.len() < 1200, "{} bytes", error.len());
    for word in because {
        assert!(error.contains(word), "{word}: {error}");
    }
}

const JOINTS: &str = "q1,q2,q3,q4,q5,q6,q7";
const ANGLES: &str = "0.1,0.2,0.3,0.4,0.5,0.6,0.7";
const POSE: &str = "px,py,pz,qw,qx,qy,qz";
const PLACE: &str = "0.5,0,0.6,0.7071,0,0.7071,0";
/// Answers of three subjects at two levels of a factor.
const ANSWERS: &str = "s,a,y\n1,x,1\n1,z,2\n2,x,2\n2,z,4\n3,x,1\n3,z,5\n";

/// A chapter alone would have replaced the whole document.
#[test]
fn one_chapter_is_not_written_over_the_tracked_document() {
    let mut thesis = built!("thesis --docs --chapter 4");
    refused(thesis.current_dir(root()), &["--chapter", "--docs"]);
}

/// 5,000 rows were 390 afterwards.
#[test]
fn an_output_that_is_the_input_is_refused_and_nothing_is_lost() {
    let mut arm_state = built!("arm_state --in z.csv --out z.csv");
    let (folder, text) = (scratch("same"), table(JOINTS, ANGLES));
    let file = write(&folder, "z.csv", &text);
    refused(arm_state.current_dir(folder), &["--in", "--out"]);
    assert_eq!(std::fs::read_to_string(file).unwrap(), text);
}

/// A row that cannot be read destroyed what stood there before.
#[test]
fn a_failing_run_leaves_the_good_file() {
    let mut arm_state = built!("arm_state --in bad.csv --out out.csv");
    let folder = scratch("failing");
    write(&folder, "bad.csv", &(table(JOINTS, ANGLES) + "1,2\n"));
    let out = write(&folder, "out.csv", "good\n");
    refused(arm_state.current_dir(&folder), &["line 3002"]);
    assert_eq!(std::fs::read_to_string(out).unwrap(), "good\n");
    assert_eq!(std::fs::read_dir(folder).unwrap().count(), 2);
}

/// `| head -1` ended with status 2.
#[test]
fn a_reader_that_goes_away_is_no_error() {
    for (line, header, row) in [
        ("arm_state --in in.csv", JOINTS, ANGLES),
        ("reach_check --in in.csv", POSE, PLACE),
    ] {
        let mut command = built!(line);
        let folder = scratch("reader");
        write(&folder, "in.csv", &table(header, row));
        let command = command.current_dir(folder).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        drop(child.stdout.take());
        assert_eq!(child.wait().unwrap().code(), Some(0), "{line}");
    }
}

/// `qd2` without `qd1` was passed over.
#[test]
fn rates_of_some_joints_only_are_named() {
    let mut arm_state = built!("arm_state --dynamics --in in.csv");
    let folder = scratch("rates");
    write(&folder, "in.csv", &format!("{JOINTS},qd2\n{ANGLES},1\n"));
    refused(arm_state.current_dir(folder), &["qd1"]);
}

/// Lines of a megabyte were repeated.
#[test]
fn long_inputs_are_cut_in_messages() {
    let mut arm_state = built!("arm_state --in in.csv");
    let (folder, long) = (scratch("long"), "a".repeat(1 << 20));
    write(
        &folder,
        "in.csv",
        &format!("{JOINTS}\n{long},1,1,1,1,1,1\n"),
    );
    let because = ["line 2", "q1", "not a finite number"];
    refused(arm_state.current_dir(folder), &because);
}

/// The output folder was looked at after minutes of work.
#[test]
fn outputs_that_cannot_be_written_are_named_first() {
    let folder = scratch("outputs");
    write(&folder, "file", "");
    write(&folder, "touches.csv", "t\n");
    for (line, because) in [
        ("hwall --out file", &["--out"][..]),
        ("hwall --hand touches.csv --out .", &["--out", "--hand"]),
    ] {
        refused(built!(line).current_dir(&folder), because);
    }
}

/// The recording was begun after training and maps, and over whatever stood there.
#[test]
fn recordings_are_looked_at_before_the_run() {
    let folder = scratch("recordings");
    let good = "x,y\n";
    let files = ["hand.csv", "arm.urdf"].map(|name| write(&folder, name, good));
    std::fs::create_dir(folder.join("taken")).unwrap();
    for (line, because) in [
        ("--hand hand.csv --mcap hand.csv", ["--mcap", "--hand"]),
        // The arm's capsules go beside the recording.
        ("--arm arm.urdf --mcap arm.mcap", ["--mcap", "--arm"]),
        ("--mcap missing/run.mcap", ["--mcap", "missing/run.mcap"]),
        ("--mcap taken", ["--mcap", "folder"]),
        ("--mcap run.urdf", ["--mcap", "beside"]),
        ("--json run.mcap --mcap run.mcap", ["--mcap", "--json"]),
        ("--replay missing.mcap", ["missing.mcap", "No such"]),
    ] {
        let mut hwall = built!(&format!("hwall {line}"));
        refused(hwall.current_dir(&folder), &because);
    }
    for file in files {
        assert_eq!(std::fs::read_to_string(file).unwrap(), good);
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
}

/// `ensemble:99999999999` aborted, other counts never ended; 1e-320 printed NaN; flags of an arm that is not led meant nothing.
#[test]
fn flags_have_bounds() {
    for line in [
        "bip_filter --mode ensemble:99999999999",
        "contact_study --people 99999999999",
        "contact_study --reaches 0",
        "psychophysics design --factors 2x2 --subjects 99999999999",
        "psychophysics power --factors 2x2 --subjects 10 --studies 99999999999",
        "reach_map --starts 99999999999",
        "arm_simulate --gravity-only --step 1e-12",
        "validation --poses 99999999999",
        "study --simulate 2 --room room.toml",
        "study --run study --watch-frozen",
    ] {
        ended(&mut built!(line), 2);
    }
    let line =
        "psychophysics analyse study.csv --subject s --factors a --value y --confidence 1e-320";
    let folder = scratch("flags");
    write(&folder, "study.csv", ANSWERS);
    refused(built!(line).current_dir(folder), &["confidence"]);
}

/// A full device ended in a panic.
#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_an_error_and_no_panic() {
    for line in [
        "arm_state --in in.csv",
        "psychophysics design --factors 2x2 --subjects 4",
        "texture_patch --preset released",
        "study --simulate 2 --factors angle --levels 0,90 --once",
    ] {
        let mut command = built!(line);
        let folder = scratch("full");
        write(&folder, "in.csv", &table(JOINTS, ANGLES));
        let full = std::fs::File::options().write(true).open("/dev/full");
        let command = command.current_dir(folder).stdout(full.unwrap());
        let status = command.stderr(Stdio::null()).status().unwrap();
        assert_eq!(status.code(), Some(2), "{line}");
    }
}

/// With `| head -1` the mesh and the figures were missing, with status 0.
#[test]
fn files_are_written_whoever_reads_what_is_printed() {
    let folder = scratch("read-by-nobody");
    let line = "texture_patch --size-mm 20 --stl patch.stl --obj patch.obj --out figures";
    let mut command = built!(line);
    let command = command.current_dir(&folder).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let files = "patch.stl patch.obj figures/texture_patch.svg figures/texture_spacing.svg";
    for file in files.split(' ') {
        assert!(folder.join(file).is_file(), "{file}");
    }
}

/// Command lines, and what their refusals say.
const REFUSALS: &str = "
hwall --hand a.csv --touches 5 => --hand | --touches
hwall --rigid-hand => --hand
hwall --touches -3 => -3 | --touches | 1 to 100000
hwall --trial 1 => --hand
in_time --seed -1 => -1 | --seed
in_time --recordings a.csv => --panels
in_time --recordings missing.csv --panels missing.csv => --recordings | missing.csv
bridge --seconds -1 => --seconds | above 0
bridge --scene missing.obj => missing.obj
bridge --record missing/a.mcap => --record | folder
iiwa_simulator --mode torque => --mode torque | --level torque
arm_simulate --gravity-only --duration -1 => --duration | above 0
texture_patch --accuracy-um 0 => --accuracy-um | 1 to 1000
psychophysics design --factors 0x5 --subjects 4 => --factors 0x5 | two or more
psychophysics analyse a.csv --subject s --factors a => --value
study --seed 1 => --simulate <N> | --run <DIR>
study --simulate 2 --procedure staircase --factors angle --levels 30,90 => --levels | --procedure staircase | three levels
study --simulate 2 --procedure quest --factors angle,speed --levels 30,60,90/20,40,60 => --procedure quest | one factor
base_placement --budget-s 0.5 => --budget-s | --objective arrival
base_placement --behind-m near => --behind-m | neither a finite number nor any
validation --published missing => --published missing | not part of the project";

/// Each of these said nothing, named no flag, or not the bound.
#[test]
fn refusals_name_the_flag_and_the_bound() {
    for row in REFUSALS.trim_start().lines() {
        let (line, because) = row.split_once(" => ").unwrap();
        let mut command = built!(line);
        let [printed, error] = ended(command.current_dir(scratch("refusals")), 2);
        assert!(printed.is_empty(), "{line} printed before it refused");
        for word in because.split(" | ") {
            assert!(error.contains(word), "{line}: no {word:?} in {error}");
        }
    }
}

/// The address was printed before flags were looked at, and Ctrl-C during the preparation said nothing.
#[cfg(unix)]
#[test]
fn a_bridge_that_is_stopped_before_it_recorded_says_so() {
    let mut bridge = built!("bridge --listen 127.0.0.1:0 --record a.mcap");
    let folder = scratch("stopped");
    bridge.current_dir(&folder);
    bridge.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = bridge.spawn().unwrap();
    let mut first = String::new();
    let out = child.stdout.take().unwrap();
    std::io::BufRead::read_line(&mut std::io::BufReader::new(out), &mut first).unwrap();
    assert!(first.starts_with("open http://"), "{first}");
    let number = child.id().to_string();
    ended(Command::new("kill").args(["-INT", &number]), 0);
    let output = child.wait_with_output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{error}");
    assert!(error.contains("there is no a.mcap"), "{error}");
    assert!(!folder.join("a.mcap").exists());
}

/// Without flags the best base stood in the plane of a wall: the arm would have come through it.
#[test]
fn the_base_stands_behind_the_walls_it_serves() {
    let folder = scratch("placement");
    let wall = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n";
    write(&folder, "wall.obj", wall);
    let best_x = |more: &str| {
        let of_wall = "--scene wall.obj --grid-m 0.05 --spacing-m 0.3 --headings 2 --out out";
        let mut command = example(&format!("base_placement {of_wall} {more}"))?;
        ended(command.current_dir(&folder), 0);
        let table = std::fs::read_to_string(folder.join("out/placements.csv")).unwrap();
        let rows = table.lines().skip(1);
        let xs = rows.map(|row| row.split(',').next().unwrap().parse::<f64>().unwrap());
        Some(xs.fold(f64::NEG_INFINITY, f64::max))
    };
    // The wall faces +x: behind it is where x is smaller.
    let Some(nominal) = best_x("") else {
        return;
    };
    assert!(nominal <= 0.4 + 1e-9, "{nominal}");
    let far = best_x("--behind-m 0.5").unwrap();
    assert!(far <= 0.1 + 1e-9, "{far}");
    let any = best_x("--behind-m any").unwrap();
    assert!(any > 0.6, "{any}");
}

/// The column `valid` of a study's own table was ignored; wide tables asked for the name of a column that they do not have.
#[test]
fn tables_of_studies_are_analysed_as_they_are_written() {
    let folder = scratch("tables_of_studies");
    let mut long = "subject,angle,answer,valid,why_not\n".to_owned();
    let mut wide = "subject,angle_0,angle_90\n".to_owned();
    for subject in 1..7 {
        let (a, b) = (subject * 7 % 5 + 1, subject * 3 % 5 + 4);
        long +=
            &format!("{subject},0,{a},true,\n{subject},90,{b},true,\n{subject},0,99,false,late\n");
        wide += &format!("{subject},{a},{b}\n");
    }
    write(&folder, "long.csv", &long);
    write(&folder, "wide.csv", &wide);
    let said = |table: &str| {
        let line = format!("psychophysics analyse {table} --subject subject --factors angle");
        let [text, _] = ended(example(&line)?.current_dir(&folder), 0);
        Some(text)
    };
    let Some(long) = said("long.csv --value answer") else {
        return;
    };
    let left_out = "6 rows are left out because they are not valid.";
    assert!(long.contains(left_out), "{long}");
    let wide = said("wide.csv --wide _").unwrap();
    let rest = |text: &str| text.split_once("## ").map(|(_, rest)| rest.to_owned());
    assert_eq!(rest(&long), rest(&wide));
    let has_size = long.contains("partial omega squared");
    assert!(has_size && !long.contains("Strata"), "{long}");
}

/// A column `valid` of other numbers could not be refused.
#[test]
fn a_column_that_says_nothing_of_rows_can_be_refused() {
    let folder = scratch("own_valid");
    let mut table = "subject,angle,answer,valid\n".to_owned();
    for subject in 1..7 {
        let (a, b) = (subject * 7 % 5 + 1, subject * 3 % 5 + 4);
        table += &format!("{subject},0,{a},0.93\n{subject},90,{b},ok\n");
    }
    write(&folder, "study.csv", &table);
    let line = "psychophysics analyse study.csv --value answer --subject subject --factors angle";
    let mut analyse = built!(line);
    refused(analyse.current_dir(folder), &["\"0.93\"", "--valid none"]);
    let [text, _] = ended(analyse.args(["--valid", "none"]), 0);
    assert!(!text.contains("left out"), "{text}");
}

/// Some took `--in`, some a name alone, one standard input only.
#[test]
fn tables_come_by_flag_by_name_and_by_standard_input() {
    let folder = scratch("inputs");
    let torques = "t,tau1,tau2,tau3,tau4,tau5,tau6,tau7\n0,1,0,0,0,0,0,0\n";
    let push = "t,force_n\n0,1\n0.5,0\n";
    for (line, table) in [
        ("arm_state", &*format!("{JOINTS}\n{ANGLES}\n")),
        ("reach_check", &format!("{POSE}\n{PLACE}\n")),
        ("object_response --object button --mass 0.1", push),
        ("arm_simulate --duration 0.02", torques),
        (
            "psychophysics analyse --subject s --factors a --value y",
            ANSWERS,
        ),
    ] {
        let file = write(&folder, "in.csv", table);
        let said = |more: &[&str], input: Stdio| {
            let mut command = example(line)?;
            let output = command.args(more).stdin(input).output().unwrap();
            let error = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{line} {more:?}: {error}");
            Some(output.stdout)
        };
        let path = file.to_str().unwrap();
        let open = Stdio::from(std::fs::File::open(&file).unwrap());
        let Some(by_standard_input) = said(&[], open) else {
            return;
        };
        assert!(!by_standard_input.is_empty(), "{line}");
        for more in [&["--in", path][..], &[path]] {
            let by_file = said(more, Stdio::null());
            assert_eq!(by_file.as_ref(), Some(&by_standard_input), "{line}");
        }
        ended(built!(line).args(["--in", path, path]), 2);
    }
}

/// `--out` of the one tool that had none.
#[test]
fn a_simulated_motion_goes_to_a_file() {
    let mut arm_simulate = built!("arm_simulate --gravity-only --duration 0.02 --out");
    let out = scratch("motion").join("out.csv");
    let [printed, _] = ended(arm_simulate.arg(&out), 0);
    assert!(printed.is_empty());
    assert_eq!(std::fs::read_to_string(&out).unwrap().lines().count(), 4);
}

/// The folder of a study was made before the address of its page was tried.
#[test]
fn a_study_that_cannot_begin_leaves_no_folder() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let folder = scratch("study").join("new");
    for line in [
        &*format!("study --page {address} --run"),
        "study --factors angle,angle --run",
        &format!("study --fri 127.0.0.1:0 --hands {address} --run"),
    ] {
        refused(built!(line).arg(&folder), &[]);
        assert!(!folder.exists(), "{line}");
    }
    // One that can says that it is new, in case its name was mistyped.
    let mut study = built!("study --subjects 2 --run");
    let text = study
        .arg(&folder)
        .stdin(Stdio::null())
        .output()
        .unwrap()
        .stdout;
    let text = String::from_utf8_lossy(&text);
    assert!(text.contains("a new study begins, of 2 subjects"), "{text}");
}

/// Files of a search by arrival stayed beside those of one by coverage.
#[test]
fn a_search_by_coverage_leaves_nothing_by_arrival() {
    let line = "base_placement --spacing-m 0.5 --grid-m 0.5 --out";
    let out = scratch("coverage");
    for name in ["arrival.svg", "placements_by_arrival.csv", "mine.svg"] {
        write(&out, name, "old");
    }
    let [said, _] = ended(built!(line).arg(&out), 0);
    assert!(said.contains("removed"), "{said}");
    let left = |name: &str| out.join(name).exists();
    assert!(left("placements.csv") && left("mine.svg"));
    assert!(!left("arrival.svg") && !left("placements_by_arrival.csv"));
    // Without such placements the figure is that of `arrival_map`, and stays.
    write(&out, "arrival.svg", "of the map");
    ended(built!(line).arg(&out), 0);
    assert!(left("arrival.svg"));
}

/// Programs of minutes, with small sizes: they end, and write what they say.
#[test]
fn small_studies_walks_and_proposals_run_from_the_command_line() {
    let folder = scratch("small");
    let waves = |k: usize| {
        let [x, y] = [k % 64, k / 64].map(|i| (std::f64::consts::TAU * i as f64 / 16.0).sin());
        (0.03 * (x + y)) as f32
    };
    let oak = HeightField::new(64, 0.025, (0..64 * 64).map(waves).collect()).unwrap();
    oak.write_exr(folder.join("oak.exr")).unwrap();
    let walk = "hwall --base drives --touches 1 --predictor ray-led --out walk --json walk.json";
    let assign = "texture_assign oak.exr --sidecar oak.toml";
    let others = [
        (walk, "| both | 1 |", "walk.json walk/replay.html"),
        (assign, "created oak.toml", "oak.toml"),
    ];
    let others = others.map(|(line, says, files)| (line.to_owned(), says, files.to_owned()));
    let protocols = "experiment-1 experiment-2 preliminary roughness cones".split(' ');
    let studies = protocols.map(|name| {
        let line =
            format!("study --simulate 2 --once --repeats 1 --protocol thesis:{name} --out {name}");
        (line, "## ", format!("{name}/report.md"))
    });
    for (line, says, files) in studies.chain(others) {
        let [said, _] = ended(built!(&line).current_dir(&folder), 0);
        assert!(said.contains(says), "{line}: {said}");
        for file in files.split(' ') {
            let written = folder.join(file).metadata();
            assert!(written.is_ok_and(|of| of.len() > 0), "{file}");
        }
    }
}

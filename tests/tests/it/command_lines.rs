//! Command lines that lost data, ended in a panic or said nothing, and a shell that runs them.

use hwall_texton::HeightField;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const ROWS: usize = 3000;

/// A built example; `None` where this test runs without the examples having been built.
fn example(name: &str) -> Option<Command> {
    let here = std::env::current_exe().ok()?;
    let path = here.parent()?.parent()?.join("examples").join(name);
    if path.is_file() {
        return Some(Command::new(path));
    }
    println!("skipped: the example {name} is not built");
    None
}

/// A built example; the test ends where there is none.
macro_rules! built {
    ($name:expr) => {
        match example($name) {
            Some(command) => command,
            None => return,
        }
    };
}

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("command_lines")
        .join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
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

/// The words of a command line without quotes.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split_whitespace()
}

const JOINTS: &str = "q1,q2,q3,q4,q5,q6,q7";
const POSE: &str = "0.1,0.2,0.3,0.4,0.5,0.6,0.7";

/// A chapter alone would have replaced the whole document.
#[test]
fn one_chapter_is_not_written_over_the_tracked_document() {
    let mut thesis = built!("thesis");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    thesis.current_dir(root).args(["--docs", "--chapter", "4"]);
    refused(&mut thesis, &["--chapter", "--docs"]);
}

/// 5,000 rows were 390 afterwards.
#[test]
fn an_output_that_is_the_input_is_refused_and_nothing_is_lost() {
    let mut arm_state = built!("arm_state");
    let file = scratch("same").join("z.csv");
    let text = table(JOINTS, POSE);
    std::fs::write(&file, &text).unwrap();
    arm_state.arg("--in").arg(&file).arg("--out").arg(&file);
    refused(&mut arm_state, &["--in", "--out"]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
}

/// A row that cannot be read destroyed what stood there before.
#[test]
fn a_failing_run_leaves_the_good_file() {
    let mut arm_state = built!("arm_state");
    let folder = scratch("failing");
    let (bad, out) = (folder.join("bad.csv"), folder.join("out.csv"));
    std::fs::write(&bad, table(JOINTS, POSE) + "1,2\n").unwrap();
    std::fs::write(&out, "good\n").unwrap();
    arm_state.arg("--in").arg(&bad).arg("--out").arg(&out);
    refused(&mut arm_state, &["line 3002"]);
    assert_eq!(std::fs::read_to_string(&out).unwrap(), "good\n");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
}

/// `| head -1` ended with status 2.
#[test]
fn a_reader_that_goes_away_is_no_error() {
    let poses = "px,py,pz,qw,qx,qy,qz";
    for (name, header, row) in [
        ("arm_state", JOINTS, POSE),
        ("reach_check", poses, "0.5,0,0.6,0.7071,0,0.7071,0"),
    ] {
        let mut command = built!(name);
        let file = scratch(name).join("in.csv");
        std::fs::write(&file, table(header, row)).unwrap();
        command.arg("--in").arg(&file);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        assert_eq!(child.wait().unwrap().code(), Some(0), "{name}");
    }
}

/// `qd2` without `qd1` was passed over.
#[test]
fn rates_of_some_joints_only_are_named() {
    let mut arm_state = built!("arm_state");
    let file = scratch("rates").join("in.csv");
    std::fs::write(&file, format!("{JOINTS},qd2\n{POSE},1\n")).unwrap();
    arm_state.arg("--dynamics").arg("--in").arg(&file);
    refused(&mut arm_state, &["qd1"]);
}

/// Lines of a megabyte were repeated.
#[test]
fn long_inputs_are_cut_in_messages() {
    let mut arm_state = built!("arm_state");
    let file = scratch("long").join("in.csv");
    std::fs::write(
        &file,
        format!("{JOINTS}\n{},1,1,1,1,1,1\n", "a".repeat(1 << 20)),
    )
    .unwrap();
    arm_state.arg("--in").arg(&file);
    refused(&mut arm_state, &["line 2", "q1", "not a finite number"]);
}

/// The output folder was looked at after minutes of work.
#[test]
fn outputs_that_cannot_be_written_are_named_first() {
    let mut hwall = built!("hwall");
    let folder = scratch("outputs");
    let file = folder.join("file");
    std::fs::write(&file, "").unwrap();
    hwall.arg("--out").arg(&file);
    refused(&mut hwall, &["--out"]);
    let mut hwall = built!("hwall");
    hwall
        .args(["--hand", "touches.csv", "--out", "."])
        .current_dir(&folder);
    std::fs::write(folder.join("touches.csv"), "t\n").unwrap();
    refused(&mut hwall, &["--out", "--hand"]);
}

/// The recording was begun after training and maps, and over whatever stood there.
#[test]
fn recordings_are_looked_at_before_the_run() {
    let folder = scratch("recordings");
    let good = "x,y\n";
    std::fs::write(folder.join("hand.csv"), good).unwrap();
    std::fs::write(folder.join("arm.urdf"), good).unwrap();
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
        let mut hwall = built!("hwall");
        refused(hwall.args(words(line)).current_dir(&folder), &because);
    }
    for name in ["hand.csv", "arm.urdf"] {
        assert_eq!(std::fs::read_to_string(folder.join(name)).unwrap(), good);
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
}

/// `ensemble:99999999999` aborted, other counts never ended; 1e-320 printed NaN; flags of an arm that is not led meant nothing.
#[test]
fn flags_have_bounds() {
    for (name, line) in [
        ("bip_filter", "--mode ensemble:99999999999"),
        ("contact_study", "--people 99999999999"),
        ("contact_study", "--reaches 0"),
        (
            "psychophysics",
            "design --factors 2x2 --subjects 99999999999",
        ),
        (
            "psychophysics",
            "power --factors 2x2 --subjects 10 --studies 99999999999",
        ),
        ("reach_map", "--starts 99999999999"),
        ("arm_simulate", "--gravity-only --step 1e-12"),
        ("validation", "--poses 99999999999"),
        ("study", "--simulate 2 --room room.toml"),
        ("study", "--run study --watch-frozen"),
    ] {
        ended(built!(name).args(words(line)), 2);
    }
    let mut analyse = built!("psychophysics");
    let file = scratch("flags").join("study.csv");
    let rows =
        (0..6).flat_map(|s| [0, 1].map(|level| format!("s{s},{level},{}\n", s * 3 % 5 + level)));
    let text: String = std::iter::once("subject,a,value\n".to_owned())
        .chain(rows)
        .collect();
    std::fs::write(&file, text).unwrap();
    analyse.arg("analyse").arg(&file);
    analyse.args(words(
        "--subject subject --factors a --value value --confidence 1e-320",
    ));
    refused(&mut analyse, &["confidence"]);
}

/// A full device ended in a panic.
#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_an_error_and_no_panic() {
    for (name, line) in [
        ("arm_state", "--in in.csv"),
        ("psychophysics", "design --factors 2x2 --subjects 4"),
        ("texture_patch", "--preset released"),
        ("study", "--simulate 2 --factors angle --levels 0,90 --once"),
    ] {
        let mut command = built!(name);
        let folder = scratch("full");
        std::fs::write(folder.join("in.csv"), table(JOINTS, POSE)).unwrap();
        let full = std::fs::File::options()
            .write(true)
            .open("/dev/full")
            .unwrap();
        command.args(words(line)).current_dir(&folder);
        let status = command.stdout(full).stderr(Stdio::null()).status().unwrap();
        assert_eq!(status.code(), Some(2), "{name}");
    }
}

/// With `| head -1` the mesh and the figures were missing, with status 0.
#[test]
fn files_are_written_whoever_reads_what_is_printed() {
    let folder = scratch("read-by-nobody");
    let line = "--size-mm 20 --stl patch.stl --obj patch.obj --out figures";
    let mut command = built!("texture_patch");
    command.args(words(line)).current_dir(&folder);
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let files = [
        "patch.stl",
        "patch.obj",
        "figures/texture_patch.svg",
        "figures/texture_spacing.svg",
    ];
    for file in files {
        assert!(folder.join(file).is_file(), "{file}");
    }
}

/// Each of these said nothing, named no flag, or not the bound.
#[test]
fn refusals_name_the_flag_and_the_bound() {
    for (name, line, because) in [
        (
            "hwall",
            "--hand a.csv --touches 5",
            &["--hand", "--touches"][..],
        ),
        ("hwall", "--rigid-hand", &["--hand"]),
        ("hwall", "--touches -3", &["-3", "--touches", "1 to 100000"]),
        ("in_time", "--seed -1", &["-1", "--seed"]),
        ("in_time", "--recordings a.csv", &["--panels"]),
        (
            "in_time",
            "--recordings missing.csv --panels missing.csv",
            &["--recordings", "missing.csv"],
        ),
        ("bridge", "--seconds -1", &["--seconds", "above 0"]),
        ("bridge", "--scene missing.obj", &["missing.obj"]),
        ("bridge", "--record missing/a.mcap", &["--record", "folder"]),
        (
            "iiwa_simulator",
            "--mode torque",
            &["--mode torque", "--level torque"],
        ),
        (
            "arm_simulate",
            "--gravity-only --duration -1",
            &["--duration", "above 0"],
        ),
        (
            "texture_patch",
            "--accuracy-um 0",
            &["--accuracy-um", "1 to 1000"],
        ),
        (
            "psychophysics",
            "design --factors 0x5 --subjects 4",
            &["--factors 0x5", "two or more"],
        ),
        (
            "study",
            "--simulate 2 --procedure staircase --factors angle --levels 30,90",
            &["--levels", "--procedure staircase", "three levels"],
        ),
        (
            "study",
            "--simulate 2 --procedure quest --factors angle,speed --levels 30,60,90/20,40,60",
            &["--procedure quest", "one factor"],
        ),
        (
            "base_placement",
            "--budget-s 0.5",
            &["--budget-s", "--objective arrival"],
        ),
        (
            "base_placement",
            "--behind-m near",
            &["--behind-m", "neither a finite number nor any"],
        ),
        ("study", "--seed 1", &["--simulate <N>", "--run <DIR>"]),
        (
            "psychophysics",
            "analyse a.csv --subject s --factors a",
            &["--value"],
        ),
        ("hwall", "--trial 1", &["--hand"]),
        (
            "validation",
            "--published missing",
            &["--published missing", "not part of the project"],
        ),
    ] {
        let mut command = built!(name);
        command.args(words(line)).current_dir(scratch("refusals"));
        let [printed, error] = ended(&mut command, 2);
        assert!(printed.is_empty(), "{name} printed before it refused");
        for word in because {
            assert!(error.contains(word), "{name}: no {word:?} in {error}");
        }
    }
}

/// The address was printed before flags were looked at, and Ctrl-C during the preparation said nothing.
#[cfg(unix)]
#[test]
fn a_bridge_that_is_stopped_before_it_recorded_says_so() {
    let mut bridge = built!("bridge");
    let folder = scratch("stopped");
    bridge
        .args(words("--listen 127.0.0.1:0 --record a.mcap"))
        .current_dir(&folder);
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
    std::fs::write(folder.join("wall.obj"), wall).unwrap();
    let best_x = |more: &str| {
        let mut command = example("base_placement")?;
        let line = "--scene wall.obj --grid-m 0.05 --spacing-m 0.3 --headings 2 --out out";
        command.args(words(line)).args(words(more));
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
    std::fs::write(folder.join("long.csv"), long).unwrap();
    std::fs::write(folder.join("wide.csv"), wide).unwrap();
    let said = |table: &str| {
        let mut command = example("psychophysics")?;
        let line = format!("analyse {table} --subject subject --factors angle");
        let [text, _] = ended(command.args(words(&line)).current_dir(&folder), 0);
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
    assert!(
        long.contains("partial omega squared") && !long.contains("Strata"),
        "{long}"
    );
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
    std::fs::write(folder.join("study.csv"), table).unwrap();
    let mut analyse = built!("psychophysics");
    let line = "analyse study.csv --value answer --subject subject --factors angle";
    analyse.args(words(line)).current_dir(&folder);
    refused(&mut analyse, &["\"0.93\"", "--valid none"]);
    let [text, _] = ended(analyse.args(["--valid", "none"]), 0);
    assert!(!text.contains("left out"), "{text}");
}

/// Some took `--in`, some a name alone, one standard input only.
#[test]
fn tables_come_by_flag_by_name_and_by_standard_input() {
    let folder = scratch("inputs");
    let put = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let answers = "s,a,y\n1,x,1\n1,z,2\n2,x,2\n2,z,4\n3,x,1\n3,z,5\n";
    for (name, line, table) in [
        ("arm_state", "", format!("{JOINTS}\n{POSE}\n")),
        (
            "reach_check",
            "",
            "px,py,pz,qw,qx,qy,qz\n0.5,0,0.6,0.7071,0,0.7071,0\n".to_owned(),
        ),
        (
            "object_response",
            "--object button --mass 0.1",
            "t,force_n\n0,1\n0.5,0\n".to_owned(),
        ),
        (
            "arm_simulate",
            "--duration 0.02",
            "t,tau1,tau2,tau3,tau4,tau5,tau6,tau7\n0,1,0,0,0,0,0,0\n".to_owned(),
        ),
        (
            "psychophysics",
            "analyse --subject s --factors a --value y",
            answers.to_owned(),
        ),
    ] {
        let file = put(name, &table);
        let said = |more: &[&str], input: Stdio| {
            let mut command = example(name)?;
            let output = command.args(words(line)).args(more).stdin(input).output();
            let output = output.unwrap();
            let error = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{name} {more:?}: {error}");
            Some(output.stdout)
        };
        let path = file.to_str().unwrap();
        let open = || Stdio::from(std::fs::File::open(&file).unwrap());
        let Some(by_standard_input) = said(&[], open()) else {
            return;
        };
        assert!(!by_standard_input.is_empty(), "{name}");
        for more in [&["--in", path][..], &[path]] {
            let by_file = said(more, Stdio::null());
            assert_eq!(by_file.as_ref(), Some(&by_standard_input), "{name}");
        }
        let mut both = example(name).unwrap();
        ended(both.args(words(line)).args(["--in", path, path]), 2);
    }
}

/// `--out` of the one tool that had none.
#[test]
fn a_simulated_motion_goes_to_a_file() {
    let mut arm_simulate = built!("arm_simulate");
    let out = scratch("motion").join("out.csv");
    arm_simulate.args(["--gravity-only", "--duration", "0.02", "--out"]);
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
    for more in [
        &["--page", &address][..],
        &["--factors", "angle,angle"],
        &["--fri", "127.0.0.1:0", "--hands", &address],
    ] {
        let mut study = built!("study");
        study.arg("--run").arg(&folder).args(more);
        refused(&mut study, &[]);
        assert!(!folder.exists(), "{more:?}");
    }
    // One that can says that it is new, in case its name was mistyped.
    let mut study = example("study").unwrap();
    study.arg("--run").arg(&folder).args(["--subjects", "2"]);
    let text = study.stdin(Stdio::null()).output().unwrap().stdout;
    let text = String::from_utf8_lossy(&text);
    assert!(text.contains("a new study begins, of 2 subjects"), "{text}");
}

/// Files of a search by arrival stayed beside those of one by coverage.
#[test]
fn a_search_by_coverage_leaves_nothing_by_arrival() {
    let mut base_placement = built!("base_placement");
    let out = scratch("coverage");
    for name in ["arrival.svg", "placements_by_arrival.csv", "mine.svg"] {
        std::fs::write(out.join(name), "old").unwrap();
    }
    let line = "--spacing-m 0.5 --grid-m 0.5 --out";
    let [said, _] = ended(base_placement.args(words(line)).arg(&out), 0);
    assert!(said.contains("removed"), "{said}");
    let left = |name: &str| out.join(name).exists();
    assert!(left("placements.csv") && left("mine.svg"));
    assert!(!left("arrival.svg") && !left("placements_by_arrival.csv"));
    // Without such placements the figure is that of `arrival_map`, and stays.
    std::fs::write(out.join("arrival.svg"), "of the map").unwrap();
    let mut again = example("base_placement").unwrap();
    ended(again.args(words(line)).arg(&out), 0);
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
    let protocols = [
        "experiment-1",
        "experiment-2",
        "preliminary",
        "roughness",
        "cones",
    ];
    let studies = protocols.map(|name| {
        let words =
            format!("--simulate 2 --once --repeats 1 --protocol thesis:{name} --out {name}");
        (
            "study",
            words,
            format!("{name}/report.md"),
            "## ".to_owned(),
        )
    });
    let walk = "--base drives --touches 1 --predictor ray-led --out walk --json walk.json";
    let assign = "oak.exr --sidecar oak.toml";
    let others = [
        ("hwall", walk, "walk.json walk/replay.html", "| both | 1 |"),
        ("texture_assign", assign, "oak.toml", "created oak.toml"),
    ];
    let others = others.map(|(name, words, files, says)| {
        (name, words.to_owned(), files.to_owned(), says.to_owned())
    });
    for (name, words, files, says) in studies.into_iter().chain(others) {
        let Some(mut command) = example(name) else {
            return;
        };
        command.args(words.split(' ')).current_dir(&folder);
        let output = command.stdin(Stdio::null()).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{words}: {error}");
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(said.contains(&says), "{words}: {said}");
        for file in files.split(' ') {
            let written = folder.join(file).metadata();
            assert!(written.is_ok_and(|of| of.len() > 0), "{file}");
        }
    }
}

//! Command lines that turn rows into rows: a reader that leaves, a row that is wrong, a motion that runs away.

use anyhow::Context;
use hwall_kinematics::{Chain, Wrench};
use hwall_sim::{ChainMotion, ChainMotionConfig, HeldTorques, Integrator, MotionSampling};
use hwall_stage::exit;
use hwall_stage::response::arm_motion::{ArmMotion, bodies};
use hwall_stage::response::object_motion::{ForceRows, ObjectKind, ObjectOptions, PushedObject};
use hwall_stage::response::torque_rows;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Takes so many bytes and is gone, as `head` is.
struct Leaving {
    left: usize,
    kind: ErrorKind,
}

impl Write for Leaving {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.left == 0 {
            return Err(self.kind.into());
        }
        let taken = bytes.len().min(self.left);
        self.left -= taken;
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn forces(name: &str, text: &str) -> ForceRows {
    let path: PathBuf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    ForceRows::open(Some(&path)).unwrap()
}

fn panel() -> PushedObject {
    let options = ObjectOptions {
        mass: Some(3.0),
        ..ObjectOptions::default()
    };
    PushedObject::from_options(ObjectKind::Panel, &options).unwrap()
}

fn falling(max_step_s: f64) -> ArmMotion {
    let config = ChainMotionConfig {
        integrator: Integrator::Rk4,
        ..ChainMotionConfig::default()
    };
    let bodies = bodies(&Chain::iiwa7()).unwrap();
    let start = [0.0, 0.5, 0.0, -1.2, 0.0, 0.8, 0.0];
    ArmMotion {
        motion: ChainMotion::new(bodies, &start, &[0.0; 7], config).unwrap(),
        wrench: Wrench::default(),
        sampling: MotionSampling {
            duration_s: 1.0,
            every_s: 0.001,
            max_step_s,
        },
    }
}

/// A status has no other way to be compared.
fn is_success(result: anyhow::Result<()>) -> bool {
    format!("{:?}", exit(result)) == format!("{:?}", ExitCode::SUCCESS)
}

/// The rows, each with as many cells as the header, all numbers.
fn whole_rows(text: &[u8]) -> usize {
    let text = std::str::from_utf8(text).unwrap();
    assert!(text.is_empty() || text.ends_with('\n'), "{text:?}");
    let mut lines = text.lines();
    let columns = lines.next().map_or(0, |header| header.split(',').count());
    let mut rows = 0;
    for line in lines {
        let numbers = line.split(',').map(|cell| cell.parse::<f64>().unwrap());
        let finite = numbers.filter(|v| v.is_finite()).count();
        assert_eq!(finite, columns, "{line}");
        rows += 1;
    }
    rows
}

#[test]
fn a_reader_that_leaves_is_no_error_and_a_full_disk_is() {
    let many: String = (0..2000).map(|i| format!("{i},1\n")).collect();
    let (leaves, full) = (ErrorKind::BrokenPipe, ErrorKind::StorageFull);
    for (kind, quiet) in [(leaves, true), (full, false)] {
        for left in [0, 100, 9000] {
            let writer = || csv::Writer::from_writer(BufWriter::new(Leaving { left, kind }));
            let mut input = forces(&format!("leaving_{kind:?}_{left}.csv"), &many);
            let object = panel().write(&mut input, &mut writer());
            assert!(object.is_err());
            assert_eq!(is_success(object), quiet, "object, {kind:?}");
            let arm = falling(1e-3).write(&HeldTorques::new(7), &mut writer());
            assert!(arm.is_err());
            assert_eq!(is_success(arm.context("arm")), quiet, "arm, {kind:?}");
        }
    }
}

#[test]
fn a_wrong_row_is_named_after_whole_rows() {
    for (name, text, line, rows) in [
        ("word", "t,force_n\n0,1\n1,2\n\n2,x\n3,1\n", "line 5", 2),
        ("short", "0,1\n1,2\n2\n", "line 3", 2),
        ("nan", "0,1\n1,nan\n", "line 2", 1),
        ("late", "0,1\n1,2\n1,3\n", "line 3", 2),
        ("overflow", "0,1e308\n1,1\n1e9,2\n", "line 3", 2),
    ] {
        let mut output = csv::Writer::from_writer(Vec::new());
        let mut input = forces(&format!("wrong_{name}.csv"), text);
        let error = panel().write(&mut input, &mut output).unwrap_err();
        let said = format!("{error:#}");
        assert!(said.contains(line), "{name}: {said}");
        assert_eq!(whole_rows(output.get_ref()), rows, "{name}");
        assert!(!is_success(Err(error)));
    }
}

#[test]
fn a_wrong_row_of_torques_is_named() {
    let chain = Chain::iiwa7();
    let read = |text: &str| torque_rows::read(text.as_bytes(), "it", &chain, false);
    let header = "t,tau1,tau2,tau3,tau4,tau5,tau6,tau7\n";
    let row = "0,1,2,3,4,5,6,7\n";
    assert!(read("").is_ok() && read(header).is_ok());
    let with_header = read(&format!("{header}\n{row}")).unwrap();
    assert_eq!(read(row).unwrap(), with_header);
    for (text, wanted) in [
        (
            &*format!("{row}1,2\n"),
            "it line 2: 2 cells, the header has 8",
        ),
        (&format!("{header}{row}\n1,x,0,0,0,0,0,0\n"), "it line 4"),
        (&format!("{header}{row}{row}"), "it line 3"),
        ("time,tau1\n", "it: no column \"t\" in the header"),
    ] {
        let said = format!("{:#}", read(text).unwrap_err());
        assert!(said.contains(wanted), "{said}");
    }
}

#[test]
fn a_motion_that_runs_away_says_when_and_where() {
    let chain = Chain::iiwa7();
    let rows = "0,0,0,0,0,0,0,0\n0.1,0,0,1e7,0,0,0,0\n";
    let torques = torque_rows::read(rows.as_bytes(), "it", &chain, false).unwrap();
    let mut output = csv::Writer::from_writer(Vec::new());
    let error = falling(1e-4).write(&torques, &mut output).unwrap_err();
    let said = format!("{error:#}");
    let begins = "the motion diverged at t = 0.10";
    assert!(said.starts_with(begins), "{said}");
    assert!(said.contains(" s: joint ") && said.contains(" rad/s; "));
    assert!(said.contains("a smaller --step may help"), "{said}");
    // Up to 0.1 s there is nothing wrong with it.
    assert!((101..=110).contains(&whole_rows(output.get_ref())));
    assert!(!is_success(Err(error)));

    // With torques that it can bear it goes on to the end.
    let saturated = torque_rows::read(rows.as_bytes(), "it", &chain, true).unwrap();
    let mut output = csv::Writer::from_writer(Vec::new());
    falling(1e-4).write(&saturated, &mut output).unwrap();
    assert_eq!(whole_rows(output.get_ref()), 1001);
}

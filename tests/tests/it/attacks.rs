//! A few thousand hostile inputs for every reader, and some runs of the disturbed loop; `--example attack` gives as many as wanted.

use hwall_lab::attack::{loop_again, targets};

const INPUTS: u64 = 1500;
const RUNS: u64 = 150;

#[test]
fn nothing_gets_through() {
    for target in targets("all").unwrap() {
        let report = target.attack(INPUTS, RUNS, 11).unwrap();
        assert_eq!(
            report.findings, 0,
            "{}: {:#?}",
            target.name, report.examples
        );
        // An attack of which everything is refused at the door tests nothing behind it.
        assert!(report.refused > 0, "{report:?}");
        assert!(report.accepted > 0, "{report:?}");
    }
}

/// Which runs these are hangs on the order of draws; `object_on_the_way.rs` of `hwall-haptics` is the case by itself.
#[test]
fn two_hands_in_a_hurry_that_once_met_a_board_on_its_way_to_a_door() {
    for run in [9970, 19895] {
        let report = loop_again(run, 1).unwrap();
        assert_eq!(report.findings, 0, "{:#?}", report.examples);
    }
}

#[test]
fn unknown_readers_are_named() {
    let error = targets("teapot").err().unwrap().to_string();
    assert!(
        error.contains("teapot") && error.contains("urdf"),
        "{error}"
    );
}

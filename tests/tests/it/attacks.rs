//! Hundreds of hostile inputs for every reader, and some runs of the disturbed loop; `--example attack` gives as many as wanted.

use hwall_lab::attack::targets;

const INPUTS: u64 = 800;
const RUNS: u64 = 150;

#[test]
fn nothing_gets_through() {
    for target in targets("all").unwrap() {
        let report = target.attack(INPUTS, RUNS, 11).unwrap();
        let name = target.name;
        assert_eq!(report.findings, 0, "{name}: {:#?}", report.examples);
        // An attack of which everything is refused at the door tests nothing behind it.
        assert!(report.refused > 0, "{report:?}");
        assert!(report.accepted > 0, "{report:?}");
    }
}

#[test]
fn unknown_readers_are_named() {
    let error = targets("teapot").err().unwrap().to_string();
    assert!(error.contains("teapot"), "{error}");
    assert!(error.contains("urdf"), "{error}");
}

//! The README's table shows one line of code for each job. Each of them stands here word for word, so it compiles.

use hwall::Session;
use hwall::bip::{Demonstration, Group, Model, TrainingConfig};
use hwall::contact::{Predictor, PredictorInput};
use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::{ArmState, MovingObject, ObjectPath};
use hwall::kinematics::{ArmKinematics, Pose, SrsArm, Wrench};
use hwall::psychophysics::{AnalysisConfig, Study, analyse};
use hwall::reachability::{ExactConfig, ReachabilityMap, WallGrid};
use hwall::scene::Scene;
use hwall_fri::{FriClient, FriClientConfig};
use hwall_record::{Recording, Run, Setup, replay};
use hwall_texton::{DesignRequest, PrintProcess, Vibration, design};
use std::path::Path;
use std::sync::Arc;

type Tried = Result<(), Box<dyn std::error::Error>>;

fn board<P: Predictor>(session: &mut Session<P>, frame: HandFrame, now_s: f64, state: ArmState) {
    session.frame(&frame);
    session.step(now_s, &state);
}

fn pose(base_from_flange: Pose) {
    SrsArm::iiwa7().verdict(&base_from_flange);
}

fn map(arm: SrsArm, walls: Vec<WallGrid>) -> Tried {
    ReachabilityMap::build(&arm, &ExactConfig::default(), walls)?;
    Ok(())
}

fn touch(predictor: &mut impl Predictor, scene: Scene, input: PredictorInput<'_>) {
    predictor.predict(&scene, &input);
}

fn primitive(demonstrations: Vec<Demonstration>, groups: Vec<Group>) -> Tried {
    Model::train(&demonstrations, &TrainingConfig::new(groups))?;
    Ok(())
}

fn object(door: &mut MovingObject, path: ObjectPath, handle_m: DVec3, push: Wrench) -> Tried {
    door.step(path.generalized_force(handle_m, &push), 1e-3)?;
    Ok(())
}

fn client(model: Arc<dyn ArmKinematics>) -> Tried {
    FriClient::bind(&model, FriClientConfig::default())?;
    Ok(())
}

fn texture(vibration: Vibration) -> Tried {
    design(&DesignRequest::of_ratios(
        vec![1.0, 2.0, 4.0],
        &vibration,
        PrintProcess::Sla,
    ))?;
    Ok(())
}

fn study(study: Study) -> Tried {
    analyse(&study, &AnalysisConfig::default())?;
    Ok(())
}

fn again<P: Predictor>(
    recording: Recording,
    session_of: impl Fn(&Setup, &Run) -> Result<Session<P>, Box<dyn std::error::Error>>,
) -> Tried {
    replay(&recording, |setup, run| session_of(setup, run))?;
    Ok(())
}

/// Code without the breaks of its formatting.
fn in_one_line(code: &str) -> String {
    let dense: String = code.chars().filter(|c| !c.is_whitespace()).collect();
    dense.replace(",)", ")")
}

#[test]
fn every_line_of_the_readme_is_compiled_here() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let here = in_one_line(include_str!("readme_lines.rs"));
    let table = readme.lines().skip_while(|l| !l.contains("| one line |"));
    let rows = table.skip(2).take_while(|line| line.starts_with('|'));
    let mut lines = 0;
    for row in rows {
        let code = row.rsplit(" | ").next().unwrap();
        let code = code.trim_end_matches(" |").trim_matches('`');
        let code = in_one_line(&code.replace("\\|", "|"));
        assert!(here.contains(&code), "no line {code}");
        lines += 1;
    }
    assert!(lines >= 8, "{lines}");
}

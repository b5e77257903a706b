//! A run of the main job, recorded and replayed from the file alone.

use clap::Parser;
use hwall_haptics::Board;
use hwall_record::{RecordError, Recorder, Recording};
use hwall_stage::input::arms::BoardArm;
use hwall_stage::person::predictors::{PredictorKind, Predictors};
use hwall_stage::person::responses::Scenery;
use hwall_stage::recording::{self, Rebuilt};
use hwall_stage::run::people;
use hwall_stage::run::stage::Stage;
use hwall_stage::setting::{Setting, SettingFlags};

#[test]
fn a_recorded_run_is_made_again_bit_by_bit() {
    let arm = BoardArm::named("iiwa7", &Board::default()).unwrap();
    let flags = SettingFlags::parse_from(["", "--touches", "1", "--seed", "5"]);
    let setting = Setting::new(&arm, &flags).unwrap();
    let scene = &setting.scene;
    // No training, which takes most of the time.
    let leader = Some(PredictorKind::RayLed);
    let (predictors, _) = Predictors::train(scene, &arm, &setting.training_people, leader).unwrap();
    let likely = setting.likely_touches.clone();
    let walls = arm.walls_of(scene, likely, true).unwrap();
    let scenery = Scenery::of(scene, &arm, &walls, &setting.training_people);
    let stage = Stage::of(&scenery, &predictors, 1e-3);
    let name = format!("hwall-stage-{}.mcap", std::process::id());
    let path = std::env::temp_dir().join(name);
    let mut recorder: Recorder =
        recording::of_stage(&path, &stage, &setting, None, &"iiwa7".into()).unwrap();
    let plain = people::run(&stage, &setting.participants, |_| {}).unwrap();
    let people = &setting.participants;
    let runs = people::run_recorded(&stage, people, Some(&mut recorder), |_| {}).unwrap();
    // Recording changes nothing.
    assert_eq!(plain[0].run.led, runs[0].run.led);
    let line = recording::finish(recorder, &path).unwrap();
    assert!(line.contains("MB"), "{line}");

    // Rebuilt only once: training takes most of the time.
    let recorded = Recording::open(&path).unwrap();
    let rebuilt = Rebuilt::new(recorded.setup()).unwrap();
    let again = |recording: &Recording| {
        let session_of = |_: &_, run: &_| Ok::<_, RecordError>(rebuilt.session(run).unwrap());
        hwall_record::replay(recording, session_of).unwrap()
    };
    let replayed = again(&recorded);
    assert_eq!((replayed.difference, replayed.missing), (None, 0));
    assert!(replayed.cycles > 1000, "{}", replayed.cycles);

    // One bit of one measured angle, in the middle: the replay names the cycle.
    let mut bytes = std::fs::read(&path).unwrap();
    let chunk = chunk_in_the_middle(&bytes);
    bytes[chunk + 33..chunk + 37].fill(0); // no checksum
    let cycle = bytes[chunk..]
        .windows(2)
        .position(|w| w == [0x22, 56])
        .unwrap();
    bytes[chunk + cycle + 2 + 6] ^= 0x40;
    let changed = Recording::from_bytes(bytes).unwrap();
    let found = again(&changed).difference.unwrap();
    assert!((501..replayed.cycles).contains(&found.cycle), "{found}");
    std::fs::remove_file(path.with_extension("urdf")).unwrap();
    std::fs::remove_file(&path).unwrap();
}

/// Start of the chunk that contains the middle of the file.
fn chunk_in_the_middle(bytes: &[u8]) -> usize {
    let (mut at, mut chunk) = (8, 0);
    while at < bytes.len() / 2 {
        if bytes[at] == 6 {
            chunk = at;
        }
        let length: [u8; 8] = bytes[at + 1..at + 9].try_into().unwrap();
        at += 9 + u64::from_le_bytes(length) as usize;
    }
    chunk
}

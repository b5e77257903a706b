//! The main job led by joints inferred from the hand.

use hwall_stage::built_in_room::BuiltInRoom;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::predictors::{PredictorKind, Predictors, TrainingPeople};
use hwall_stage::person::responses;
use hwall_stage::report::tables;
use hwall_stage::run::people;
use hwall_stage::run::stage::Stage;
use std::time::Duration;

/// The arm stays within its limits (the simulated arm refuses anything else), moves towards the hand, and brings the board nearer to it
/// than when waiting; docs/END-TO-END.md states how near.
#[test]
fn a_dozen_touches_led_end_to_end_are_safe_and_beside_the_others_in_the_tables() {
    let room = BuiltInRoom::new().unwrap();
    let people_like = TrainingPeople::default();
    let asked = Some(PredictorKind::EndToEnd);
    let (untaught, _) = Predictors::train(&room.scene, &room.arm, &people_like, asked).unwrap();
    let cast = room.people(PersonKind::Plain, 12, 3).unwrap();
    let walls = room.walls(&cast, false).unwrap();
    let scenery = room.scenery(&walls, &people_like, false);
    let (predictors, remark) = responses::taught(untaught, &scenery).unwrap();
    assert!(remark.is_some_and(|remark| remark.contains("demonstrations")));
    // The door yields; the line about untrained tasks says why.
    let line = responses::untaught_line(&room.scene);
    assert!(line.contains("no push: what gives way") && line.contains("no grasp"));
    let stage = Stage::of(&scenery, &predictors, 2e-3);
    let runs = people::run(&stage, &cast, |_| {}).unwrap();
    let touches = runs[0].touches.iter().map(|touch| &touch.outcome);
    let reachable = touches.filter(|outcome| outcome.unreachable.is_none());
    let near = reachable
        .clone()
        .filter(|outcome| outcome.gap_m < 0.05 && outcome.offset_m < 0.1);
    let (near, all) = (near.count(), reachable.count());
    let said = format!("{near} of {all} under the hand within 5 cm");
    assert!(5 * near >= all, "{said}");
    assert_eq!(runs[0].run.leader, PredictorKind::EndToEnd);
    let table = tables::table(&runs, &walls.maps, Duration::ZERO).to_string();
    assert!(table.contains("| end-to-end"), "{table}");
    assert!(!table.contains("NaN"), "{table}");
    let right = tables::who_was_right(&runs).to_string();
    let header = right.lines().next().unwrap();
    assert!(header.contains("end-to-end, ms"), "{header}");
    assert!(header.contains("ray cast, ms"), "{header}");
}

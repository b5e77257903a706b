//! Reading a file cannot produce an invalid pose.

use glam::DVec3;
use hwall_geometry::Pose;

#[test]
fn poses_survive_a_file_and_non_poses_do_not() {
    let pose = Pose::from_yaw(0.3, DVec3::new(1.0, 2.0, 3.0)).unwrap();
    let text = serde_json::to_string(&pose).unwrap();
    assert_eq!(serde_json::from_str::<Pose>(&text).unwrap(), pose);
    let with = |rotation: &str| {
        serde_json::from_str::<Pose>(&format!(
            r#"{{"rotation": [{rotation}], "position_m": [0, 0, 0]}}"#
        ))
    };
    assert!(with("1, 0, 0, 0, 1, 0, 0, 0, 1").is_ok());
    for bad in [
        "2, 0, 0, 0, 2, 0, 0, 0, 2",
        "1, 0, 0, 0, 1, 0, 0, 0, -1",
        "1, 0, 0, 0.1, 1, 0, 0, 0, 1",
        "0, 0, 0, 0, 0, 0, 0, 0, 0",
        "1, 0, 0, 0, 1, 0, 0, 0",
        "1, 0, 0, 0, 1, 0, 0, 0, null",
    ] {
        assert!(with(bad).is_err(), "{bad}");
    }
}

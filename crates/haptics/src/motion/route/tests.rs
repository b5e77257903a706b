use super::*;

/// Places left on unknown planes, one behind the other along x, the newest first.
fn left(x_m: [f64; 3]) -> [Option<Place>; PLACES] {
    let mut left = [None; PLACES];
    for (slot, x_m) in left.iter_mut().zip(x_m) {
        *slot = Some(Place {
            point_m: DVec3::new(x_m, 0.0, 0.5),
            normal: DVec3::X,
            roll_rad: 0.0,
        });
    }
    left
}

#[test]
fn only_the_place_left_last_keeps_its_plane_whether_there_is_a_goal_or_not() {
    let board = Board::default();
    let mut route = Route::new(ApproachConfig::default(), Some(board));
    route.left = left([0.6, 0.5, 0.4]);
    let counts = |route: &Route, goal: Option<&Goal>| {
        let planes = route.check(&board, goal).expect("poses are finite").planes;
        let at_m = planes.into_iter().flatten().map(|plane| plane.point_m.x);
        at_m.collect::<Vec<_>>()
    };
    // On the path to a posture there is no place ahead, and none under way.
    assert_eq!(counts(&route, None), [0.6]);
    route.under_way = route.left[1];
    assert_eq!(counts(&route, None), [0.5, 0.6]);
    let roles: Vec<Role> = route.places(None).map(|(role, _)| role).collect();
    let before = Role::LeftBefore;
    assert_eq!(roles, [Role::UnderWay, Role::LeftLast, before, before]);
    // A path to a destination in front of the newest plane cannot stay behind it.
    let mut ends_in_front = route.clone();
    ends_in_front.ends = board_pose(DVec3::new(0.65, 0.1, 0.5), DVec3::X, 0.0).ok();
    assert_eq!(counts(&ends_in_front, None), [0.0_f64; 0]);
    ends_in_front.ends = board_pose(DVec3::new(0.55, 0.1, 0.5), DVec3::X, 0.0).ok();
    assert_eq!(counts(&ends_in_front, None), [0.6]);
    // If the newest place is forgotten with its surface, no other place becomes the newest.
    route.left[0] = None;
    route.under_way = None;
    assert!(counts(&route, None).is_empty());
}

#[test]
fn of_the_places_only_those_that_the_board_is_over_outlast_a_restart() {
    let mut route = Route::new(ApproachConfig::default(), Some(Board::default()));
    route.left = left([0.6, 0.5, 0.4]);
    route.left[1] = route.left[1].map(|place| Place {
        point_m: place.point_m + DVec3::Y,
        ..place
    });
    let face = board_pose(DVec3::new(0.5, 0.05, 0.5), DVec3::X, 0.0).expect("a pose");
    let [newest, _, oldest] = [route.left[0], route.left[1], route.left[2]];
    route.under_way = newest;
    let restarted = |route: &mut Route, face: &Pose| {
        route.restart(None, face);
        route.left[..3].to_vec()
    };
    assert_eq!(restarted(&mut route, &face), [newest, oldest, None]);
    // No other place becomes the newest.
    let beyond = board_pose(DVec3::new(0.35, 0.05, 0.5), DVec3::X, 0.0).expect("a pose");
    assert_eq!(restarted(&mut route, &beyond), [None, oldest, None]);
    // An arm that stands elsewhere begins as at first.
    let away = board_pose(DVec3::new(0.39, 1.0, 0.5), DVec3::NEG_Y, 0.0).expect("a pose");
    assert_eq!(restarted(&mut route, &away), [None; 3]);
    // A door that has opened is no place any more.
    route.left = left([0.6, 0.5, 0.4]);
    (route.on_known, route.under_way) = (route.left[0], None);
    let oldest = route.left[2];
    assert_eq!(restarted(&mut route, &face)[0], None);
    assert!(route.left.contains(&oldest));
}

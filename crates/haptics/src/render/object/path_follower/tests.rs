use super::*;
use hwall_kinematics::SrsArm;

fn follower(deg: [f64; 7]) -> PathFollower {
    let arm = Arc::new(SrsArm::iiwa7());
    let most = hwall_motion::IIWA7_ACCELERATION_RAD_PER_S2;
    let mut follower = PathFollower::new(arm, most);
    let path = ObjectPath::sliding(DVec3::X).unwrap();
    let q = JointPositions::from_deg(deg);
    follower.begin(path, 0.0, &q).unwrap();
    follower
}

const BENT: [f64; 7] = [0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0];

#[test]
fn where_no_joints_slide_the_board_its_share_is_zero() {
    let slide = InFace {
        linear: DVec2::X * 0.1,
        angular: 0.0,
    };
    let mut bent = follower(BENT);
    bent.wanted_slide = slide;
    let rates = bent.joint_rates().expect("away from singular poses");
    assert!(bent.slide_share(&rates, 0.0) > 0.0);
    // A share is never NaN.
    bent.wanted_slide.linear.x = f64::NAN;
    assert_eq!(bent.slide_share(&rates, 0.0), 0.0);
    bent.wanted_slide = slide;
    bent.q[1] = f64::NAN;
    assert_eq!(bent.slide_share(&rates, 0.0), 0.0);
    assert_eq!(bent.joint_rates(), None);
}

#[test]
fn a_straight_arm_cannot_go_on_and_says_so() {
    // Straight up: no joint lifts the face.
    let mut straight = follower([0.0; 7]);
    let path = ObjectPath::sliding(DVec3::Z).unwrap();
    straight
        .begin(path, 0.0, &JointPositions::default())
        .unwrap();
    assert_eq!(straight.joint_rates(), None);
    let followed = straight.follow((0.01, 0.1), 1e-3, Ok).unwrap();
    assert_eq!((followed.share, followed.rate), (0.0, 0.0));
    assert!(followed.unreachable.is_some() && followed.most_acceleration == 0.0);
}

#[test]
fn where_the_reach_ends_no_joint_stops_at_once() {
    const DT_S: f64 = 1e-3;
    for speed in [0.1, 0.3, 0.6] {
        let mut arm = follower(BENT);
        let (mut before, mut last, mut hardest) = (arm.q, [0.0; 7], 0.0_f64);
        let (mut braked, mut again) = (false, 0.0_f64);
        for k in 1..4000 {
            let (wanted, rate) = (speed * DT_S * f64::from(k), arm.rate);
            arm.follow((wanted, speed), DT_S, Ok).unwrap();
            braked |= arm.rate < rate && arm.reached() > 0.1;
            if braked {
                again = again.max(arm.rate - rate);
            }
            for i in 0..7 {
                let rate = (arm.q[i] - before[i]) / DT_S;
                let change = (rate - last[i]).abs() / DT_S;
                hardest = hardest.max(change / arm.max_acceleration_rad_per_s2[i]);
                last[i] = rate;
            }
            before = arm.q;
        }
        assert!(arm.rate.abs() < 1e-3, "{}", arm.rate);
        assert!(hardest < 2.0, "{speed} m/s: {hardest}");
        assert!(again < 1e-4, "{speed} m/s: {again}");
    }
}

#[test]
fn positions_that_are_not_finite_are_refused_and_move_nothing() {
    let mut bent = follower(BENT);
    let before = *bent.q();
    for wanted in [(f64::NAN, 0.0), (0.0, f64::NAN), (f64::INFINITY, 0.0)] {
        assert!(bent.follow(wanted, 1e-3, Ok).is_err(), "{wanted:?}");
        assert_eq!(*bent.q(), before);
    }
}

//! URDF: the iiwa, fixed joints, branches, and all faults of a description.

use glam::{DMat3, DVec3};
use hwall_kinematics::{
    ArmKinematics, Chain, ChainArm, ChainJoint, JointKind, JointLimit, KinematicsError, SrsArm,
};
use hwall_testkit::{Tol, assert_close};
use std::path::Path;

const IIWA7: &str = include_str!("../data/iiwa7.urdf");

fn load(body: &str) -> Result<Chain, KinematicsError> {
    Chain::from_urdf_str(&format!("<robot name=\"r\">{body}</robot>"), None, None)
}

fn links(names: &str) -> String {
    names
        .split(' ')
        .map(|name| format!("<link name=\"{name}\"/>"))
        .collect()
}

/// A joint `parent_child`; `rest` holds origin, axis, limit and so on.
fn joint(kind: &str, parent: &str, child: &str, rest: &str) -> String {
    format!(
        "<joint name=\"{parent}_{child}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{rest}</joint>"
    )
}

fn hinge(parent: &str, child: &str) -> String {
    joint("revolute", parent, child, LIMIT)
}

const LIMIT: &str = "<limit lower=\"-1\" upper=\"2\" effort=\"3\" velocity=\"4\"/>";

#[test]
fn iiwa7_text_is_the_preset() {
    let urdf = Chain::from_urdf_str(IIWA7, None, None).unwrap();
    let preset = Chain::iiwa7();
    assert_eq!(urdf.joint_count(), 7);
    assert_eq!(urdf.link_from_tip(), preset.link_from_tip());
    assert!(urdf.links_left_out().is_empty());
    for (a, b) in urdf.joints().iter().zip(preset.joints()) {
        assert_eq!(
            (&a.name, a.kind, a.axis, a.max_effort),
            (&b.name, b.kind, b.axis, b.max_effort)
        );
        assert_eq!(a.previous_from_link, b.previous_from_link);
        assert_eq!(a.inertials, b.inertials);
        let numbers = |joint: &ChainJoint| {
            let limit = joint.limit;
            [limit.min_rad, limit.max_rad, joint.max_velocity.unwrap()]
        };
        assert_close!(numbers(a), numbers(b), Tol::abs(1e-15));
    }
}

#[test]
fn from_a_file_and_from_no_file() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/iiwa7.urdf");
    assert_eq!(
        Chain::from_urdf_file(&path, None, None).unwrap(),
        Chain::from_urdf_str(IIWA7, None, None).unwrap()
    );
    let missing = Chain::from_urdf_file("no/such/file.urdf", None, None);
    let (wanted, not_found) = ("no/such/file.urdf", std::io::ErrorKind::NotFound);
    assert!(
        matches!(missing, Err(KinematicsError::Io { path, kind, .. }) if path == wanted && kind == not_found)
    );
}

#[test]
fn part_of_the_arm_between_named_links() {
    let part = Chain::from_urdf_str(IIWA7, Some("lbr_link_1"), Some("lbr_link_4")).unwrap();
    let whole = Chain::iiwa7();
    assert_eq!(part.joint_count(), 3);
    let q = [0.4, -0.7, 1.1];
    let all = whole
        .link_poses(&[0.9, q[0], q[1], q[2], 0.0, 0.0, 0.0])
        .unwrap();
    let expected = all[0].inverse() * all[3];
    let position_m = part.forward(&q).unwrap().position_m();
    assert_close!(position_m, expected.position_m(), Tol::abs(1e-15));
    // Links that move beyond the tip cannot be part of the dynamics, and are reported.
    assert_eq!(
        part.links_left_out(),
        ["lbr_link_5", "lbr_link_6", "lbr_link_7"]
    );
    // A tip alone starts at the root above it, a base alone ends at the leaf below.
    for (base, tip) in [(None, Some("lbr_link_2")), (Some("lbr_link_5"), None)] {
        let part = Chain::from_urdf_str(IIWA7, base, tip).unwrap();
        assert_eq!(part.joint_count(), 2);
    }
}

#[test]
fn chained_fixed_joints_multiply_in_order() {
    // Other libraries have swapped them: 64 mm error.
    let steps = [
        ("fixed", [0.1, 0.2, 0.3], [0.3, -0.2, 0.9]),
        ("fixed", [-0.2, 0.0, 0.1], [-1.0, 0.5, 0.2]),
        ("revolute", [0.0, 0.1, 0.0], [0.0, 0.0, 1.0]),
        ("fixed", [0.3, 0.0, 0.0], [0.7, 0.0, 0.0]),
        ("fixed", [0.0, 0.4, 0.0], [0.0, 0.8, 0.0]),
        ("fixed", [0.0, 0.0, 0.5], [0.0, 0.0, -0.6]),
    ];
    let mut text = links("a b c d e f g");
    let (mut rotation, mut position) = (DMat3::IDENTITY, DVec3::ZERO);
    let names = ["a", "b", "c", "d", "e", "f", "g"];
    for (ends, (kind, [x, y, z], [roll, pitch, yaw])) in names.windows(2).zip(steps) {
        let mut rest = format!("<origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/>");
        position += rotation * DVec3::new(x, y, z);
        let mut turn = DMat3::from_rotation_z(yaw)
            * DMat3::from_rotation_y(pitch)
            * DMat3::from_rotation_x(roll);
        if kind == "revolute" {
            rest += &format!("<axis xyz=\"0 1 0\"/>{LIMIT}");
            turn *= DMat3::from_rotation_y(0.55);
        }
        rotation *= turn;
        text += &joint(kind, ends[0], ends[1], &rest);
    }
    let chain = load(&text).unwrap();
    assert_eq!(chain.joint_count(), 1);
    let tip = chain.forward(&[0.55]).unwrap();
    assert_close!(tip.position_m(), position, Tol::abs(1e-15));
    assert_close!(tip.rotation(), rotation, Tol::abs(1e-15));
}

#[test]
fn kinds_limits_and_axes() {
    let slide = format!("<axis xyz=\"0 0 5\"/>{LIMIT}");
    let short = "<axis xyz=\"0 -0.2 0\"/><limit effort=\"9\" velocity=\"0\"/>";
    let endless = "<limit lower=\"1\" upper=\"-1\" effort=\"0\" velocity=\"2\"/>";
    let text = links("a b c d e")
        + &joint("continuous", "a", "b", "")
        + &joint("prismatic", "b", "c", &slide)
        + &joint("revolute", "c", "d", short)
        + &joint("continuous", "d", "e", endless);
    let chain = load(&text).unwrap();
    let joints = chain.joints();
    let (turns, slides) = (JointKind::Revolute, JointKind::Prismatic);
    let limited = JointLimit::new(-1.0, 2.0);
    // Without a limit tag a continuous joint is unlimited about x. With one, only speed and effort are used. Omitted
    // values are zero, as in the format.
    for (joint, (kind, limit, velocity, effort)) in joints.iter().zip([
        (turns, JointLimit::FREE, None, None),
        (slides, limited, Some(4.0), Some(3.0)),
        (turns, JointLimit::new(0.0, 0.0), None, Some(9.0)),
        (turns, JointLimit::FREE, Some(2.0), None),
    ]) {
        assert_eq!((joint.kind, joint.limit), (kind, limit));
        assert_eq!((joint.max_velocity, joint.max_effort), (velocity, effort));
    }
    assert_eq!(joints[0].axis, DVec3::X);
    // Only the direction of an axis matters.
    let slid = chain.forward(&[0.0, 0.25, 0.0, 0.0]).unwrap();
    assert_close!(slid.position_m(), DVec3::Z * 0.25, Tol::abs(1e-16));
    let turned = chain.forward(&[0.0, 0.0, 0.3, 0.0]).unwrap();
    let expected = DMat3::from_rotation_y(-0.3);
    assert_close!(turned.rotation(), expected, Tol::abs(1e-15));
}

#[test]
fn a_description_may_say_how_fast_joints_accelerate() {
    let read = |root: &str, limit: &str| {
        let limit =
            format!("<limit lower=\"-1\" upper=\"2\" effort=\"3\" velocity=\"4\" {limit}/>");
        let body = links("a b c") + &hinge("a", "b") + &joint("revolute", "b", "c", &limit);
        let chain = Chain::from_urdf_str(&format!("<robot {root}>{body}</robot>"), None, None)?;
        assert_eq!(chain.joints()[0].max_acceleration, None);
        // The caller supplies what the description omits and overrides what it gives.
        let arm = ChainArm::new(chain.clone())?;
        let most = chain.joints()[1].max_acceleration;
        assert_eq!(
            arm.accelerations_or([7.0; 7])[..2],
            [7.0, most.unwrap_or(7.0)]
        );
        assert_eq!(
            arm.with_accelerations([1.0; 7]).accelerations_or([7.0; 7]),
            [1.0; 7]
        );
        Ok::<_, KinematicsError>(most)
    };
    let (drake, uri) = (
        "drake:acceleration=\"12.5\"",
        "xmlns:drake=\"http://drake.mit.edu\"",
    );
    assert_eq!(read(uri, drake), Ok(Some(12.5)));
    // Like other readers, for any namespace of the prefix, even none.
    assert_eq!(read("xmlns:drake=\"urn:x\"", drake), Ok(Some(12.5)));
    assert_eq!(read("", drake), Ok(Some(12.5)));
    assert_eq!(
        read("xmlns:other=\"urn:x\"", "other:acceleration=\"1\""),
        Ok(None)
    );
    // The format's own attribute, since version 1.2.
    let own = "acceleration=\"8\"";
    assert_eq!(read("", own), Ok(None));
    assert_eq!(read("version=\"1.2\"", own), Ok(Some(8.0)));
    assert_eq!(
        read("version=\"1.2\"", &format!("{own} {drake}")),
        Ok(Some(12.5))
    );
    for nothing in ["0", "inf"] {
        assert_eq!(
            read(uri, &format!("drake:acceleration=\"{nothing}\"")),
            Ok(None)
        );
    }
    for bad in ["-1", "NaN", "-inf", "1e200", "fast"] {
        let read = read(uri, &format!("drake:acceleration=\"{bad}\""));
        let error = read.unwrap_err().to_string();
        assert!(error.contains("acceleration"), "{bad}: {error}");
    }
}

#[test]
fn an_arm_with_a_closed_form_keeps_the_accelerations_of_its_description() {
    let text = IIWA7.replacen("velocity=", "drake:acceleration=\"3.5\" velocity=", 1);
    let arm = SrsArm::from_urdf_str(&text, None, None).unwrap();
    let arm = arm.carrying(hwall_kinematics::Pose::IDENTITY);
    assert_eq!(
        arm.accelerations_or([9.0; 7]),
        [3.5, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0]
    );
}

#[test]
fn branches_need_names() {
    let text = links("base arm hand left right")
        + &hinge("base", "arm")
        + &hinge("arm", "hand")
        + &hinge("hand", "left")
        + &hinge("hand", "right");
    let both_ends = || KinematicsError::UrdfAmbiguous {
        links: vec!["left".into(), "right".into()],
    };
    assert_eq!(load(&text), Err(both_ends()));
    assert_eq!(
        both_ends().to_string(),
        "URDF has 2 possible ends (\"left\", \"right\"): name the base and tip link"
    );
    let robot = format!("<robot name=\"r\">{text}</robot>");
    let get = |base, tip| Chain::from_urdf_str(&robot, base, tip);
    assert_eq!(get(None, Some("left")).unwrap().joint_count(), 3);
    assert_eq!(get(Some("arm"), Some("right")).unwrap().joint_count(), 2);
    assert_eq!(get(Some("hand"), None), Err(both_ends()));
    let nothing = get(Some("arm"), Some("arm"));
    assert_eq!(nothing, Err(KinematicsError::NoJoints));
    for (base, tip) in [("left", "right"), ("hand", "base")] {
        let apart = KinematicsError::UrdfDisconnected {
            base: base.into(),
            tip: tip.into(),
        };
        assert_eq!(get(Some(base), Some(tip)), Err(apart));
    }
    for (base, tip) in [(Some("foot"), None), (None, Some("foot"))] {
        let link = "foot".into();
        let unknown = KinematicsError::UrdfUnknownLink { link };
        assert_eq!(get(base, tip), Err(unknown));
    }
}

#[test]
fn fixed_branches_add_their_mass() {
    let heavy = |name: &str, mass: f64| {
        format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"0 0 0.1\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" iyy=\"0.01\" iyz=\"0\" izz=\"0.01\"/></inertial></link>"
        )
    };
    let masses = [
        ("base", 9.0),
        ("arm", 1.0),
        ("camera", 0.5),
        ("lens", 0.25),
        ("tool", 2.0),
        ("finger", 0.1),
        ("nail", 0.01),
    ];
    let aside = "<origin xyz=\"0.5 0 0\" rpy=\"0 1.5 0\"/>";
    let text = masses.map(|(name, mass)| heavy(name, mass)).concat()
        + &hinge("base", "arm")
        + &joint("fixed", "arm", "camera", aside)
        + &joint("fixed", "camera", "lens", "<origin xyz=\"0 0 0.5\"/>")
        + &joint("fixed", "arm", "tool", "<origin xyz=\"1 0 0\"/>")
        + &hinge("tool", "finger")
        + &joint("fixed", "finger", "nail", "");
    let robot = format!("<robot name=\"r\">{text}</robot>");
    let chain = Chain::from_urdf_str(&robot, None, Some("tool")).unwrap();
    let inertials = &chain.joints()[0].inertials;
    let mut bodies: Vec<_> = inertials.iter().map(|i| (&*i.link, i.mass_kg)).collect();
    bodies.sort_by(|a, b| a.0.cmp(b.0));
    assert_eq!(
        bodies,
        [("arm", 1.0), ("camera", 0.5), ("lens", 0.25), ("tool", 2.0)]
    );
    let lens = inertials.iter().find(|i| i.link == "lens").unwrap();
    let expected =
        DVec3::new(0.5, 0.0, 0.0) + DMat3::from_rotation_y(1.5) * DVec3::new(0.0, 0.0, 0.6);
    assert_close!(lens.com_m, expected, Tol::abs(1e-15));
    assert_eq!(chain.links_left_out(), ["finger", "nail"]);
}

#[test]
fn broken_structure_is_named() {
    let duplicate = |link: &str| Err(KinematicsError::UrdfDuplicateLink { link: link.into() });
    let unknown = |link: &str| Err(KinematicsError::UrdfUnknownLink { link: link.into() });
    let fixed = |parent, child| joint("fixed", parent, child, "");
    let looped = |link: &str| Err(KinematicsError::UrdfLoop { link: link.into() });
    let ends = |links: &[&str]| {
        let links = links.iter().map(|&link| link.to_owned()).collect();
        Err(KinematicsError::UrdfAmbiguous { links })
    };
    let same_name = hinge("a", "b") + &hinge("b", "c").replace("b_c", "a_b");
    let named_twice = Err(KinematicsError::DuplicateJoint {
        joint: "a_b".into(),
    });
    for (names, joints, error) in [
        ("a b b", hinge("a", "b"), duplicate("b")),
        ("a b c", hinge("a", "c") + &hinge("b", "c"), duplicate("c")),
        ("a b", hinge("a", "c"), unknown("c")),
        ("a b", hinge("c", "b"), unknown("c")),
        ("a b", hinge("a", "b") + &hinge("b", "a"), looped("a")),
        ("a", hinge("a", "a"), looped("a")),
        ("a", String::new(), Err(KinematicsError::NoJoints)),
        ("a b", fixed("a", "b"), Err(KinematicsError::NoJoints)),
        ("a b", String::new(), ends(&["a", "b"])),
        ("a b c", same_name, named_twice),
    ] {
        assert_eq!(load(&(links(names) + &joints)), error, "{names} {joints}");
    }
    let ring_beside = links("x y a b") + &hinge("x", "y") + &hinge("a", "b") + &hinge("b", "a");
    assert_eq!(load(&ring_beside), looped("a"));
    assert_eq!(load(""), Err(KinematicsError::UrdfNoLinks));
}

#[test]
fn unsupported_joints_are_named() {
    let mimic = format!("{LIMIT}<mimic joint=\"x\"/>");
    for (kind, rest, named) in [
        ("planar", LIMIT, "planar"),
        ("floating", LIMIT, "floating"),
        ("revolute", &mimic, "mimic"),
    ] {
        let error = load(&(links("a b") + &joint(kind, "a", "b", rest)));
        let kind = KinematicsError::UrdfJointKind {
            joint: "a_b".into(),
            kind: named.into(),
        };
        assert_eq!(error, Err(kind));
    }
    for kind in ["revolute", "prismatic"] {
        let missing = load(&(links("a b") + &joint(kind, "a", "b", "")));
        let error = KinematicsError::UrdfNoLimits {
            joint: "a_b".into(),
        };
        assert_eq!(missing, Err(error));
    }
}

#[cfg(feature = "dynamics")]
#[test]
fn impossible_inertia_only_matters_to_the_dynamics() {
    use hwall_kinematics::ChainDynamics;
    let text = IIWA7.replace("ixx=\"0.007067\"", "ixx=\"0.7067\"");
    let chain = Chain::from_urdf_str(&text, None, None).unwrap();
    let error = ChainDynamics::new(&chain);
    assert!(matches!(error, Err(KinematicsError::Inertia { link, .. }) if link == "lbr_link_6"));
    let negative = IIWA7.replace("<mass value=\"2.403626\"/>", "<mass value=\"-2\"/>");
    assert!(ChainDynamics::new(&Chain::from_urdf_str(&negative, None, None).unwrap()).is_err());
    assert!(ChainDynamics::new(&Chain::from_urdf_str(IIWA7, None, None).unwrap()).is_ok());
}

#[test]
fn a_macro_is_named_as_one() {
    let declared = " xmlns:xacro=\"http://www.ros.org/wiki/xacro\"";
    for declaration in [declared, ""] {
        let inside = "<xacro:include filename=\"arm.xacro\"/>";
        let text = format!("<robot name=\"r\"{declaration}>{inside}</robot>");
        let read = Chain::from_urdf_str(&text, None, None);
        assert_eq!(read, Err(KinematicsError::UrdfXacro));
    }
    // The output of xacro keeps the declaration.
    let body = links("a b") + &hinge("a", "b");
    let printed = format!("<robot name=\"r\"{declared}>{body}</robot>");
    assert!(Chain::from_urdf_str(&printed, None, None).is_ok());
}

/// The tip chosen from the first link.
fn tip_of(text: &str) -> Result<(String, usize), KinematicsError> {
    let chain = load(text)?;
    let [_, tip] = chain.ends().expect("names");
    Ok((tip.to_owned(), chain.joint_count()))
}

/// `count` revolute joints in series from `l0`.
fn arm(count: usize) -> String {
    let names: Vec<String> = (0..=count).map(|k| format!("l{k}")).collect();
    let hinges = names.windows(2).map(|pair| hinge(&pair[0], &pair[1]));
    links(&names.join(" ")) + &hinges.collect::<String>()
}

#[test]
fn the_tip_is_the_obvious_one() {
    let fixed = |parent, child| links(child) + &joint("fixed", parent, child, "");
    let slide =
        |parent, child| links(child) + &hinge(parent, child).replace("revolute", "prismatic");
    let turns = |parent, child| links(child) + &hinge(parent, child);
    let mimic = |parent: &str, child, of: &str| {
        let tag = format!("<mimic joint=\"{of}\"/></joint>");
        links(child) + &hinge(parent, child).replace("</joint>", &tag)
    };
    let six = arm(6);
    for (added, tip, joints) in [
        (String::new(), "l6", 6),
        // Frames beside the arm are ignored, those at its end are used.
        (fixed("l0", "base") + &fixed("l3", "camera"), "l6", 6),
        (fixed("l6", "ee_link") + &fixed("l6", "tool0"), "tool0", 6),
        (
            fixed("l6", "arm_flange") + &fixed("arm_flange", "cover"),
            "arm_flange",
            6,
        ),
        (fixed("l6", "left") + &fixed("l6", "right"), "l6", 6),
        (fixed("l6", "plate"), "plate", 6),
        // A gripper: several fingers, one that slides, one that others mimic.
        (
            fixed("l6", "hand") + &slide("hand", "f1") + &slide("hand", "f2"),
            "hand",
            6,
        ),
        (fixed("l6", "hand") + &slide("hand", "f1"), "hand", 6),
        (
            turns("l6", "driver") + &mimic("driver", "follower", "l6_driver"),
            "l6",
            6,
        ),
        (fixed("l6", "hand") + &turns("hand", "jaw"), "hand", 6),
        // Any other revolute joint is one more joint.
        (turns("l6", "l7") + &turns("l7", "l8"), "l8", 8),
        // A head or wheels beside the arm.
        (turns("l0", "head") + &turns("l0", "wheel"), "l6", 6),
    ] {
        let text = format!("{six}{added}");
        assert_eq!(tip_of(&text), Ok((tip.to_owned(), joints)), "{added}");
    }
    // Two equal arms are ambiguous; unattached links are not a second robot.
    let other = arm(6).replace("\"l", "\"r").replace("\"r_", "\"l_");
    let two = format!("{six}{other}").replace("\"r0\"", "\"l0\"");
    let two = two.replacen("<link name=\"l0\"/>", "", 1);
    let error = load(&two).unwrap_err().to_string();
    assert!(
        error.contains("\"l6\"") && error.contains("\"r6\""),
        "{error}"
    );
    assert_eq!(tip_of(&(six + &links("world"))).unwrap().0, "l6");
}

//! URDF: the iiwa, fixed joints, branches, and everything that can be wrong with a description.

use crate::chain_support::random_q;
use glam::{DMat3, DVec3};
use hwall_kinematics::{
    ArgumentError, Chain, GeometryError, JointKind, JointLimit, KinematicsError,
};
use hwall_testkit::{Sampler, Tol, assert_close};
use std::fmt::Write;
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
    let (urdf, preset) = (
        Chain::from_urdf_str(IIWA7, None, None).unwrap(),
        Chain::iiwa7(),
    );
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
        assert_close!(
            [a.limit.min_rad, a.limit.max_rad],
            [b.limit.min_rad, b.limit.max_rad],
            Tol::abs(1e-15)
        );
        assert_close!(
            a.max_velocity.unwrap(),
            b.max_velocity.unwrap(),
            Tol::abs(1e-15)
        );
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
    assert!(
        matches!(missing, Err(KinematicsError::Io { path, kind, .. })
            if path == "no/such/file.urdf" && kind == std::io::ErrorKind::NotFound)
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
    assert_close!(
        part.forward(&q).unwrap().position_m(),
        expected.position_m(),
        Tol::abs(1e-15)
    );
    // What moves beyond the tip cannot be part of the dynamics, and is not lost silently.
    assert_eq!(
        part.links_left_out(),
        ["lbr_link_5", "lbr_link_6", "lbr_link_7"]
    );
    // A tip alone starts at the root above it, a base alone ends at the leaf below.
    assert_eq!(
        Chain::from_urdf_str(IIWA7, None, Some("lbr_link_2"))
            .unwrap()
            .joint_count(),
        2
    );
    assert_eq!(
        Chain::from_urdf_str(IIWA7, Some("lbr_link_5"), None)
            .unwrap()
            .joint_count(),
        2
    );
}

#[test]
fn chained_fixed_joints_multiply_in_order() {
    // Peers have swapped them: 64 mm off.
    let fixed =
        |parent, child, origin: &str| joint("fixed", parent, child, &format!("<origin {origin}/>"));
    let text = links("a b c d e f g")
        + &fixed("a", "b", "xyz=\"0.1 0.2 0.3\" rpy=\"0.3 -0.2 0.9\"")
        + &fixed("b", "c", "xyz=\"-0.2 0 0.1\" rpy=\"-1 0.5 0.2\"")
        + &joint(
            "revolute",
            "c",
            "d",
            &format!("<origin xyz=\"0 0.1 0\" rpy=\"0 0 1\"/><axis xyz=\"0 1 0\"/>{LIMIT}"),
        )
        + &fixed("d", "e", "xyz=\"0.3 0 0\" rpy=\"0.7 0 0\"")
        + &fixed("e", "f", "xyz=\"0 0.4 0\" rpy=\"0 0.8 0\"")
        + &fixed("f", "g", "xyz=\"0 0 0.5\" rpy=\"0 0 -0.6\"");
    let chain = load(&text).unwrap();
    assert_eq!(chain.joint_count(), 1);
    let rpy = |r: f64, p: f64, y: f64| {
        DMat3::from_rotation_z(y) * DMat3::from_rotation_y(p) * DMat3::from_rotation_x(r)
    };
    let steps = [
        (rpy(0.3, -0.2, 0.9), DVec3::new(0.1, 0.2, 0.3)),
        (rpy(-1.0, 0.5, 0.2), DVec3::new(-0.2, 0.0, 0.1)),
        (
            rpy(0.0, 0.0, 1.0) * DMat3::from_rotation_y(0.55),
            DVec3::new(0.0, 0.1, 0.0),
        ),
        (rpy(0.7, 0.0, 0.0), DVec3::new(0.3, 0.0, 0.0)),
        (rpy(0.0, 0.8, 0.0), DVec3::new(0.0, 0.4, 0.0)),
        (rpy(0.0, 0.0, -0.6), DVec3::new(0.0, 0.0, 0.5)),
    ];
    let (mut rotation, mut position) = (DMat3::IDENTITY, DVec3::ZERO);
    for (r, p) in steps {
        position += rotation * p;
        rotation *= r;
    }
    let tip = chain.forward(&[0.55]).unwrap();
    assert_close!(tip.position_m(), position, Tol::abs(1e-15));
    assert_close!(tip.rotation(), rotation, Tol::abs(1e-15));
}

#[test]
fn kinds_limits_and_axes() {
    let text = links("a b c d e")
        + &joint("continuous", "a", "b", "")
        + &joint(
            "prismatic",
            "b",
            "c",
            &format!("<axis xyz=\"0 0 5\"/>{LIMIT}"),
        )
        + &joint(
            "revolute",
            "c",
            "d",
            "<axis xyz=\"0 -0.2 0\"/><limit effort=\"9\" velocity=\"0\"/>",
        )
        + &joint(
            "continuous",
            "d",
            "e",
            "<limit lower=\"1\" upper=\"-1\" effort=\"0\" velocity=\"2\"/>",
        );
    let chain = load(&text).unwrap();
    let joints = chain.joints();
    assert_eq!(
        joints.iter().map(|j| j.kind).collect::<Vec<_>>(),
        [
            JointKind::Revolute,
            JointKind::Prismatic,
            JointKind::Revolute,
            JointKind::Revolute
        ]
    );
    // No tag on a continuous joint: endless about x. A tag on it: only speed and effort count.
    assert_eq!(
        (joints[0].limit, joints[0].axis, joints[0].max_velocity),
        (JointLimit::FREE, DVec3::X, None)
    );
    assert_eq!(
        (
            joints[3].limit,
            joints[3].max_velocity,
            joints[3].max_effort
        ),
        (JointLimit::FREE, Some(2.0), None)
    );
    assert_eq!(
        joints[1].limit,
        JointLimit {
            min_rad: -1.0,
            max_rad: 2.0
        }
    );
    assert_eq!(
        (joints[1].max_velocity, joints[1].max_effort),
        (Some(4.0), Some(3.0))
    );
    // Left out in the tag: zero, as the format says.
    assert_eq!(
        joints[2].limit,
        JointLimit {
            min_rad: 0.0,
            max_rad: 0.0
        }
    );
    assert_eq!(
        (joints[2].max_velocity, joints[2].max_effort),
        (None, Some(9.0))
    );
    // Axes count by direction only.
    let slid = chain.forward(&[0.0, 0.25, 0.0, 0.0]).unwrap();
    assert_close!(
        slid.position_m(),
        DVec3::new(0.0, 0.0, 0.25),
        Tol::abs(1e-16)
    );
    let turned = chain.forward(&[0.0, 0.0, 0.3, 0.0]).unwrap();
    assert_close!(
        turned.rotation(),
        DMat3::from_rotation_y(-0.3),
        Tol::abs(1e-15)
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
    assert_eq!(
        get(Some("arm"), Some("arm")),
        Err(KinematicsError::NoJoints)
    );
    let apart = |base: &str, tip: &str| {
        Err(KinematicsError::UrdfDisconnected {
            base: base.into(),
            tip: tip.into(),
        })
    };
    assert_eq!(get(Some("left"), Some("right")), apart("left", "right"));
    assert_eq!(get(Some("hand"), Some("base")), apart("hand", "base"));
    assert_eq!(
        get(Some("foot"), None),
        Err(KinematicsError::UrdfUnknownLink {
            link: "foot".into()
        })
    );
    assert_eq!(
        get(None, Some("foot")),
        Err(KinematicsError::UrdfUnknownLink {
            link: "foot".into()
        })
    );
}

#[test]
fn fixed_branches_add_their_mass() {
    let heavy = |name: &str, mass: f64| {
        format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"0 0 0.1\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" iyy=\"0.01\" iyz=\"0\" izz=\"0.01\"/></inertial></link>"
        )
    };
    let text = heavy("base", 9.0)
        + &heavy("arm", 1.0)
        + &heavy("camera", 0.5)
        + &heavy("lens", 0.25)
        + &heavy("tool", 2.0)
        + &heavy("finger", 0.1)
        + &heavy("nail", 0.01)
        + &hinge("base", "arm")
        + &joint(
            "fixed",
            "arm",
            "camera",
            "<origin xyz=\"0.5 0 0\" rpy=\"0 1.5 0\"/>",
        )
        + &joint("fixed", "camera", "lens", "<origin xyz=\"0 0 0.5\"/>")
        + &joint("fixed", "arm", "tool", "<origin xyz=\"1 0 0\"/>")
        + &hinge("tool", "finger")
        + &joint("fixed", "finger", "nail", "");
    let robot = format!("<robot name=\"r\">{text}</robot>");
    let chain = Chain::from_urdf_str(&robot, None, Some("tool")).unwrap();
    let mut bodies: Vec<_> = chain.joints()[0]
        .inertials
        .iter()
        .map(|i| (i.link.as_str(), i.mass_kg))
        .collect();
    bodies.sort_by(|a, b| a.0.cmp(b.0));
    assert_eq!(
        bodies,
        [("arm", 1.0), ("camera", 0.5), ("lens", 0.25), ("tool", 2.0)]
    );
    let lens = chain.joints()[0]
        .inertials
        .iter()
        .find(|i| i.link == "lens")
        .unwrap();
    let expected =
        DVec3::new(0.5, 0.0, 0.0) + DMat3::from_rotation_y(1.5) * DVec3::new(0.0, 0.0, 0.6);
    assert_close!(lens.com_m, expected, Tol::abs(1e-15));
    assert_eq!(chain.links_left_out(), ["finger", "nail"]);
}

#[test]
fn broken_structure_is_named() {
    let duplicate = |link: &str| Err(KinematicsError::UrdfDuplicateLink { link: link.into() });
    let unknown = |link: &str| Err(KinematicsError::UrdfUnknownLink { link: link.into() });
    assert_eq!(load(&(links("a b b") + &hinge("a", "b"))), duplicate("b"));
    assert_eq!(
        load(&(links("a b c") + &hinge("a", "c") + &hinge("b", "c"))),
        duplicate("c")
    );
    assert_eq!(load(&(links("a b") + &hinge("a", "c"))), unknown("c"));
    assert_eq!(load(&(links("a b") + &hinge("c", "b"))), unknown("c"));
    let ring = links("a b c") + &hinge("a", "b") + &hinge("b", "c") + &hinge("c", "a");
    assert_eq!(
        load(&ring),
        Err(KinematicsError::UrdfLoop { link: "a".into() })
    );
    let ring_beside = links("x y a b") + &hinge("x", "y") + &hinge("a", "b") + &hinge("b", "a");
    assert_eq!(
        load(&ring_beside),
        Err(KinematicsError::UrdfLoop { link: "a".into() })
    );
    assert_eq!(
        load(&(links("a") + &hinge("a", "a"))),
        Err(KinematicsError::UrdfLoop { link: "a".into() })
    );
    assert_eq!(load(""), Err(KinematicsError::UrdfNoLinks));
    assert_eq!(load(&links("a")), Err(KinematicsError::NoJoints));
    assert_eq!(
        load(&(links("a b") + &joint("fixed", "a", "b", ""))),
        Err(KinematicsError::NoJoints)
    );
    assert_eq!(
        load(&links("a b")),
        Err(KinematicsError::UrdfAmbiguous {
            links: vec!["a".into(), "b".into()]
        })
    );
    let same_name = links("a b c") + &hinge("a", "b") + &hinge("b", "c").replace("b_c", "a_b");
    assert_eq!(
        load(&same_name),
        Err(KinematicsError::DuplicateJoint {
            joint: "a_b".into()
        })
    );
}

#[test]
fn unsupported_joints_are_named() {
    for kind in ["planar", "floating"] {
        let error = load(&(links("a b") + &joint(kind, "a", "b", LIMIT)));
        assert_eq!(
            error,
            Err(KinematicsError::UrdfJointKind {
                joint: "a_b".into(),
                kind: kind.into()
            })
        );
    }
    let mimic = load(
        &(links("a b")
            + &joint(
                "revolute",
                "a",
                "b",
                &format!("{LIMIT}<mimic joint=\"x\"/>"),
            )),
    );
    assert_eq!(
        mimic,
        Err(KinematicsError::UrdfJointKind {
            joint: "a_b".into(),
            kind: "mimic".into()
        })
    );
    assert!(matches!(
        load(&(links("a b") + &joint("screw", "a", "b", LIMIT))),
        Err(KinematicsError::UrdfMalformed { .. })
    ));
    for kind in ["revolute", "prismatic"] {
        let missing = load(&(links("a b") + &joint(kind, "a", "b", "")));
        assert_eq!(
            missing,
            Err(KinematicsError::UrdfNoLimits {
                joint: "a_b".into()
            })
        );
    }
}

#[test]
fn bad_numbers_are_errors() {
    let with = |rest: &str| load(&(links("a b") + &joint("revolute", "a", "b", rest)));
    let limit = |text: &str| with(&format!("<limit {text} effort=\"1\" velocity=\"1\"/>"));
    assert!(limit("lower=\"-1\" upper=\"1\"").is_ok());
    assert!(matches!(
        limit("lower=\"1\" upper=\"-1\""),
        Err(KinematicsError::LimitsReversed { .. })
    ));
    assert!(matches!(
        limit("lower=\"NaN\" upper=\"1\""),
        Err(KinematicsError::Argument(ArgumentError::NonFinite { .. }))
    ));
    assert!(matches!(
        limit("lower=\"one\" upper=\"2\""),
        Err(KinematicsError::UrdfMalformed { .. })
    ));
    assert!(matches!(
        with(&format!("<axis xyz=\"0 0 0\"/>{LIMIT}")),
        Err(KinematicsError::ZeroAxis { .. })
    ));
    assert!(matches!(
        with(&format!("<axis xyz=\"0 NaN 1\"/>{LIMIT}")),
        Err(KinematicsError::Argument(ArgumentError::NonFinite { .. }))
    ));
    assert!(matches!(
        with(&format!("<axis xyz=\"0 1\"/>{LIMIT}")),
        Err(KinematicsError::UrdfMalformed { .. })
    ));
    for origin in [
        "xyz=\"0 nan 0\"",
        "xyz=\"0 0 inf\"",
        "rpy=\"NaN 0 0\"",
        "rpy=\"0 inf 0\"",
    ] {
        assert!(matches!(
            with(&format!("<origin {origin}/>{LIMIT}")),
            Err(KinematicsError::Argument(ArgumentError::NonFinite { .. })
                | KinematicsError::Geometry(GeometryError::Argument(
                    ArgumentError::NonFinite { .. }
                )))
        ));
    }
    for speed in ["-1", "NaN"] {
        let text = format!("<limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"{speed}\"/>");
        assert!(matches!(
            with(&text),
            Err(KinematicsError::Argument(ArgumentError::OutOfRange { .. }))
        ));
    }
}

#[test]
fn malformed_text_is_an_error() {
    for text in [
        "",
        "   ",
        "not xml",
        "<robot",
        "<robot name=\"r\"><link></robot>",
        "<html></html>",
        "\0\u{1}",
        "<robot/>",
    ] {
        let answer = Chain::from_urdf_str(text, None, None);
        let is_empty = answer == Err(KinematicsError::UrdfNoLinks);
        let is_malformed = matches!(&answer, Err(KinematicsError::UrdfMalformed { .. }));
        assert!(is_malformed || is_empty, "{text:?}: {answer:?}");
    }
    // Cut off anywhere, the arm is an error and never a panic or a shorter arm.
    for end in (0..IIWA7.len() - "</robot>".len()).step_by(37) {
        assert!(
            Chain::from_urdf_str(&IIWA7[..end], None, None).is_err(),
            "cut at {end}"
        );
    }
}

const DAMAGE: &[u8] = b" <>/\"=0-9.eEnN&;";

#[test]
fn damaged_text_never_panics() {
    let mut sampler = Sampler::new(42);
    let mut broken = 0;
    for _ in 0..400 {
        let mut bytes = IIWA7.as_bytes().to_vec();
        for _ in 0..1 + sampler.index(4) {
            let place = sampler.index(bytes.len());
            bytes[place] = DAMAGE[sampler.index(DAMAGE.len())];
        }
        match Chain::from_urdf_str(&String::from_utf8_lossy(&bytes), None, None) {
            Ok(chain) => assert!(chain.forward(&vec![0.1; chain.joint_count()]).is_ok()),
            Err(_) => broken += 1,
        }
    }
    assert!(broken > 100, "{broken}");
}

#[test]
fn zero_lengths_and_two_hundred_joints() {
    let mut text = links("l0");
    for i in 0..200 {
        let (a, b) = (format!("l{i}"), format!("l{}", i + 1));
        let axis = ["1 0 0", "0 1 0", "0 0 1"][i % 3];
        let _ = write!(
            text,
            "{}{}",
            links(&b),
            joint(
                "revolute",
                &a,
                &b,
                &format!("<axis xyz=\"{axis}\"/>{LIMIT}")
            )
        );
    }
    let chain = load(&text).unwrap();
    assert_eq!(chain.joint_count(), 200);
    let q = random_q(&chain, &mut Sampler::new(41));
    assert_eq!(chain.forward(&q).unwrap().position_m(), DVec3::ZERO);
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
    let text = "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><xacro:include filename=\"arm.xacro\"/></robot>";
    assert_eq!(
        Chain::from_urdf_str(text, None, None),
        Err(KinematicsError::UrdfXacro)
    );
    let undeclared = "<robot name=\"r\"><xacro:include filename=\"arm.xacro\"/></robot>";
    assert_eq!(
        Chain::from_urdf_str(undeclared, None, None),
        Err(KinematicsError::UrdfXacro)
    );
    // What xacro prints keeps the declaration.
    let printed = format!(
        "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">{}{}</robot>",
        links("a b"),
        hinge("a", "b")
    );
    assert_eq!(
        Chain::from_urdf_str(&printed, None, None)
            .unwrap()
            .joint_count(),
        1
    );
}

/// From the first link to which?
fn tip_of(text: &str) -> Result<(String, usize), KinematicsError> {
    let chain = load(text)?;
    let [_, tip] = chain.ends().expect("names");
    Ok((tip.to_owned(), chain.joint_count()))
}

/// `count` hinges in a row from `l0` on.
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
        // Frames beside the arm do not count, those at its end do.
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
        // Whatever else turns is one more joint.
        (turns("l6", "l7") + &turns("l7", "l8"), "l8", 8),
        // A head or wheels beside the arm.
        (turns("l0", "head") + &turns("l0", "wheel"), "l6", 6),
    ] {
        let text = format!("{six}{added}");
        assert_eq!(
            tip_of(&text).as_ref(),
            Ok(&(tip.to_owned(), joints)),
            "{added}"
        );
    }
    // Two arms are alike, and links that hang on nothing are no second robot.
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

#[test]
fn what_other_readers_read_is_read() {
    let body = links("a b") + &hinge("a", "b");
    let robot = format!("<robot name=\"r\">{body}</robot>");
    let expected = Chain::from_urdf_str(&robot, None, None);
    assert!(expected.is_ok());
    for text in [
        format!("\u{feff}{robot}"),
        format!("\n\n<?xml version=\"1.0\"?>\n<!-- <robot> -->{robot}"),
        format!("<!DOCTYPE robot [<!ENTITY a \"1\">]>{robot}"),
        robot.replace("</robot>", "<sensor:camera/><x other:y=\"1\"/></robot>"),
        robot.replace(
            "</robot>",
            "<xacro:property name=\"p\" value=\"1\"/></robot>",
        ),
        robot.replace("</robot>", "<gazebo><axis/></gazebo></robot>"),
    ] {
        assert_eq!(Chain::from_urdf_str(&text, None, None), expected, "{text}");
    }
    // An axis that names none is x, as one that is not there.
    let axis = robot.replace("<limit", "<axis/><limit");
    assert_eq!(Chain::from_urdf_str(&axis, None, None), expected);
    // A comment in an older encoding.
    let path = std::env::temp_dir().join(format!("latin-{}.urdf", std::process::id()));
    let mut bytes = b"<!-- M\xfcller -->".to_vec();
    bytes.extend(robot.as_bytes());
    std::fs::write(&path, bytes).unwrap();
    let read = Chain::from_urdf_file(&path, None, None);
    std::fs::remove_file(&path).unwrap();
    assert_eq!(read, expected);
    // More prefixes than anybody uses are refused, and nothing hangs.
    let many: String = (0..100).map(|k| format!("<p{k}:x/>")).collect();
    let many = robot.replace("</robot>", &format!("{many}</robot>"));
    assert!(Chain::from_urdf_str(&many, None, None).is_err());
}

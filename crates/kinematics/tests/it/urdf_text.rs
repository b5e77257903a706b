//! URDF as text: what is skipped, what is rejected with which message, and that nothing hangs or panics.

use glam::{DMat3, DQuat};
use hwall_kinematics::{Chain, JointLimit, KinematicsError};
use hwall_testkit::{Tol, Verdict, assert_close, attack};

const IIWA7: &str = include_str!("../data/iiwa7.urdf");

const ARM: &str = r#"<robot name="r">
<link name="a"/>
<link name="b"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="j" type="revolute">
<parent link="a"/>
<child link="b"/>
<origin xyz="0 0 1" rpy="0 0.5 0"/>
<axis xyz="0 0 1"/>
<limit lower="-1" upper="2" effort="3" velocity="4"/>
</joint>
</robot>"#;

fn load(text: &str) -> Result<Chain, KinematicsError> {
    Chain::from_urdf_str(text, None, None)
}

fn message(text: &str) -> String {
    match load(text) {
        Err(KinematicsError::UrdfMalformed { message }) => {
            assert!(!message.contains(char::is_control), "{message:?}");
            message
        }
        other => panic!("not refused as malformed: {other:?}"),
    }
}

/// [`ARM`] with one existing piece replaced.
fn with(piece: &str, other: &str) -> String {
    assert!(ARM.contains(piece), "{piece}");
    ARM.replacen(piece, other, 1)
}

#[test]
fn what_a_chain_does_not_need_changes_nothing() {
    let arm = load(ARM).unwrap();
    let extras = r#"<material name="grey"><color rgba="a b c"/></material>
        <gazebo reference="b"><link/><joint/><selfCollide>1</selfCollide></gazebo>
        <transmission name="t"><type>x</type><joint name="j"><hardwareInterface/></joint></transmission>
        <s:joint xmlns:s="http://example.org/sensor"/>
        text &amp; <![CDATA[<joint>]]> <?target instruction?>
        <link name="a"><visual><geometry><mesh/></geometry></visual><collision/><visual/></link>"#;
    let skipped = "<calibration/><dynamics damping=\"x\"/><safety_controller/></joint>";
    let spread = ARM
        .replace("><", ">\r\n\t <!-- a <joint> & more = --> <")
        .replace('\n', "\r\n")
        .replace("=\"", " = \"")
        .replace("0 0 1", "\n 0\t0   1 ")
        .replace("\"-1\"", "' -1\n'");
    let head = "\u{feff}<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- === generated === -->\n";
    let spaces = "xmlns=\"http://www.ros.org\" xmlns:xacro=\"x\"";
    let at_end = |extra: &str| with("</robot>", &format!("{extra}</robot>"));
    for text in [
        with("<link name=\"a\"/>", extras).replace("</joint>", skipped),
        spread,
        format!("{head}{ARM}\n\n<!-- end -->\n"),
        format!("\n\n<?xml version=\"1.0\"?>\n<!-- <robot> -->{ARM}"),
        with("<robot", &format!("<robot {spaces}")),
        // Prefixes that are not declared.
        at_end("<sensor:camera/><x other:y=\"1\"/>"),
        at_end("<xacro:property name=\"p\" value=\"1\"/>"),
        at_end("<gazebo><axis/></gazebo>"),
    ] {
        assert_eq!(load(&text).as_ref(), Ok(&arm), "{text}");
    }
    // A comment in an older encoding.
    let path = std::env::temp_dir().join(format!("latin-{}.urdf", std::process::id()));
    std::fs::write(&path, [&b"<!-- M\xfcller -->"[..], ARM.as_bytes()].concat()).unwrap();
    let read = Chain::from_urdf_file(&path, None, None);
    std::fs::remove_file(&path).unwrap();
    assert_eq!(read, Ok(arm));
    // Too many prefixes are rejected without hanging.
    let many: String = (0..100).map(|k| format!("<p{k}:x/>")).collect();
    assert!(load(&at_end(&many)).is_err());
    // An axis tag without a value is x, like a missing tag.
    let about = |axis: &str| load(&with("<axis xyz=\"0 0 1\"/>", axis)).unwrap();
    for axis in ["", "<axis/>"] {
        assert_eq!(about(axis), about("<axis xyz=\"1 0 0\"/>"));
    }
}

/// The piece, its replacement, and the expected error text.
const WRONG: &str = r#"
link name="a"       | link         | line 2, <link>: attribute name is missing
<mass value="1"/>   |              | line 3, <inertial>: <mass> is missing
mass value="1"      | mass         | line 3, <mass>: attribute value is missing
 iyz="0"            |              | line 3, <inertia>: attribute iyz is missing
 name="j"           |              | line 4, <joint>: attribute name is missing
 type="revolute"    |              | line 4, <joint>: attribute type is missing
<parent link="a"/>  |              | line 4, <joint>: <parent> is missing
parent link="a"     | parent       | line 5, <parent>: attribute link is missing
<child link="b"/>   |              | line 4, <joint>: <child> is missing
 velocity="4"       |              | line 9, <limit>: attribute velocity is missing
revolute            | screw        | line 4, <joint>: unknown joint type "screw"
"0 0 1" rpy         | "0 0" rpy    | line 7, <origin>: xyz is "0 0", not 3 numbers
"0 0 1" rpy         | "" rpy       | line 7, <origin>: xyz is "", not 3 numbers
0 0.5 0             | 0 0.5 0 0    | line 7, <origin>: rpy is "0 0.5 0 0", not 3 numbers
0 0.5 0             | 0 x 0.5 0    | line 7, <origin>: rpy is "0 x 0.5 0", not 3 numbers
0 0.5 0             | 0,0.5,0      | line 7, <origin>: rpy is "0,0.5,0", not 3 numbers
upper="2"           | upper="2 rad"| line 9, <limit>: upper is "2 rad", not 1 number
upper="2"           | upper="&#10;"| line 9, <limit>: upper is "\n", not 1 number
ixx="1"             | ixx="1.0.0"  | line 3, <inertia>: ixx is "1.0.0", not 1 number
<axis               | <axis/><axis | line 8, <axis>: second of its kind in <joint>
"#;

/// [`ARM`] with each replacement, and the error text.
fn rows(table: &str) -> impl Iterator<Item = [String; 2]> {
    table.trim_matches('\n').lines().map(|row| {
        let [piece, other, said] = row.split('|').collect::<Vec<_>>()[..] else {
            panic!("{row}");
        };
        [with(piece.trim_end(), other.trim()), said.trim().to_owned()]
    })
}

/// As [`WRONG`], with numbers that are none or make no sense.
const BAD_NUMBERS: &str = r#"
lower="-1"       | lower="3"          | limits reversed
lower="-1"       | lower="NaN"        | joint limits[0] is NaN
<axis xyz="0 0 1 | <axis xyz="0 0 0   | has no direction
<axis xyz="0 0 1 | <axis xyz="0 NaN 1 | joint axis[1] is NaN
"0 0 1" rpy      | "0 nan 0" rpy      | position[1] is NaN
"0 0 1" rpy      | "0 0 inf" rpy      | position[2] is inf
0 0.5 0          | NaN 0 0            | rpy[0] is NaN
0 0.5 0          | 0 inf 0            | rpy[1] is inf
velocity="4"     | velocity="-1"      | max_velocity
velocity="4"     | velocity="NaN"     | max_velocity
"#;

#[test]
fn bad_numbers_are_errors() {
    for [text, said] in rows(BAD_NUMBERS) {
        let error = load(&text).unwrap_err().to_string();
        assert!(error.contains(&said), "{text}: {error}");
    }
}

/// Regression: limits of 1e154 were accepted; their squares overflow.
#[test]
fn joint_limits_out_of_this_world_are_refused() {
    for limits in [
        ("lower=\"-1\"", "lower=\"-1e154\""),
        ("upper=\"2\"", "upper=\"1e300\""),
    ] {
        let error = load(&with(limits.0, limits.1)).unwrap_err();
        assert!(error.to_string().contains("limit"), "{error}");
    }
}

#[test]
fn what_is_missing_or_wrong_is_named_with_its_line() {
    for [text, said] in rows(WRONG) {
        assert_eq!(message(&text), said, "{text}");
    }
    let long = "9 ".repeat(100_000);
    assert!(message(&with("0 0.5 0", &long)).len() < 200);
}

#[test]
fn only_a_robot_is_read() {
    let other = ARM.replace("robot", "sdf");
    assert_eq!(
        message(&other),
        "line 1, <sdf>: the outermost element must be <robot>"
    );
    for text in ["", "\n", "<!-- -->", "{\"robot\": []}", "<robot/><robot/>"] {
        message(text);
    }
    for end in 1..ARM.len() {
        message(&ARM[..end]);
    }
}

#[test]
fn later_versions_change_origins_and_limits() {
    let version = |text: &str| format!("<robot name=\"r\" version=\"{text}\">");
    let quaternion = with("rpy=\"0 0.5 0\"", "quat_xyzw=\"1 -2 3 4\"");
    let rotation = |head: &str| {
        let text = quaternion.replace("<robot name=\"r\">", head);
        load(&text).unwrap().joints()[0]
            .previous_from_link
            .rotation()
    };
    let turned = DMat3::from_quat(DQuat::from_xyzw(1.0, -2.0, 3.0, 4.0).normalize());
    for later in ["1.1", " 1.2 ", "1.10", "2.0"] {
        assert_close!(rotation(&version(later)), turned, Tol::abs(1e-15));
    }
    for earlier in ["1.0", "", "1", "x.y"] {
        assert_eq!(rotation(&version(earlier)), DMat3::IDENTITY);
    }
    let since_1_1 = |text: String| text.replace("<robot name=\"r\">", &version("1.1"));
    assert_eq!(
        message(&since_1_1(with("rpy", "quat_xyzw=\"0 0 0 1\" rpy"))),
        "line 7, <origin>: both rpy and quat_xyzw are given"
    );
    for bad in ["NaN 0 0 1", "0 0 0 inf"] {
        let text = since_1_1(with("rpy=\"0 0.5 0\"", &format!("quat_xyzw=\"{bad}\"")));
        assert!(matches!(load(&text), Err(KinematicsError::Argument(_))));
    }

    let short =
        with(" effort=\"3\" velocity=\"4\"", "").replace("<robot name=\"r\">", &version("1.2"));
    let chain = load(&short).unwrap();
    let joint = &chain.joints()[0];
    let limit = JointLimit::new(-1.0, 2.0);
    assert_eq!(
        (joint.limit, joint.max_velocity, joint.max_effort),
        (limit, None, None)
    );
}

#[test]
fn hostile_text_is_refused_quickly() {
    let laughs = "<!DOCTYPE r [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;&a;&a;\">]>";
    // Unused entities do no harm; a name that expands to a billion letters is rejected.
    assert_eq!(load(&format!("{laughs}{ARM}")), load(ARM));
    let mut bomb = "<!DOCTYPE r [<!ENTITY e0 \"ha\">".to_owned();
    for level in 1..10 {
        let ten = format!("&e{};", level - 1).repeat(10);
        bomb += &format!("<!ENTITY e{level} \"{ten}\">");
    }
    message(&format!("{bomb}]>{}", with("name=\"j\"", "name=\"&e9;\"")));
    message(&with("name=\"j\"", "name=\"&unknown;\""));

    // Deeply nested simulator extensions are skipped as one unknown element.
    let nested = |depth: usize| "<g>".repeat(depth) + &"</g>".repeat(depth);
    let inside = |extra: &str| with("<link name=\"a\"/>", &format!("<link name=\"a\"/>{extra}"));
    assert_eq!(load(&inside(&nested(150))).unwrap(), load(ARM).unwrap());
    for deep in [nested(150_000), "<g>".repeat(150_000)] {
        assert_eq!(message(&inside(&deep)), "elements are nested too deeply");
    }
    assert_eq!(
        message(&inside(&"<g/>".repeat(300_000))),
        "nodes limit reached"
    );

    let attributes: String = (0..100_000).map(|i| format!(" x{i}=\"\"")).collect();
    assert_eq!(
        message(&inside(&format!("<g{attributes}/>"))),
        "an element has too many attributes"
    );
    let namespaces: String = (0..5_000)
        .map(|i| format!("<g xmlns:x{i}=\"{i}\">"))
        .collect();
    assert_eq!(message(&inside(&namespaces)), "too many namespaces");
}

#[test]
fn mutated_arms_are_errors_or_sound_chains() {
    let report = attack("urdf", &[IIWA7.into()], 20_000, 71, |bytes| {
        match load(&String::from_utf8_lossy(bytes)) {
            Ok(chain) => {
                // Links of 1e308 m are read; using them is an error.
                if let Ok(tip) = chain.forward(&vec![0.1; chain.joint_count()]) {
                    assert!(tip.position_m().is_finite() && tip.rotation().is_finite());
                }
                for joint in chain.joints() {
                    assert!(joint.limit.min_rad <= joint.limit.max_rad);
                    assert!(joint.max_velocity.is_none_or(|v| v > 0.0 && v.is_finite()));
                }
                Verdict::Accepted
            }
            Err(error) => {
                assert!(!error.to_string().contains('\n'), "{error}");
                Verdict::Refused
            }
        }
    });
    assert_eq!(report.findings, 0, "{report:?}");
    assert!(
        report.accepted > 1_000 && report.refused > 2_000,
        "{report:?}"
    );
}

/// Nesting that counting angle brackets misses: an attribute that ends like an empty element, an end tag in a comment.
#[test]
fn nesting_cannot_be_hidden() {
    for (open, close) in [
        ("<g b=\"/>\">", "</g>"),
        ("<g b='/>'>", "</g>"),
        ("<g><!-- </g> -->", "</g>"),
        ("<g><![CDATA[</g>]]>", "</g>"),
        ("<g><?x </g> ?>", "</g>"),
    ] {
        let text = format!(
            "<robot name=\"r\">{}{}</robot>",
            open.repeat(60_000),
            close.repeat(60_000)
        );
        let error = load(&text).unwrap_err();
        assert!(error.to_string().contains("nested"), "{open}: {error}");
    }
    // Text that only looks like nesting is not counted.
    let flat = "<g b='&lt;g>'/><!-- <g> --><![CDATA[<g>]]>".repeat(300);
    let error = load(&format!("<robot name=\"r\">{flat}</robot>")).unwrap_err();
    assert!(!error.to_string().contains("nested"), "{error}");
}

//! A URDF of capsules, with which viewers show the arm that the transforms move.

use crate::skeleton::{BASE, BOARD, Skeleton};
use glam::{DMat3, DVec3};
use hwall::geometry::Pose;
use hwall::kinematics::JointKind;

/// Speed and effort of joints that state none; URDF requires both.
const NOMINAL_SPEED: f64 = 1.0;
const NOMINAL_EFFORT: f64 = 100.0;

impl Skeleton {
    /// The arm as URDF: capsules along its links (cylinders and spheres, which every reader supports) and the board as a box. Links have
    /// the frame names of the recording. Numbers are read back bit by bit, except for rotation angles, which lose about 1e-16 rad.
    #[must_use]
    pub fn to_urdf(&self, name: &str) -> String {
        let mut lines = vec![
            r#"<?xml version="1.0"?>"#.to_owned(),
            format!(r#"<robot name="{}">"#, escaped(name)),
            r#"  <material name="arm"><color rgba="0.75 0.77 0.80 1"/></material>"#.to_owned(),
            r#"  <material name="board"><color rgba="0.85 0.65 0.35 1"/></material>"#.to_owned(),
        ];
        for (link, capsule) in self.capsules() {
            let radius = capsule.radius_m;
            let cylinder = capsule.link_from_cylinder().map(|at| {
                let length = capsule.length_m();
                let shape = format!(r#"<cylinder radius="{radius:?}" length="{length:?}"/>"#);
                visual(&at, &shape, "arm")
            });
            let ball = format!(r#"<sphere radius="{radius:?}"/>"#);
            let ends = [capsule.from_m, capsule.to_m];
            let balls = ends.map(|end_m| visual(&Pose::IDENTITY.at(end_m), &ball, "arm"));
            lines.push(format!(r#"  <link name="{}">"#, escaped(link)));
            lines.extend(cylinder.into_iter().chain(balls));
            lines.push("  </link>".to_owned());
        }
        let board = &self.board;
        let [x, y] = [2.0 * board.half_width_m, 2.0 * board.half_height_m];
        let z = board.thickness_m.max(1e-3);
        let middle = Pose::IDENTITY.at(DVec3::NEG_Z * (0.5 * z));
        lines.push(format!(r#"  <link name="{BOARD}">"#));
        let shape = format!(r#"<box size="{x:?} {y:?} {z:?}"/>"#);
        lines.push(visual(&middle, &shape, "board"));
        lines.push("  </link>".to_owned());
        for (number, joint) in self.joints.iter().enumerate() {
            let [min, max] = [joint.limit.min_rad, joint.limit.max_rad];
            let is_endless = !(min.is_finite() && max.is_finite());
            let kind = match joint.kind {
                JointKind::Revolute if is_endless => "continuous",
                JointKind::Revolute => "revolute",
                JointKind::Prismatic => "prismatic",
            };
            let name = escaped(&joint.name);
            lines.push(format!(r#"  <joint name="{name}" type="{kind}">"#));
            lines.push(ends(self.parent(number), &self.links[number]));
            lines.push(format!("    {}", origin(&joint.previous_from_link)));
            let DVec3 { x, y, z } = joint.axis;
            lines.push(format!(r#"    <axis xyz="{x:?} {y:?} {z:?}"/>"#));
            let speed = joint.max_velocity.unwrap_or(NOMINAL_SPEED);
            let effort = joint.max_effort.unwrap_or(NOMINAL_EFFORT);
            let range = match is_endless {
                true => String::new(),
                false => format!(r#"lower="{min:?}" upper="{max:?}" "#),
            };
            lines.push(format!(
                r#"    <limit {range}velocity="{speed:?}" effort="{effort:?}"/>"#
            ));
            lines.push("  </joint>".to_owned());
        }
        let last = self.links.last().map_or(BASE, String::as_str);
        lines.push(format!(r#"  <joint name="{BOARD}_mount" type="fixed">"#));
        lines.push(ends(last, BOARD));
        lines.push(format!("    {}", origin(&self.last_link_from_board)));
        lines.extend(["  </joint>\n</robot>\n".to_owned()]);
        lines.join("\n")
    }
}

fn ends(parent: &str, child: &str) -> String {
    format!(r#"    <parent link="{parent}"/><child link="{child}"/>"#)
}

fn visual(at: &Pose, shape: &str, material: &str) -> String {
    let origin = origin(at);
    format!(
        r#"    <visual>{origin}<geometry>{shape}</geometry><material name="{material}"/></visual>"#
    )
}

fn origin(pose: &Pose) -> String {
    let p = pose.position_m();
    let [roll, pitch, yaw] = roll_pitch_yaw_rad(&pose.rotation());
    format!(
        "<origin xyz=\"{:?} {:?} {:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>",
        p.x, p.y, p.z
    )
}

/// `R = Rz(yaw) Ry(pitch) Rx(roll)`, as in URDF; if yaw and roll turn about the same axis, roll is zero.
fn roll_pitch_yaw_rad(r: &DMat3) -> [f64; 3] {
    let (x, y, z) = (r.x_axis, r.y_axis, r.z_axis);
    let level = x.x.hypot(x.y);
    let pitch = (-x.z).atan2(level);
    if level > 1e-9 {
        [y.z.atan2(z.z), pitch, x.y.atan2(x.x)]
    } else {
        [0.0, pitch, (-y.x).atan2(y.y)]
    }
}

fn escaped(text: &str) -> String {
    [
        ("&", "&amp;"),
        ("<", "&lt;"),
        (">", "&gt;"),
        ("\"", "&quot;"),
    ]
    .into_iter()
    .fold(text.to_owned(), |text, (sign, safe)| {
        text.replace(sign, safe)
    })
}

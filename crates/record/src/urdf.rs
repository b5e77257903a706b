//! A URDF of capsules, so that viewers show the arm that the transforms move.

use crate::skeleton::{BASE, BOARD, Skeleton};
use glam::{DMat3, DVec3};
use hwall::geometry::Pose;
use hwall::kinematics::JointKind;
use std::fmt::Write;

/// Where a joint says nothing of its speed and effort; URDF wants both.
const USUAL_SPEED: f64 = 1.0;
const USUAL_EFFORT: f64 = 100.0;

impl Skeleton {
    /// The arm as URDF: capsules along its links (cylinders and balls, which every reader knows) and the board as a box.
    /// Links are named as the frames of the recording. Numbers come back bit by bit but for the angles of rotations,
    /// which lose some 1e-16 rad.
    #[must_use]
    pub fn to_urdf(&self, name: &str) -> String {
        let mut xml = String::new();
        // Writing to a string cannot fail.
        let _ = self.write_urdf(&mut xml, name);
        xml
    }

    fn write_urdf(&self, xml: &mut String, name: &str) -> std::fmt::Result {
        writeln!(xml, "<?xml version=\"1.0\"?>")?;
        writeln!(xml, "<robot name=\"{}\">", escaped(name))?;
        writeln!(
            xml,
            "  <material name=\"arm\"><color rgba=\"0.75 0.77 0.80 1\"/></material>"
        )?;
        writeln!(
            xml,
            "  <material name=\"board\"><color rgba=\"0.85 0.65 0.35 1\"/></material>"
        )?;
        for (link, capsule) in self.capsules() {
            writeln!(xml, "  <link name=\"{}\">", escaped(link))?;
            let radius = capsule.radius_m;
            if let Some(cylinder) = capsule.link_from_cylinder() {
                let length = capsule.length_m();
                let shape = format!("<cylinder radius=\"{radius:?}\" length=\"{length:?}\"/>");
                visual(xml, &cylinder, &shape, "arm")?;
            }
            let ball = format!("<sphere radius=\"{radius:?}\"/>");
            for end_m in [capsule.from_m, capsule.to_m] {
                visual(xml, &Pose::IDENTITY.at(end_m), &ball, "arm")?;
            }
            writeln!(xml, "  </link>")?;
        }
        let board = &self.board;
        let size = [
            2.0 * board.half_width_m,
            2.0 * board.half_height_m,
            board.thickness_m.max(1e-3),
        ];
        let middle = Pose::IDENTITY.at(DVec3::NEG_Z * (0.5 * size[2]));
        writeln!(xml, "  <link name=\"{BOARD}\">")?;
        let shape = format!("<box size=\"{:?} {:?} {:?}\"/>", size[0], size[1], size[2]);
        visual(xml, &middle, &shape, "board")?;
        writeln!(xml, "  </link>")?;
        for (number, joint) in self.joints.iter().enumerate() {
            let limit = &joint.limit;
            let endless = !(limit.min_rad.is_finite() && limit.max_rad.is_finite());
            let kind = match joint.kind {
                JointKind::Revolute if endless => "continuous",
                JointKind::Revolute => "revolute",
                JointKind::Prismatic => "prismatic",
            };
            let (parent, child) = (self.parent(number), &self.links[number]);
            writeln!(
                xml,
                "  <joint name=\"{}\" type=\"{kind}\">",
                escaped(&joint.name)
            )?;
            writeln!(
                xml,
                "    <parent link=\"{parent}\"/><child link=\"{child}\"/>"
            )?;
            writeln!(xml, "    {}", origin(&joint.previous_from_link))?;
            let DVec3 { x, y, z } = joint.axis;
            writeln!(xml, "    <axis xyz=\"{x:?} {y:?} {z:?}\"/>")?;
            let speed = joint.max_velocity.unwrap_or(USUAL_SPEED);
            let effort = joint.max_effort.unwrap_or(USUAL_EFFORT);
            let range = match endless {
                true => String::new(),
                false => format!(
                    "lower=\"{:?}\" upper=\"{:?}\" ",
                    limit.min_rad, limit.max_rad
                ),
            };
            writeln!(
                xml,
                "    <limit {range}velocity=\"{speed:?}\" effort=\"{effort:?}\"/>"
            )?;
            writeln!(xml, "  </joint>")?;
        }
        let last = self.links.last().map_or(BASE, String::as_str);
        writeln!(xml, "  <joint name=\"{BOARD}_mount\" type=\"fixed\">")?;
        writeln!(
            xml,
            "    <parent link=\"{last}\"/><child link=\"{BOARD}\"/>"
        )?;
        writeln!(xml, "    {}", origin(&self.last_link_from_board))?;
        writeln!(xml, "  </joint>")?;
        writeln!(xml, "</robot>")
    }
}

fn visual(xml: &mut String, at: &Pose, shape: &str, material: &str) -> std::fmt::Result {
    writeln!(
        xml,
        "    <visual>{}<geometry>{shape}</geometry><material name=\"{material}\"/></visual>",
        origin(at)
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

/// `R = Rz(yaw) Ry(pitch) Rx(roll)`, as URDF has it; where yaw and roll turn about one axis, roll is zero.
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
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c => safe.push(c),
        }
    }
    safe
}

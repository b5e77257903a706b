//! Shared by the tests of general chains: reference configurations and further robots.

use glam::{DMat3, DVec3};
use hwall_kinematics::{Chain, ChainJoint, JointLimit, Pose, SrsGeometry};
use hwall_testkit::Sampler;
use serde_json::Value;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// One reference configuration; see `tests/data/README.md`.
pub(crate) struct Reference(pub(crate) Value);

impl Reference {
    pub(crate) fn tag(&self) -> &str {
        self.0["tag"].as_str().expect("tag")
    }

    pub(crate) fn numbers(&self, key: &str) -> Vec<f64> {
        self.0[key]
            .as_array()
            .expect(key)
            .iter()
            .map(|v| v.as_f64().expect(key))
            .collect()
    }
}

/// A file of this crate's `tests/data`.
pub(crate) fn excerpt(name: &str) -> Value {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    read(&folder.join(name))
}

/// The complete set beside the workspace, which is only on some machines.
pub(crate) fn complete(name: &str) -> Option<Value> {
    hwall_testkit::shared(&format!("reference/kinematics/{name}")).map(|path| read(&path))
}

fn read(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).expect("reference file");
    serde_json::from_str(&text).expect("reference JSON")
}

/// The excerpt in this crate, or the complete set if it is beside the workspace.
pub(crate) fn references() -> Vec<Reference> {
    let name = "kinematics_dynamics.json";
    let (mut all, random) = match complete(name) {
        Some(all) => (all, 200),
        None => (excerpt(name), 20),
    };
    let mut take = |key: &str, count: usize| match all[key].take() {
        Value::Array(list) if list.len() == count => list,
        other => panic!("{count} of {key}: {other}"),
    };
    let cases = [take("hard", 111), take("random", random)].concat();
    cases.into_iter().map(Reference).collect()
}

/// The poses of a set of verdicts of a closed-form reference, each with the rest of its entry.
pub(crate) fn reach_poses(set: &Value) -> Vec<(Pose, Reference)> {
    let poses = set["poses"].as_array().expect("poses").iter().cloned();
    let with_pose = |entry: Reference| {
        let at = DVec3::from_slice(&entry.numbers("p"));
        let pose = Pose::new(row_major(&entry.numbers("R")), at);
        (pose.expect("a pose"), entry)
    };
    poses.map(Reference).map(with_pose).collect()
}

/// Geometry of base to shoulder, upper arm, forearm and hand, m.
pub(crate) const fn geometry([d_bs_m, d_se_m, d_ew_m, d_wf_m]: [f64; 4]) -> SrsGeometry {
    SrsGeometry {
        d_bs_m,
        d_se_m,
        d_ew_m,
        d_wf_m,
    }
}

/// The inverse of [`geometry`].
pub(crate) const fn lengths_m(g: &SrsGeometry) -> [f64; 4] {
    [g.d_bs_m, g.d_se_m, g.d_ew_m, g.d_wf_m]
}

pub(crate) fn row_major(rows: &[f64]) -> DMat3 {
    DMat3::from_cols_slice(rows).transpose()
}

/// Franka Emika Panda to the flange: modified DH table and limits of the published FCI documentation.
pub(crate) fn franka() -> Chain {
    let rows = [
        (0.0, 0.333, 0.0, -2.8973, 2.8973),
        (0.0, 0.0, -FRAC_PI_2, -1.7628, 1.7628),
        (0.0, 0.316, FRAC_PI_2, -2.8973, 2.8973),
        (0.0825, 0.0, FRAC_PI_2, -3.0718, -0.0698),
        (-0.0825, 0.384, -FRAC_PI_2, -2.8973, 2.8973),
        (0.0, 0.0, FRAC_PI_2, -0.0175, 3.7525),
        (0.088, 0.0, FRAC_PI_2, -2.8973, 2.8973),
    ];
    let rows = rows.into_iter().enumerate();
    let joints = rows.map(|(i, (a, d, alpha, min_rad, max_rad))| {
        let origin = about_x(alpha, DVec3::X * a) * shift(0.0, 0.0, d);
        let (name, limit) = (
            format!("panda_{}", i + 1),
            JointLimit::new(min_rad, max_rad),
        );
        ChainJoint::revolute(name, origin, DVec3::Z, limit)
    });
    Chain::new(joints.collect(), shift(0.0, 0.0, 0.107)).expect("panda")
}

/// Universal Robots UR5e: the maker's DH table, every joint ±360°.
pub(crate) fn ur5e() -> Chain {
    let rows = [
        (0.1625, 0.0, FRAC_PI_2),
        (0.0, -0.425, 0.0),
        (0.0, -0.3922, 0.0),
        (0.1333, 0.0, FRAC_PI_2),
        (0.0997, 0.0, -FRAC_PI_2),
        (0.0996, 0.0, 0.0),
    ];
    let mut origin = Pose::IDENTITY;
    let mut joints = Vec::new();
    for (i, (d, a, alpha)) in rows.into_iter().enumerate() {
        let limit = JointLimit::new(-2.0 * PI, 2.0 * PI);
        let name = format!("ur_{}", i + 1);
        joints.push(ChainJoint::revolute(name, origin, DVec3::Z, limit));
        origin = shift(0.0, 0.0, d) * about_x(alpha, DVec3::X * a);
    }
    Chain::new(joints, origin).expect("ur5e")
}

/// Revolute and prismatic joints with arbitrary axes and origins.
pub(crate) fn random_chain(sampler: &mut Sampler, n: usize, prismatic_share: f64) -> Chain {
    let joints = (0..n).map(|i| {
        let (rotation, direction) = (sampler.rotation(), sampler.unit_vector());
        let origin = Pose::new(rotation, direction * sampler.uniform(0.0, 0.4)).expect("pose");
        let axis = sampler.unit_vector() * sampler.uniform(0.1, 3.0);
        let name = format!("joint {i}");
        if sampler.uniform(0.0, 1.0) < prismatic_share {
            ChainJoint::prismatic(name, origin, axis, JointLimit::new(-0.3, 0.5))
        } else {
            ChainJoint::revolute(name, origin, axis, JointLimit::new(-2.0, 2.5))
        }
    });
    let joints = joints.collect();
    let tip = Pose::new(sampler.rotation(), sampler.unit_vector() * 0.2);
    Chain::new(joints, tip.expect("pose")).expect("chain")
}

/// Uniform within the limits, unlimited ones cut at half a turn.
pub(crate) fn random_q(chain: &Chain, sampler: &mut Sampler) -> Vec<f64> {
    let limits = chain.joints().iter().map(|joint| joint.limit);
    limits
        .map(|l| sampler.uniform(l.min_rad.max(-PI), l.max_rad.min(PI)))
        .collect()
}

pub(crate) fn shift(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_translation(DVec3::new(x, y, z)).expect("finite")
}

fn about_x(angle: f64, position_m: DVec3) -> Pose {
    Pose::new(DMat3::from_rotation_x(angle), position_m).expect("rotation")
}

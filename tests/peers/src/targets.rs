//! What every solver is given, and the judge that marks what it returns.

use glam::{DMat3, DVec3};
use hwall_kinematics::{JointPositions, Pose, SrsArm, rotation_vector};
use hwall_testkit::Sampler;

/// Seven joint angles, rad.
pub type Joints = [f64; 7];

/// Length by which the third set lies beyond the stretched arm, m.
pub const BEYOND_M: f64 = 1e-4;

const SHOULDER_M: DVec3 = DVec3::new(0.0, 0.0, 0.34);

/// Flange poses and, for each, the configuration an iterative solver starts from.
pub struct Targets {
    /// Flange in base.
    pub poses: Vec<Pose>,
    /// Uniform within the limits, independent of the pose.
    pub starts: Vec<Joints>,
}

impl Targets {
    fn new(sampler: &mut Sampler, poses: Vec<Pose>) -> Self {
        let starts = poses
            .iter()
            .map(|_| sampler.array_within(limits()))
            .collect();
        Self { poses, starts }
    }

    /// Poses of configurations drawn uniformly within the limits.
    pub fn reachable(sampler: &mut Sampler, count: usize) -> Self {
        let poses = (0..count)
            .map(|_| forward(&sampler.array_within(limits())))
            .collect();
        Self::new(sampler, poses)
    }

    /// Wrist centres uniform in the ball of the stretched arm, rotations uniform; those kept that the
    /// verdict
    /// of hwall denies, so it is the limits that forbid them and not a mere lack of length. Should a
    /// peer hold
    /// such a pose, the tables show it under "held after all".
    pub fn unreachable(sampler: &mut Sampler, count: usize) -> Self {
        let arm = SrsArm::iiwa7();
        let mut poses = Vec::with_capacity(count);
        while poses.len() < count {
            // The cube root makes the volume uniform.
            let wrist_m =
                SHOULDER_M + sampler.unit_vector() * (0.8 * sampler.uniform(0.0, 1.0).cbrt());
            let rotation = sampler.rotation();
            let pose = Pose::new(rotation, wrist_m + rotation.z_axis * 0.126).expect("a rotation");
            if !arm.is_reachable(&pose) {
                poses.push(pose);
            }
        }
        Self::new(sampler, poses)
    }

    /// The stretched arm, shifted outwards along itself by [`BEYOND_M`]: out of reach by the triangle
    /// inequality.
    pub fn just_beyond(sampler: &mut Sampler, count: usize) -> Self {
        let pose = |sampler: &mut Sampler| {
            let mut q = sampler.array_within(limits());
            q[3] = 0.0;
            let stretched = forward(&q);
            let wrist_m = stretched.position_m() - stretched.rotation().z_axis * 0.126;
            let shifted_m = stretched.position_m() + (wrist_m - SHOULDER_M).normalize() * BEYOND_M;
            Pose::new(stretched.rotation(), shifted_m).expect("a rotation")
        };
        let poses = (0..count).map(|_| pose(sampler)).collect();
        Self::new(sampler, poses)
    }
}

/// Joint limits of the iiwa 7 as pairs, rad.
pub fn limits() -> [(f64, f64); 7] {
    [170.0_f64, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0]
        .map(|deg| (-deg.to_radians(), deg.to_radians()))
}

/// Forward kinematics of the judge: the product of elementary rotations, sharing no code with any
/// contestant.
pub fn forward(q: &Joints) -> Pose {
    let (y, z) = (DMat3::from_rotation_y, DMat3::from_rotation_z);
    let upper_arm = z(q[0]) * y(q[1]) * z(q[2]);
    let forearm = upper_arm * y(-q[3]);
    let flange = forearm * z(q[4]) * y(q[5]) * z(q[6]);
    let position_m =
        DVec3::Z * 0.34 + upper_arm.z_axis * 0.4 + forearm.z_axis * 0.4 + flange.z_axis * 0.126;
    Pose::new(flange, position_m).expect("finite joints")
}

/// How far an answer is from what was asked.
#[derive(Clone, Copy)]
pub struct Mark {
    /// Distance of the flange, m.
    pub error_m: f64,
    /// Angle of the flange, rad.
    pub error_rad: f64,
    /// Largest excess over a joint limit, rad; 0 inside.
    pub beyond_limit_rad: f64,
}

impl Mark {
    /// NaN in an answer gives NaN marks, which count as failure.
    pub fn of(q: &Joints, target: &Pose) -> Self {
        if q.iter().any(|angle| !angle.is_finite()) {
            return Self {
                error_m: f64::NAN,
                error_rad: f64::NAN,
                beyond_limit_rad: f64::NAN,
            };
        }
        let pose = forward(q);
        let excess = |(angle, (lo, hi)): (&f64, (f64, f64))| (lo - angle).max(angle - hi).max(0.0);
        Self {
            error_m: pose.position_m().distance(target.position_m()),
            error_rad: rotation_vector(pose.rotation().transpose() * target.rotation()).length(),
            beyond_limit_rad: q.iter().zip(limits()).map(excess).fold(0.0, f64::max),
        }
    }

    /// Within 1 mm, 1 mrad and (by 1e-6 rad) the limits: what any user would call solved.
    pub fn holds(&self) -> bool {
        self.error_m <= 1e-3 && self.error_rad <= 1e-3 && self.beyond_limit_rad <= 1e-6
    }

    /// Within 1 µm and 1 µrad: nearer than a pose that is out of reach by [`BEYOND_M`] allows.
    pub fn holds_finely(&self) -> bool {
        self.error_m <= 1e-6 && self.error_rad <= 1e-6 && self.beyond_limit_rad <= 1e-6
    }
}

/// The joint array type of hwall.
pub fn positions(q: &Joints) -> JointPositions {
    JointPositions(*q)
}

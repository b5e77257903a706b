//! Joints by regression on where the hand really touches: what is left to err when nothing of the hand is unknown.

use super::ends::EndError;
use anyhow::ensure;
use glam::{DMat3, DVec3};
use hwall_kinematics::{ArmKinematics, JointPositions};
use hwall_stage::person::responses::Answered;

/// The joints of one part as an affine function of the touched point.
struct Affine {
    middle_m: DVec3,
    mean_rad: [f64; 7],
    slope_rad_per_m: [DVec3; 7],
}

impl Affine {
    /// Least squares, with a ridge of a millimetre, which only matters where all points lie in a plane.
    fn fit(answered: &[&Answered]) -> Self {
        const RIDGE_M2: f64 = 1e-6;
        let count = answered.len().max(1) as f64;
        let middle_m = answered.iter().map(|a| a.reach.contact_m).sum::<DVec3>() / count;
        let mean = |i: usize| answered.iter().map(|a| end(a)[i]).sum::<f64>() / count;
        let mean_rad: [f64; 7] = std::array::from_fn(mean);
        let mut scatter = DMat3::from_diagonal(DVec3::splat(count * RIDGE_M2));
        let mut products = [DVec3::ZERO; 7];
        for a in answered {
            let off = a.reach.contact_m - middle_m;
            scatter += DMat3::from_cols(off * off.x, off * off.y, off * off.z);
            for (i, product) in products.iter_mut().enumerate() {
                *product += off * (end(a)[i] - mean_rad[i]);
            }
        }
        let inverse = scatter.inverse();
        Self {
            middle_m,
            mean_rad,
            slope_rad_per_m: products.map(|product| inverse * product),
        }
    }

    fn joints(&self, point_m: DVec3) -> JointPositions {
        let off = point_m - self.middle_m;
        let joint = |i: usize| self.mean_rad[i] + self.slope_rad_per_m[i].dot(off);
        JointPositions(std::array::from_fn(joint))
    }
}

fn end(answered: &Answered) -> [f64; 7] {
    let last = answered.shown.joints.last();
    last.map_or([0.0; 7], |joints| joints.0)
}

/// Errors on held-out reaches. `members`: which demonstrations make up each part; a reach belongs to the part in which the
/// configuration nearest to its own is.
///
/// # Errors
/// No demonstration.
pub(super) fn errors(
    arm: &dyn ArmKinematics,
    learnt: &[Answered],
    members: &[Vec<usize>],
    held_out: &[Answered],
) -> anyhow::Result<Vec<EndError>> {
    ensure!(!learnt.is_empty(), "no demonstrations");
    let mut part_of = vec![0; learnt.len()];
    for (part, members) in members.iter().enumerate() {
        for member in members {
            part_of[*member] = part;
        }
    }
    let fits: Vec<Affine> = members
        .iter()
        .map(|members| Affine::fit(&members.iter().map(|i| &learnt[*i]).collect::<Vec<_>>()))
        .collect();
    let of = |answered: &Answered| {
        let truth = end(answered);
        let away = |i: usize| -> f64 {
            let other = end(&learnt[i]);
            (truth.iter().zip(other))
                .map(|(a, b)| (a - b).powi(2))
                .sum()
        };
        let nearest = (0..learnt.len()).min_by(|a, b| away(*a).total_cmp(&away(*b)));
        let joints = fits[part_of[nearest.unwrap_or(0)]].joints(answered.reach.contact_m);
        EndError::of_joints(arm, &joints, answered)
    };
    Ok(held_out.iter().map(of).collect())
}

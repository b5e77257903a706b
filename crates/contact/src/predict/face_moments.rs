//! The contact on a surface, from all its faces.

use super::surface_shares::Face;
use crate::matrices::{square, trace};
use glam::{DMat3, DVec3};

/// Faces agree if their squared distance is at most this many times their summed variance.
const AGREE: f64 = 1.0;

/// Mean and covariance of a contact by the faces of one surface.
pub(super) struct Moments {
    /// Mean of the faces that agree with the best one and whose source says where, m: nobody would touch a mean between two possible targets.
    pub(super) mean_m: DVec3,
    /// Covariance about that mean, over all faces, m²: positive semidefinite, like that of each face.
    pub(super) covariance_m2: DMat3,
}

impl Moments {
    /// `says_where`: does the source of a face say where the contact is?
    pub(super) fn of<'a, I: Iterator<Item = &'a Face>>(
        faces: impl Fn() -> I,
        best: &Face,
        says_where: impl Fn(&Face) -> bool,
    ) -> Self {
        let agree = |f: &&Face| {
            let sum_m2 = trace(&f.covariance_m2) + trace(&best.covariance_m2);
            says_where(f) && f.mean_m.distance_squared(best.mean_m) <= AGREE * sum_m2
        };
        // A vague component must not shift the mean away from a sharp one.
        let best_m2 = trace(&best.covariance_m2);
        let sharp = |f: &Face| {
            let vaguer = trace(&f.covariance_m2) > best_m2;
            f.mass
                * if vaguer {
                    best_m2 / trace(&f.covariance_m2)
                } else {
                    1.0
                }
        };
        let agreed = || faces().filter(agree);
        let mean_m =
            agreed().map(|f| f.mean_m * sharp(f)).sum::<DVec3>() / agreed().map(sharp).sum::<f64>();
        let weight: f64 = faces().map(|f| f.mass).sum();
        let covariance_m2 = faces()
            .map(|f| (f.covariance_m2 + square(f.mean_m - mean_m)) * (f.mass / weight))
            .fold(DMat3::ZERO, |sum, c| sum + c);
        Self {
            mean_m,
            covariance_m2,
        }
    }
}

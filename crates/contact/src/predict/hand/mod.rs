//! The hand relative to its reach and to the surfaces.

pub(super) mod free_side;
pub(super) mod phase;
pub(super) mod place;
pub(super) mod resting;

/// A hand at rest, for tests.
#[cfg(test)]
pub(super) fn resting_at(point_m: glam::DVec3, t_s: f64) -> hwall_hand::HandState {
    hwall_hand::HandState {
        t_s,
        point: hwall_hand::HandPoint::Index,
        point_m,
        velocity_m_per_s: glam::DVec3::ZERO,
        direction: None,
        smoothed_m: [point_m; 2],
        delay_s: 0.01,
        unseen_s: 0.0,
        palm_m: None,
    }
}

//! A pinhole camera and its pixels.

use glam::{DVec2, DVec3};

/// Looks from one point at another, z up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Camera {
    pub(super) eye_m: DVec3,
    right: DVec3,
    up: DVec3,
    ahead: DVec3,
    /// Focal length, pixels.
    focal_px: f64,
    middle_px: DVec2,
}

/// A point on the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub(super) at_px: DVec2,
    /// Scale there, pixels per metre.
    pub(super) scale_px_per_m: f64,
}

/// Nothing closer to the eye than this is drawn, m.
const NEAR_M: f64 = 0.05;

impl Camera {
    /// With the middle of the picture at `middle_px` and the focal length `focal_px`: the size of 1 m at a distance of 1 m.
    pub(super) fn new(eye_m: DVec3, target_m: DVec3, focal_px: f64, middle_px: DVec2) -> Self {
        let ahead = (target_m - eye_m).normalize_or(DVec3::X);
        let right = ahead.cross(DVec3::Z).normalize_or(DVec3::NEG_Y);
        Self {
            eye_m,
            right,
            up: right.cross(ahead),
            ahead,
            focal_px,
            middle_px,
        }
    }

    /// `None` for a point behind the eye, or one that is not finite.
    pub(super) fn see(&self, point_m: DVec3) -> Option<Seen> {
        let way_m = point_m - self.eye_m;
        let depth_m = way_m.dot(self.ahead);
        if !point_m.is_finite() || depth_m < NEAR_M {
            return None;
        }
        let scale_px_per_m = self.focal_px / depth_m;
        let offset_m = DVec2::new(way_m.dot(self.right), -way_m.dot(self.up));
        Some(Seen {
            at_px: self.middle_px + offset_m * scale_px_per_m,
            scale_px_per_m,
        })
    }

    /// A polygon, clipped to what is in front of the eye; empty if nothing is left.
    pub(super) fn polygon(&self, corners_m: &[DVec3]) -> Vec<DVec2> {
        let depth_m = |point_m: DVec3| (point_m - self.eye_m).dot(self.ahead) - 1.01 * NEAR_M;
        let mut seen = Vec::with_capacity(corners_m.len() + 1);
        for (i, &to_m) in corners_m.iter().enumerate() {
            let from_m = corners_m[(i + corners_m.len() - 1) % corners_m.len()];
            let (a, b) = (depth_m(from_m), depth_m(to_m));
            if (a < 0.0) != (b < 0.0) {
                let cut_m = from_m + (to_m - from_m) * (a / (a - b));
                seen.extend(self.see(cut_m).map(|s| s.at_px));
            }
            if b >= 0.0 {
                seen.extend(self.see(to_m).map(|s| s.at_px));
            }
        }
        seen
    }

    /// The directions right and up on the picture, and towards the eye, in the base frame.
    pub(super) const fn axes(&self) -> [DVec3; 3] {
        [
            self.right,
            self.up,
            DVec3::new(-self.ahead.x, -self.ahead.y, -self.ahead.z),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_right_and_up_is_so_on_the_picture() {
        let camera = Camera::new(DVec3::new(-2.0, 0.0, 0.0), DVec3::ZERO, 100.0, DVec2::ZERO);
        let seen = camera.see(DVec3::new(0.0, -1.0, 0.5)).unwrap();
        assert_eq!(seen.at_px, DVec2::new(50.0, -25.0));
        assert_eq!(seen.scale_px_per_m, 50.0);
        assert_eq!(camera.see(DVec3::new(-3.0, 0.0, 0.0)), None);
        assert_eq!(camera.see(DVec3::NAN), None);
    }

    #[test]
    fn a_polygon_through_the_eye_is_cut() {
        let camera = Camera::new(DVec3::ZERO, DVec3::X, 100.0, DVec2::ZERO);
        let triangle = [
            DVec3::new(2.0, 1.0, 0.0),
            DVec3::new(2.0, -1.0, 0.0),
            DVec3::new(-2.0, 0.0, 1.0),
        ];
        let seen = camera.polygon(&triangle);
        assert_eq!(seen.len(), 4);
        assert!(seen.iter().all(|p| p.is_finite()));
        let behind = triangle.map(|p| p - DVec3::X * 5.0);
        assert!(camera.polygon(&behind).is_empty());
    }
}

//! One sample of a tracked hand.

use crate::body_point::{BodyPoint, NamedPoint};
use crate::error::HandError;
use crate::hand_point::HandPoint;
use glam::DVec3;
use hwall_geometry::Pose;

/// Largest coordinate that counts as a measurement, m; anything beyond is treated as missing, so that later products stay finite.
pub const MAX_COORDINATE_M: f64 = 1e6;

/// Index of the wrist among the joints of an OpenXR hand.
const OPENXR_WRIST: usize = 1;

/// A point of the hand and its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackedPoint {
    /// Which point.
    pub point: HandPoint,
    /// Position, m.
    pub position_m: DVec3,
}

/// A line of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GazeRay {
    /// The head or the eye, m.
    pub origin_m: DVec3,
    /// Unit direction.
    pub direction: DVec3,
}

impl GazeRay {
    /// The same line in another frame.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        Self {
            origin_m: a_from_b.transform_point(self.origin_m),
            direction: a_from_b.transform_vector(self.direction),
        }
    }
}

/// Most bystanders of a frame.
pub const MOST_BYSTANDERS: usize = 4;

/// The heads of all people who stand by, besides the person whose hand is tracked; an empty list says that nobody does.
///
/// Everybody keeps their place in the list, also while they are not seen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bystanders {
    count: usize,
    heads_m: [Option<DVec3>; MOST_BYSTANDERS],
}

impl Bystanders {
    /// Points midway between the eyes, m, in the frame of the hand; `None`: there, but not seen.
    ///
    /// # Errors
    /// More than [`MOST_BYSTANDERS`].
    pub fn new(heads_m: &[Option<DVec3>]) -> Result<Self, HandError> {
        let (count, most) = (heads_m.len(), MOST_BYSTANDERS);
        let mut all = Self {
            count,
            ..Self::default()
        };
        let places = all.heads_m.get_mut(..count);
        let places = places.ok_or(HandError::TooManyBystanders { count, most })?;
        places.copy_from_slice(heads_m);
        Ok(all)
    }

    /// In their places, m; `None` where a head is not seen, or a coordinate is no usable number.
    pub fn heads_m(&self) -> impl ExactSizeIterator<Item = Option<DVec3>> {
        self.heads_m.iter().take(self.count).map(|m| usable(*m))
    }
}

/// One sample of the tracker: the hand, the head and the gaze at one time, in one frame.
///
/// A point that the tracker did not see is `None`. A coordinate that is NaN, infinite or beyond [`MAX_COORDINATE_M`] counts as not seen:
/// [`HandFrame::point`] and everything built on it skip it, so a NaN from a driver stops here.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HandFrame {
    /// Time, s, on the tracker's clock.
    pub t_s: f64,
    /// Centre of the palm, m.
    pub palm_m: Option<DVec3>,
    /// Tips of thumb, index, middle, ring and little finger, m.
    pub tips_m: [Option<DVec3>; 5],
    /// Arm and controller, in the order of [`BodyPoint::ALL`], m.
    pub body_m: [Option<DVec3>; 6],
    /// Palm of the other hand, m. It is only an obstacle: it does not touch, and nothing is learned from it.
    pub other_hand_m: Option<DVec3>,
    /// Head (midway between the eyes), m.
    pub head_m: Option<DVec3>,
    /// Unit direction of gaze.
    pub gaze: Option<DVec3>,
    /// Who stands by; `None`: this frame does not say. They are only obstacles.
    pub bystanders: Option<Bystanders>,
    /// True if this frame shows a different person than the previous one.
    pub is_of_another: bool,
}

impl HandFrame {
    /// A frame at this time, s, without tracked points.
    #[must_use]
    pub fn empty(t_s: f64) -> Self {
        Self {
            t_s,
            ..Self::default()
        }
    }

    /// From the 26 joints of an OpenXR hand, m, in the order of `XrHandJointEXT`; a joint without a valid position is `None`.
    #[must_use]
    pub fn from_openxr(t_s: f64, joints_m: &[Option<DVec3>; 26]) -> Self {
        let mut frame = Self::empty(t_s);
        for point in HandPoint::ALL {
            frame.set_point(point, joints_m[point.openxr_joint()]);
        }
        frame.set_body(BodyPoint::Wrist, joints_m[OPENXR_WRIST]);
        frame
    }

    /// A point of the hand, m; `None` if missing or unusable.
    #[must_use]
    pub fn point(&self, which: HandPoint) -> Option<DVec3> {
        usable(match which {
            HandPoint::Palm => self.palm_m,
            tip => self.tips_m[tip as usize - 1],
        })
    }

    /// Sets or clears a point of the hand, m.
    pub fn set_point(&mut self, which: HandPoint, value_m: Option<DVec3>) {
        match which {
            HandPoint::Palm => self.palm_m = value_m,
            tip => self.tips_m[tip as usize - 1] = value_m,
        }
    }

    /// A point of the arm or a controller, m; `None` if missing or unusable.
    #[must_use]
    pub fn body(&self, which: BodyPoint) -> Option<DVec3> {
        usable(self.body_m[which as usize])
    }

    /// Sets or clears a point of the arm or a controller, m.
    pub fn set_body(&mut self, which: BodyPoint, value_m: Option<DVec3>) {
        self.body_m[which as usize] = value_m;
    }

    /// A point by its name, m; `None` if missing or unusable.
    #[must_use]
    pub fn named(&self, which: NamedPoint) -> Option<DVec3> {
        match which {
            NamedPoint::Hand(point) => self.point(point),
            NamedPoint::Body(point) => self.body(point),
        }
    }

    /// Sets or clears a point by its name, m.
    pub fn set_named(&mut self, which: NamedPoint, value_m: Option<DVec3>) {
        match which {
            NamedPoint::Hand(point) => self.set_point(point, value_m),
            NamedPoint::Body(point) => self.set_body(point, value_m),
        }
    }

    /// All six points in the order of [`HandPoint::ALL`], m.
    #[must_use]
    pub fn points(&self) -> [Option<DVec3>; 6] {
        HandPoint::ALL.map(|p| self.point(p))
    }

    /// The same sample in another frame; its time is unchanged.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Pose) -> Self {
        let point = |p: DVec3| a_from_b.transform_point(p);
        Self {
            palm_m: self.palm_m.map(point),
            tips_m: self.tips_m.map(|tip_m| tip_m.map(point)),
            body_m: self.body_m.map(|at_m| at_m.map(point)),
            other_hand_m: self.other_hand_m.map(point),
            head_m: self.head_m.map(point),
            gaze: self.gaze.map(|d| a_from_b.transform_vector(d)),
            bystanders: self.bystanders.map(|all| Bystanders {
                heads_m: all.heads_m.map(|head_m| head_m.map(point)),
                ..all
            }),
            ..*self
        }
    }

    /// The frame of a tracker with only these points, with or without an eye tracker; head, other hand and bystanders are kept.
    #[must_use]
    pub fn limited_to<P: Into<NamedPoint> + Copy>(&self, points: &[P], gaze: bool) -> Self {
        let mut limited = Self {
            other_hand_m: self.other_hand_m,
            head_m: self.head_m,
            gaze: self.gaze.filter(|_| gaze),
            bystanders: self.bystanders,
            is_of_another: self.is_of_another,
            ..Self::empty(self.t_s)
        };
        for &point in points {
            limited.set_named(point.into(), self.named(point.into()));
        }
        limited
    }

    /// The contact point and its position, m: the first tracked one of [`HandPoint::BY_CONTACT`].
    #[must_use]
    pub fn contact_point(&self) -> Option<TrackedPoint> {
        HandPoint::BY_CONTACT.into_iter().find_map(|point| {
            let position_m = self.point(point)?;
            Some(TrackedPoint { point, position_m })
        })
    }

    /// The line of sight, if both head and gaze are tracked.
    #[must_use]
    pub fn gaze_ray(&self) -> Option<GazeRay> {
        let origin_m = usable(self.head_m)?;
        let direction = usable(self.gaze)?.try_normalize()?;
        Some(GazeRay {
            origin_m,
            direction,
        })
    }
}

/// Keeps a vector only if every coordinate is usable.
fn usable(v: Option<DVec3>) -> Option<DVec3> {
    // A NaN fails the comparison, so it is dropped as well.
    v.filter(|v| v.to_array().iter().all(|c| c.abs() <= MAX_COORDINATE_M))
}

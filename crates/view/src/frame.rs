//! What is seen at an instant.

use crate::body::{MOST_PARTS, ViewPart};
use crate::hand::ViewHand;
use crate::scene::MOST_MOVING;
use crate::state::ViewState;
use glam::{DMat3, DVec3};
use hwall::Session;
use hwall::contact::{ContactPrediction, Predictor};
use hwall::hand::HandFrame;
use hwall::haptics::{ArmState, LinkInFront, surface_axes};
use hwall::kinematics::JointPositions;

/// Where the hand is predicted to touch, base frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ViewPrediction {
    /// The point, m.
    pub point_m: DVec3,
    /// Unit normal of the surface there, towards the hand.
    pub normal: DVec3,
    /// Index of the surface in the scene.
    pub surface: Option<u32>,
    /// Half axes, in the plane of the surface, of the ellipse that contains the touch with probability 90 %, m; `None`: unknown.
    pub region_m: Option<[DVec3; 2]>,
    /// Time until the touch, s; `None`: the hand does not approach.
    pub contact_s: Option<f64>,
}

impl ViewPrediction {
    /// From a predicted contact in the base frame.
    #[must_use]
    pub fn of(contact: &ContactPrediction) -> Self {
        Self {
            point_m: contact.point_m,
            normal: contact.normal,
            surface: u32::try_from(contact.surface.0).ok(),
            region_m: contact.covariance_m2.and_then(|covariance| {
                let ninety = ContactPrediction::region_squared(0.9);
                region_m(&covariance, contact.normal, ninety)
            }),
            contact_s: contact.time_to_contact_s.map(|time| time.mean_s),
        }
    }
}

/// Half axes, m, of the ellipse of a covariance, m², in the plane of a normal; `ninety`: its squared distance in standard deviations.
fn region_m(covariance_m2: &DMat3, normal: DVec3, ninety: f64) -> Option<[DVec3; 2]> {
    let [x, y] = surface_axes(normal).ok()?;
    let (a, b, c) = (
        x.dot(*covariance_m2 * x),
        x.dot(*covariance_m2 * y),
        y.dot(*covariance_m2 * y),
    );
    // Eigenvalues of [[a, b], [b, c]] and the angle of the first axis.
    let (mean, half) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
    let (sin, cos) = (0.5 * (2.0 * b).atan2(a - c)).sin_cos();
    let length_m = |variance_m2: f64| (ninety * variance_m2.max(0.0)).sqrt();
    let axes_m = [
        (x * cos + y * sin) * length_m(mean + half),
        (y * cos - x * sin) * length_m(mean - half),
    ];
    axes_m
        .iter()
        .all(|axis_m| axis_m.is_finite())
        .then_some(axes_m)
}

/// What is seen at an instant. All positions are in the arm's base frame: z up, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewFrame {
    /// Time on the arm's clock, s.
    pub t_s: f64,
    /// Joints of the arm, rad.
    pub q: JointPositions,
    /// The hand; lost if no joint is visible.
    pub hand: ViewHand,
    /// The head.
    pub head_m: Option<DVec3>,
    /// Line of sight: origin and unit direction.
    pub gaze: Option<(DVec3, DVec3)>,
    /// Where the hand is predicted to touch.
    pub predicted: Option<ViewPrediction>,
    /// Where the board is sent: point and unit normal.
    pub goal: Option<(DVec3, DVec3)>,
    /// Time until the board is there, s.
    pub left_s: Option<f64>,
    /// Force of the hand on the board, base axes, N.
    pub force_n: Option<DVec3>,
    /// Openings of the moving surfaces, rad or m, in the order of the scene; unused ones are zero.
    pub openings: [f64; MOST_MOVING],
    /// The parts that the supervisor uses, if requested by [`ViewFrame::with_parts`]; none otherwise.
    pub parts: [Option<ViewPart>; MOST_PARTS],
    /// A link of the arm in front of a surface within reach of the person.
    pub link_in_front: Option<LinkInFront>,
    /// Place of the base in the scene, m, and its heading about z, rad, if it drives; `None`: the scene is in the base frame. Only replays show it.
    pub base: Option<(DVec3, f64)>,
    /// What the board is doing.
    pub state: ViewState,
}

impl ViewFrame {
    /// A waiting arm at an instant, and nothing else.
    #[must_use]
    pub const fn new(t_s: f64, q: JointPositions) -> Self {
        Self {
            t_s,
            q,
            hand: ViewHand::LOST,
            head_m: None,
            gaze: None,
            predicted: None,
            goal: None,
            left_s: None,
            force_n: None,
            openings: [0.0; MOST_MOVING],
            parts: [None; MOST_PARTS],
            link_in_front: None,
            base: None,
            state: ViewState::Waiting,
        }
    }

    /// A session at the time of a state of its arm. `seen` is the newest frame of the tracker, in the base frame. A hand that the session
    /// considers lost is not shown. Allocates nothing.
    #[must_use]
    pub fn of<P: Predictor>(
        session: &Session<P>,
        state: &ArmState,
        seen: Option<&HandFrame>,
    ) -> Self {
        let control = session.control();
        let step = control.last_step();
        let tracked = session.tracking().is_some_and(|t| t.state().is_some());
        let hand = seen.filter(|_| tracked).map(ViewHand::from_frame);
        let gaze = seen.and_then(HandFrame::gaze_ray);
        let unit = |normal: DVec3| normal.normalize_or(DVec3::Z);
        let mut openings = [0.0; MOST_MOVING];
        for (opening, moving) in openings.iter_mut().zip(control.moving()) {
            *opening = moving.position;
        }
        Self {
            hand: hand.unwrap_or(ViewHand::LOST),
            head_m: seen.and_then(|s| s.head_m).filter(|m| m.is_finite()),
            gaze: gaze.map(|ray| (ray.origin_m, ray.direction)),
            predicted: session.contact().as_ref().map(ViewPrediction::of),
            goal: control.target().map(|t| (t.point_m, unit(t.normal))),
            left_s: step.and_then(|step| step.left_s),
            force_n: step.and_then(|step| step.wrench).map(|w| w.force_n),
            openings,
            link_in_front: control.link_in_front(),
            state: session.state().into(),
            ..Self::new(state.t_s, state.q)
        }
    }

    /// The same with the parts that the session's supervisor uses: the arm as in this frame, the person as last seen. Without a supervisor
    /// there are none. Allocates nothing.
    #[must_use]
    pub fn with_parts<P: Predictor>(mut self, session: &Session<P>) -> Self {
        let Some(supervisor) = session.control().supervisor() else {
            return self;
        };
        let capsules = supervisor.separation().body().at(&self.q);
        let arm = capsules.all().iter().map(|capsule| (None, *capsule));
        let person = supervisor.person().capsules();
        let person = person.map(|(region, capsule)| (Some(region), capsule));
        for (part, (region, capsule)) in self.parts.iter_mut().zip(arm.chain(person)) {
            *part = Some(ViewPart { capsule, region });
        }
        self
    }

    /// Time from the board's arrival at its goal to that of the hand, s; negative if the hand is first. `None` if either is unknown.
    #[must_use]
    pub fn lead_s(&self) -> Option<f64> {
        Some(self.predicted?.contact_s? - self.left_s?)
    }
}

//! What viewers show of a session at one instant.

use glam::{DMat3, DVec3};
use hwall::contact::Predictor;
use hwall::haptics::ArmState;
use hwall::{Session, SessionState};

/// Largest number of moving surfaces in a view; further ones are not drawn.
pub(crate) const MOST_MOVING: usize = 8;

/// A predicted contact, as drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SeenContact {
    pub(crate) point_m: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) covariance_m2: Option<DMat3>,
    pub(crate) in_s: Option<f64>,
    pub(crate) probability: f64,
    pub(crate) distance_m: f64,
}

/// A session at one instant. Its size is fixed, so taking one allocates nothing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View {
    pub(crate) t_s: f64,
    pub(crate) q: [f64; 7],
    /// Number in `hwall.State.State`.
    pub(crate) state: u8,
    pub(crate) tracked: bool,
    pub(crate) force_n: Option<DVec3>,
    pub(crate) normal_force_n: Option<f64>,
    pub(crate) contact: Option<SeenContact>,
    /// Point and normal that the board is sent to.
    pub(crate) goal: Option<(DVec3, DVec3)>,
    /// Time until the board is there, s.
    pub(crate) left_s: Option<f64>,
    /// Openings in the order of the scene's moving surfaces, rad or m.
    pub(crate) openings: [f64; MOST_MOVING],
    pub(crate) moving: usize,
}

impl View {
    pub(crate) fn of<P: Predictor>(session: &Session<P>, t_s: f64, state: &ArmState) -> Self {
        let control = session.control();
        let step = control.last_step();
        let mut openings = [0.0; MOST_MOVING];
        let mut moving = 0;
        for (place, surface) in openings.iter_mut().zip(control.moving()) {
            *place = surface.position;
            moving += 1;
        }
        Self {
            t_s,
            q: state.q.0,
            state: code(session.state()),
            tracked: session.tracking().is_some_and(|t| t.state().is_some()),
            force_n: step.and_then(|s| s.wrench).map(|w| w.force_n),
            normal_force_n: step.and_then(|s| s.normal_force_n),
            contact: session.contact().map(|contact| SeenContact {
                point_m: contact.point_m,
                normal: contact.normal,
                covariance_m2: contact.covariance_m2,
                in_s: contact.time_to_contact_s.map(|time| time.mean_s),
                probability: contact.probability,
                distance_m: contact.distance_m,
            }),
            goal: control
                .target()
                .map(|target| (target.point_m, target.normal)),
            left_s: step.and_then(|s| s.left_s),
            openings,
            moving,
        }
    }
}

/// Codes of the states, as in `hwall.State.State`.
const fn code(state: SessionState) -> u8 {
    match state {
        SessionState::Holding(_) => 0,
        SessionState::Waiting => 1,
        SessionState::GettingReady => 2,
        SessionState::Approaching => 3,
        SessionState::Late => 4,
        SessionState::Obstructed => 5,
        SessionState::InPlace => 6,
        SessionState::Touched => 7,
        SessionState::TouchedInMovingWorld => 8,
        SessionState::Safe(_) => 9,
        _ => 10,
    }
}

//! Why the policy decided as it did in a frame.

use glam::DVec3;
use hwall_scene::SurfaceId;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// A place that may be touched next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeighedPlace {
    /// Surface of the place.
    pub surface: SurfaceId,
    /// The predicted point, frame of the scene, m.
    pub point_m: DVec3,
    /// Probability that the next touch is there and comes soon.
    pub probability: f64,
    /// Median of the time until that touch, counted from when the place was known, s.
    pub touch_s: f64,
    /// How long that touch has been awaited, s.
    pub awaited_s: f64,
    /// Can the arm hold the board there?
    pub is_held: bool,
}

/// Something that the arm may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeighedChoice {
    /// `wait`, `pre-position` or `present`.
    pub kind: &'static str,
    /// The place that the board is sent to; `None` for waiting.
    pub place: Option<(SurfaceId, DVec3)>,
    /// Time until the arm has arrived, s.
    pub arrival_s: f64,
    /// Expected loss, touches.
    pub loss: f64,
}

/// What was weighed in a frame, and the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Time of the frame, s.
    pub t_s: f64,
    /// The places that may be touched next.
    pub places: Vec<WeighedPlace>,
    /// Probability that the next touch is elsewhere, or does not come soon.
    pub elsewhere: f64,
    /// What the arm does already.
    pub last: WeighedChoice,
    /// What it may do instead.
    pub others: Vec<WeighedChoice>,
    /// A change must save at least this loss, touches.
    pub least_gain: f64,
    /// Index in `others` of the choice taken; `None`: the arm continues with the last one.
    pub taken: Option<usize>,
}

/// Explanations on their way from the policy to a reader, also on another thread. Clones share them.
///
/// The policy writes them, which allocates, only while they are asked for.
#[derive(Debug, Clone, Default)]
pub struct Explanations(Arc<Explained>);

#[derive(Debug, Default)]
struct Explained {
    asked: AtomicBool,
    newest: Mutex<Option<Explanation>>,
}

impl Explanations {
    /// Are the following frames to be explained? If not, what was not taken is dropped.
    pub fn ask(&self, asked: bool) {
        if self.0.asked.swap(asked, Ordering::Relaxed) && !asked {
            let _ = self.take();
        }
    }

    /// Why the policy decided as it did in the newest frame with a prediction; `None` if it was taken before.
    #[must_use]
    pub fn take(&self) -> Option<Explanation> {
        (self.0.newest.lock())
            .unwrap_or_else(PoisonError::into_inner)
            .take()
    }

    pub(super) fn are_asked(&self) -> bool {
        self.0.asked.load(Ordering::Relaxed)
    }

    /// Drops it if a reader is taking the last one: the policy never waits.
    pub(super) fn put(&self, explanation: Explanation) {
        if let Ok(mut newest) = self.0.newest.try_lock() {
            *newest = Some(explanation);
        }
    }
}

impl Explanation {
    /// The choice taken.
    #[must_use]
    pub fn choice(&self) -> &WeighedChoice {
        let taken = self.taken.and_then(|taken| self.others.get(taken));
        taken.unwrap_or(&self.last)
    }
}

impl fmt::Display for WeighedChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind)?;
        if let Some((surface, p)) = self.place {
            write!(
                f,
                " surface {} at {:.2}, {:.2}, {:.2} m",
                surface.0, p.x, p.y, p.z
            )?;
        }
        write!(
            f,
            ": there in {:.2} s, loss {:.3}",
            self.arrival_s, self.loss
        )
    }
}

/// Several lines: the choice, the places and the alternatives.
impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:9.3} s  {}", self.t_s, self.choice())?;
        for place in &self.places {
            let (surface, p) = (place.surface.0, place.point_m);
            let held = if place.is_held { "" } else { ", out of reach" };
            writeln!(
                f,
                "             {:5.1} %  surface {surface} at {:.2}, {:.2}, {:.2} m, touched {:.2} s after it is known ({:.2} s ago){held}",
                100.0 * place.probability,
                p.x,
                p.y,
                p.z,
                place.touch_s,
                place.awaited_s
            )?;
        }
        writeln!(
            f,
            "             {:5.1} %  elsewhere, or not soon",
            100.0 * self.elsewhere
        )?;
        writeln!(f, "             last choice: {}", self.last)?;
        for other in &self.others {
            writeln!(f, "             else: {other}")?;
        }
        write!(f, "             a change must save {:.3}", self.least_gain)
    }
}

//! Parameters of an object, and their valid ranges.

use crate::HapticsError;
use hwall_numeric::check::{finite, non_negative, positive, that};

/// How something with one degree of freedom moves.
///
/// The position is an angle (rad) or a distance (m), a force is a moment (N m) or a force (N), the inertia is in kg m² or kg. The motion obeys
/// `inertia · a = force − stiffness · (x − rest) − damping · v − friction · sign(v) + detents + click`, within `range`.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectConfig {
    /// Inertia, kg m² or kg; positive. Default 1.
    pub inertia: f64,
    /// Spring towards `rest`, N m/rad or N/m. Default 0.
    pub stiffness: f64,
    /// Where the spring is relaxed, rad or m; may lie outside the range. Default 0.
    pub rest: f64,
    /// Viscous damping, N m s/rad or N s/m. Default 0.
    pub damping: f64,
    /// Coulomb friction, N m or N; an object at rest stays until the other forces exceed it. Default 0.
    pub friction: f64,
    /// Hard stops, rad or m; an infinity is no stop. Default none.
    pub range: [f64; 2],
    /// Share of the speed that a stop returns, 0 to 1. Default 0: the object stands at the stop.
    pub restitution: f64,
    /// Places where the object latches. Default none.
    pub detents: Vec<Detent>,
    /// The click of a button. Default none.
    pub click: Option<Click>,
}

/// A latch: a potential well around a position.
///
/// Within `half_width` of `position` the object is pulled back by `force · distance / half_width`, beyond it not at all. The pull is thus largest at
/// the edge, where it lets go; escaping takes an energy of `force · half_width / 2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detent {
    /// Centre of the well, rad or m.
    pub position: f64,
    /// From the centre to the edge, rad or m; positive.
    pub half_width: f64,
    /// Pull at the edge, N m or N.
    pub force: f64,
}

/// The click of a button that is pressed towards positive positions.
///
/// From `start` on a resistance grows linearly up to `force` at `snap`; there it vanishes until the object returns to `release`. The energy stored at
/// `snap` and not returned from `release` on is lost in each click: `force · ((snap − start)² − (release − start)²) / (2 (snap − start))`. With
/// `release` at `snap` no energy is lost; with `release` at `start` all of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Click {
    /// Where the resistance begins, rad or m.
    pub start: f64,
    /// Where it is largest and gives way, rad or m; above `start`.
    pub snap: f64,
    /// Where it is armed again on the way back, rad or m; from `start` to `snap`.
    pub release: f64,
    /// Resistance at `snap`, N or N m.
    pub force: f64,
}

impl Default for ObjectConfig {
    fn default() -> Self {
        Self {
            inertia: 1.0,
            stiffness: 0.0,
            rest: 0.0,
            damping: 0.0,
            friction: 0.0,
            range: [f64::NEG_INFINITY, f64::INFINITY],
            restitution: 0.0,
            detents: Vec::new(),
            click: None,
        }
    }
}

impl ObjectConfig {
    /// A free mass (kg) or a free flywheel (kg m²).
    #[must_use]
    pub fn new(inertia: f64) -> Self {
        Self {
            inertia,
            ..Self::default()
        }
    }

    /// Rejects invalid parameters, naming them.
    ///
    /// # Errors
    /// The first parameter that is NaN, infinite (except in the range) or outside its range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        positive("inertia", self.inertia)?;
        non_negative("stiffness", self.stiffness)?;
        finite("rest", self.rest)?;
        non_negative("damping", self.damping)?;
        non_negative("friction", self.friction)?;
        let [low, high] = self.range;
        that(low < f64::INFINITY, "range[0]", low, "a number or -inf")?;
        let valid = high > f64::NEG_INFINITY;
        that(valid, "range[1]", high, "a number or inf")?;
        that(low <= high, "range[1]", high, "at least range[0]")?;
        let e = self.restitution;
        that((0.0..=1.0).contains(&e), "restitution", e, "from 0 to 1")?;
        let mut stiffness = self.stiffness;
        for detent in &self.detents {
            detent.validate()?;
            stiffness += detent.stiffness();
        }
        if let Some(click) = &self.click {
            click.validate()?;
            stiffness += click.stiffness();
        }
        // The closed form squares and divides these; the results must be finite.
        let decay = self.damping / self.inertia;
        let valid = decay * decay < f64::INFINITY;
        that(valid, "damping", self.damping, "less, for this inertia")?;
        let valid = stiffness / self.inertia < f64::INFINITY;
        that(valid, "stiffness", stiffness, "less, for this inertia")?;
        Ok(())
    }
}

impl Detent {
    fn validate(&self) -> Result<(), HapticsError> {
        finite("detent position", self.position)?;
        positive("detent half_width", self.half_width)?;
        non_negative("detent force", self.force)?;
        Ok(())
    }

    /// Stiffness of the spring inside the well.
    pub(super) fn stiffness(&self) -> f64 {
        self.force / self.half_width
    }

    /// The ends of the well.
    pub(super) fn edges(&self) -> [f64; 2] {
        [
            self.position - self.half_width,
            self.position + self.half_width,
        ]
    }

    /// Potential, J; zero at the centre.
    pub(super) fn energy_j(&self, position: f64) -> f64 {
        let offset = (position - self.position).abs().min(self.half_width);
        0.5 * self.stiffness() * offset * offset
    }
}

impl Click {
    fn validate(&self) -> Result<(), HapticsError> {
        finite("click start", self.start)?;
        finite("click snap", self.snap)?;
        let valid = self.snap > self.start;
        that(valid, "click snap", self.snap, "above its start")?;
        let release = self.release;
        let between = (self.start..=self.snap).contains(&release);
        that(
            between,
            "click release",
            release,
            "from its start to its snap",
        )?;
        non_negative("click force", self.force)?;
        Ok(())
    }

    /// Stiffness of the resistance.
    pub(super) fn stiffness(&self) -> f64 {
        self.force / (self.snap - self.start)
    }

    /// Potential, J.
    pub(super) fn energy_j(&self, position: f64, armed: bool) -> f64 {
        let at = if armed { position } else { self.release };
        let pressed = (at - self.start).max(0.0);
        0.5 * self.stiffness() * pressed * pressed
    }
}

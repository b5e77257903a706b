//! The motion of an object: exact from one event to the next.

use super::config::ObjectConfig;
use super::force::{Piece, PieceTable};
use super::oscillator::Oscillator;
use crate::HapticsError;
use hwall_numeric::check::{finite, non_negative, positive, that};

/// An object with one degree of freedom that can be pushed.
///
/// Between two events (a reversal, a stop, an edge of a latch or a click) the motion is that of a damped oscillator in closed form. So a step may
/// have any length: one of 10 s ends where ten thousand of 1 ms do, to rounding. No step generates energy: `energy_j` grows by at most force times
/// distance.
///
/// A rebound that would rise by less than 1e-12 (m or rad) ends at the stop. An object with more than 100,000 events within one step (a stop that
/// returns all speed, hit every nanosecond) is brought to rest there.
#[derive(Debug, Clone)]
pub struct MovingObject {
    config: ObjectConfig,
    /// The configured inertia, or a larger one.
    inertia: f64,
    /// The configured damping, or a larger one.
    damping: f64,
    table: PieceTable,
    state: State,
}

#[derive(Debug, Clone, Copy)]
struct State {
    position: f64,
    velocity: f64,
    /// Is the click still ahead? Always true without a click.
    armed: bool,
}

/// The motion that is about to begin: direction and piece.
struct Way<'a> {
    up: bool,
    piece: &'a Piece,
    armed: bool,
}

/// A lower rebound is dropped, m or rad.
const LEAST_REBOUND: f64 = 1e-12;
/// Most events within a step; no realistic object comes near it.
const MOST_EVENTS: usize = 100_000;

impl MovingObject {
    /// An object at rest at position zero, or at the nearest stop.
    ///
    /// # Errors
    /// A configuration that is not [valid](ObjectConfig::validate).
    pub fn new(config: ObjectConfig) -> Result<Self, HapticsError> {
        config.validate()?;
        let [low, high] = config.range;
        let table = PieceTable::of(&config);
        let position = 0.0_f64.max(low).min(high);
        let armed = table.armed_at(position);
        let state = State {
            position,
            velocity: 0.0,
            armed,
        };
        Ok(Self {
            inertia: config.inertia,
            damping: config.damping,
            config,
            table,
            state,
        })
    }

    /// The configured motion; for the current inertia see [`inertia`](Self::inertia).
    #[must_use]
    pub fn config(&self) -> &ObjectConfig {
        &self.config
    }

    /// Current inertia, kg m² or kg: the configured one, unless it was [raised](Self::raise_inertia).
    #[must_use]
    pub fn inertia(&self) -> f64 {
        self.inertia
    }

    /// Makes the object heavier than configured, up to `inertia` (kg m² or kg); a value below the current inertia has no effect. The velocity stays,
    /// and so does the damping ratio with its spring, up to critical damping: otherwise it would swing for longer. Does not allocate.
    ///
    /// # Errors
    /// NaN, an infinity or a value that is not positive; the object stays as it was.
    pub fn raise_inertia(&mut self, inertia: f64) -> Result<(), HapticsError> {
        positive("inertia", inertia)?;
        if inertia > self.inertia {
            let ObjectConfig {
                damping, stiffness, ..
            } = self.config;
            let critical = |inertia: f64| 2.0 * (stiffness * inertia).sqrt();
            let kept = (inertia / self.config.inertia).sqrt() * damping;
            self.damping = damping.max(kept.min(critical(inertia)));
            self.table.set_inertia(inertia, self.damping);
            self.inertia = inertia;
        }
        Ok(())
    }

    /// Gives the object its configured inertia and damping back. The velocity stays, so its energy does not grow. Does not allocate.
    pub fn restore_inertia(&mut self) {
        if self.inertia > self.config.inertia {
            (self.inertia, self.damping) = (self.config.inertia, self.config.damping);
            self.table.set_inertia(self.inertia, self.damping);
        }
    }

    /// Position and velocity after `dt_s` (not negative) under a constant force, N m or N; the object itself does not move.
    ///
    /// # Errors
    /// NaN or an infinity; a motion beyond what f64 can hold.
    pub fn after(&self, force: f64, dt_s: f64) -> Result<(f64, f64), HapticsError> {
        let state = self.state_after(force, dt_s)?;
        Ok((state.position, state.velocity))
    }

    /// Position, rad or m.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.state.position
    }

    /// Velocity, rad/s or m/s.
    #[must_use]
    pub fn velocity(&self) -> f64 {
        self.state.velocity
    }

    /// Kinetic energy plus the potentials of spring, latches and click, J; never negative, zero at rest at the centre of all of them.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        let config = &self.config;
        let State {
            position,
            velocity,
            armed,
        } = self.state;
        let stretch = position - config.rest;
        let detents: f64 = config.detents.iter().map(|d| d.energy_j(position)).sum();
        let click = config.click.map_or(0.0, |c| c.energy_j(position, armed));
        0.5 * (self.inertia * velocity * velocity + config.stiffness * stretch * stretch)
            + detents
            + click
    }

    /// Is the click of a button past its snap (and not yet released)? `false` without a click.
    #[must_use]
    pub fn clicked(&self) -> bool {
        !self.state.armed
    }

    /// Acceleration under a force (N m or N) at this instant, rad/s² or m/s²; zero where friction or a stop holds it.
    #[must_use]
    pub fn acceleration(&self, force: f64) -> f64 {
        self.acceleration_at(&self.state, force)
    }

    /// Acceleration under a force after another one has acted for `dt_s` (not negative); the object itself does not move.
    ///
    /// # Errors
    /// As for [`after`](Self::after).
    pub fn acceleration_after(
        &self,
        force: f64,
        dt_s: f64,
        force_then: f64,
    ) -> Result<f64, HapticsError> {
        finite("force_then", force_then)?;
        let state = self.state_after(force, dt_s)?;
        Ok(self.acceleration_at(&state, force_then))
    }

    fn acceleration_at(&self, state: &State, force: f64) -> f64 {
        let Some(way) = self.way(state, force) else {
            return 0.0;
        };
        let pull = self.pull(&way, state.position, force);
        (pull - self.damping * state.velocity) / self.inertia
    }

    /// Places the object at a position, with a velocity. A click is armed below its snap.
    ///
    /// # Errors
    /// NaN, an infinity, a position outside the range; the object stays as it was.
    pub fn set_state(&mut self, position: f64, velocity: f64) -> Result<(), HapticsError> {
        finite("position", position)?;
        finite("velocity", velocity)?;
        let [low, high] = self.config.range;
        let inside = (low..=high).contains(&position);
        that(inside, "position", position, "between the stops")?;
        self.state = State {
            position,
            velocity,
            armed: self.table.armed_at(position),
        };
        Ok(())
    }

    /// Holds the object back at a position on its path, with a velocity; a released click stays released until its release point.
    pub(crate) fn hold_back(&mut self, position: f64, velocity: f64) -> Result<(), HapticsError> {
        let armed = self.state.armed;
        self.set_state(position, velocity)?;
        let released = self
            .config
            .click
            .is_some_and(|click| position > click.release);
        self.state.armed &= armed || !released;
        Ok(())
    }

    /// Advances the object by `dt_s` (not negative) under a constant force, N m or N. Does not allocate.
    ///
    /// # Errors
    /// NaN or an infinity; a motion beyond what f64 can hold. The object stays as it was.
    pub fn step(&mut self, force: f64, dt_s: f64) -> Result<(), HapticsError> {
        self.state = self.state_after(force, dt_s)?;
        Ok(())
    }

    fn state_after(&self, force: f64, dt_s: f64) -> Result<State, HapticsError> {
        finite("force", force)?;
        non_negative("dt_s", dt_s)?;
        let state = self.moved(self.state, force, dt_s);
        finite("position", state.position)?;
        finite("velocity", state.velocity)?;
        Ok(state)
    }

    fn moved(&self, mut state: State, force: f64, dt_s: f64) -> State {
        let mut left_s = dt_s;
        for _ in 0..MOST_EVENTS {
            if !(left_s > 0.0 && state.velocity.is_finite()) {
                return state;
            }
            match self.way(&state, force) {
                Some(way) => left_s = self.follow(&way, &mut state, force, left_s),
                // At a stop, or held by friction.
                None if state.velocity != 0.0 => self.rebound(&mut state, force),
                None => return state,
            }
        }
        state.velocity = 0.0;
        state
    }

    /// Direction and piece of the next motion; `None` if the object stays at rest or pushes against a stop.
    fn way(&self, state: &State, force: f64) -> Option<Way<'_>> {
        let at = state.position;
        let towards = |up: bool| {
            let (piece, armed) = self.table.towards(up, at, state.armed)?;
            Some(Way { up, piece, armed })
        };
        if state.velocity != 0.0 {
            return towards(state.velocity > 0.0);
        }
        let up = towards(true).map(|way| (self.pull(&way, at, force), way));
        let down = towards(false).map(|way| (-self.pull(&way, at, force), way));
        let [up, down] = [up, down].map(|way| way.filter(|(pull, _)| *pull > 0.0));
        match (up, down) {
            // At the crest between two wells: to the steeper side.
            (Some(up), Some(down)) => Some(if up.0 > down.0 { up.1 } else { down.1 }),
            (up, down) => up.or(down).map(|(_, way)| way),
        }
    }

    /// All forces except damping on an object that moves that way.
    fn pull(&self, way: &Way, position: f64, force: f64) -> f64 {
        let friction = if way.up {
            self.config.friction
        } else {
            -self.config.friction
        };
        force + way.piece.force(position) - friction
    }

    /// Advances until an event or the end of the time; returns the remaining time.
    fn follow(&self, way: &Way, state: &mut State, force: f64, left_s: f64) -> f64 {
        let Piece {
            low,
            high,
            oscillator,
            ..
        } = way.piece;
        state.armed = way.armed;
        let from = state.position;
        let g = self.pull(way, from, force) / self.inertia;
        if self.config.friction == 0.0
            && oscillator.stays_within(state.velocity, g, low - from, high - from)
        {
            let (by, velocity) = oscillator.after(state.velocity, g, left_s);
            state.position = (from + by).clamp(*low, *high);
            state.velocity = velocity;
            return 0.0;
        }
        // From here on, everything is relative to the direction of motion.
        let (sign, edge) = if way.up { (1.0, *high) } else { (-1.0, *low) };
        let (speed, g) = (state.velocity.abs(), sign * g);
        if speed == 0.0 && g <= 0.0 {
            // The pull underflows.
            return 0.0;
        }
        let ahead = sign * (edge - from);
        let reversal_s = oscillator.reversal_s(speed, g);
        let until_s = reversal_s.min(left_s);
        let (by, after) = oscillator.after(speed, g, until_s);
        if by < ahead {
            state.position = (from + sign * by.max(0.0)).clamp(*low, *high);
            state.velocity = if reversal_s <= left_s {
                0.0
            } else {
                sign * after.max(0.0)
            };
            return left_s - until_s;
        }
        let (crossing_s, after) = crossing(oscillator, speed, g, ahead, until_s);
        state.position = edge;
        state.velocity = sign * after.max(0.0);
        if self.config.range.contains(&edge) {
            self.rebound(state, force);
        }
        left_s - crossing_s
    }

    /// Reverses an object that pushes against a stop.
    fn rebound(&self, state: &mut State, force: f64) {
        let velocity = -self.config.restitution * state.velocity;
        state.velocity = 0.0;
        if velocity == 0.0 {
            return;
        }
        let up = velocity > 0.0;
        let Some((piece, armed)) = self.table.towards(up, state.position, state.armed) else {
            return;
        };
        let way = Way { up, piece, armed };
        let away = self.pull(&way, state.position, force);
        let back = if up { -away } else { away };
        // Otherwise ever smaller rebounds would continue without end.
        let small = back > 0.0 && 0.5 * self.inertia * velocity * velocity < LEAST_REBOUND * back;
        if !small {
            state.velocity = velocity;
        }
    }
}

/// When a motion without reversal before `until_s` has come as far as `ahead`, and its speed there.
fn crossing(oscillator: &Oscillator, speed: f64, g: f64, ahead: f64, until_s: f64) -> (f64, f64) {
    let (mut low_s, mut high_s) = (0.0, until_s);
    // Assumes the initial acceleration; exact without spring and damping.
    let acceleration = oscillator.first_acceleration(speed, g);
    let square = speed * speed + 2.0 * acceleration * ahead;
    let guess_s = 2.0 * ahead / (speed + square.max(0.0).sqrt());
    let mut t_s = if guess_s < until_s { guess_s } else { until_s };
    let mut last_step_s = until_s;
    for _ in 0..200 {
        let (by, rate) = oscillator.after(speed, g, t_s);
        let missing = ahead - by;
        if missing > 0.0 {
            low_s = t_s;
        } else {
            high_s = t_s;
        }
        let step_s = missing / rate;
        let newton_s = t_s + step_s;
        // Newton's step, unless it leaves the bracket or gains less than a factor of two.
        let gains = step_s.abs() < 0.5 * last_step_s.abs();
        let next_s = if newton_s > low_s && newton_s < high_s && gains {
            newton_s
        } else if step_s.abs() <= f64::EPSILON * t_s {
            return (t_s, rate);
        } else {
            0.5 * (low_s + high_s)
        };
        last_step_s = next_s - t_s;
        if last_step_s.abs() <= f64::EPSILON * t_s {
            return (t_s, rate);
        }
        t_s = next_s;
    }
    (t_s, oscillator.after(speed, g, t_s).1)
}

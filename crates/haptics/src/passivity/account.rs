//! Energy balance with bounds: what sampling, delay and sensors may hide, and what pending commands may still cost.

use super::observer::EnergyObserver;
use super::port_config::{Causality, PortConfig};
use crate::error::HapticsError;
use hwall_numeric::check::that;

/// Longest delay, in periods.
const MOST_PERIODS: usize = 60;
/// Number of commands stored: pending ones and those that acted while velocities were measured; a power of two.
const COMMANDS: usize = 128;
/// Number of positions stored.
const POSITIONS: usize = 32;
/// Spans over which velocities are measured, periods.
const SPANS: [usize; 5] = [1, 2, 4, 8, 16];

/// The energy balance at a port, in two versions: observed and guaranteed.
///
/// A command decided at sample `k` acts from `t_k + t_d` for one period. So two commands act in turn between two samples; the motion (or force) at
/// the change is interpolated. The guaranteed energy is below the observed one: each change of the held variable subtracts that change times the
/// error of the other variable there (summation by parts: constant errors cost nothing while nothing changes). For admittance it also subtracts the
/// path times the error of the force.
#[derive(Debug, Clone)]
pub(super) struct PortAccount {
    config: PortConfig,
    /// Delay in whole periods, and the remaining share of a period.
    whole: usize,
    share: f64,
    /// Newest at `step % COMMANDS`.
    commands: [f64; COMMANDS],
    positions: [f64; POSITIONS],
    /// Forces of the hand, newest first.
    forces: [f64; 3],
    /// Samples taken.
    step: usize,
    seen: EnergyObserver,
    sure_j: f64,
    /// Way against the hand that was commanded and not made yet, m.
    outstanding_m: f64,
}

/// Worst-case cost of a further command of size x: `a x² + b x`, in addition to what is reserved already.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cost {
    pub(super) a: f64,
    pub(super) b: f64,
    pub(super) reserved_j: f64,
}

impl PortAccount {
    pub(super) fn new(config: PortConfig) -> Result<Self, HapticsError> {
        let periods = config.sampling.delay_s / config.sampling.period_s;
        let valid = periods <= MOST_PERIODS as f64;
        that(valid, "delay_s over period_s", periods, "at most 60")?;
        // Rounding must not turn a delay of whole periods into one period less.
        let whole = (periods + 1e-9).floor();
        Ok(Self {
            config,
            whole: whole as usize,
            share: (periods - whole).max(0.0),
            commands: [0.0; COMMANDS],
            positions: [0.0; POSITIONS],
            forces: [0.0; 3],
            step: 0,
            seen: EnergyObserver::new(),
            sure_j: 0.0,
            outstanding_m: 0.0,
        })
    }

    pub(super) const fn set_hand_stiffness(&mut self, n_per_m: f64) {
        self.config.hand.stiffness_n_per_m = n_per_m;
    }

    pub(super) const fn set_outstanding(&mut self, way_m: f64) {
        self.outstanding_m = way_m;
    }

    pub(super) const fn set_braking(&mut self, m_per_s2: f64) {
        self.config.braking_m_per_s2 = m_per_s2;
    }

    /// Observed energy, J.
    pub(super) const fn seen_j(&self) -> f64 {
        self.seen.net_j()
    }

    /// The observer with all bookings.
    pub(super) const fn observer(&self) -> &EnergyObserver {
        &self.seen
    }

    /// Guaranteed energy, J.
    pub(super) const fn sure_j(&self) -> f64 {
        self.sure_j
    }

    /// Velocity over the last period, m/s.
    pub(super) fn velocity_m_per_s(&self) -> f64 {
        (self.position(0) - self.position(1)) / self.config.sampling.period_s
    }

    /// The command decided `ago` samples before the coming one, which has number 0.
    fn command(&self, ago: usize) -> f64 {
        if ago > self.step || ago >= COMMANDS {
            return 0.0;
        }
        self.commands[(self.step - ago) % COMMANDS]
    }

    /// The position `ago` samples before the newest; the first one if there is no earlier one.
    fn position(&self, ago: usize) -> f64 {
        let newest = self.step.saturating_sub(1);
        self.positions[newest.saturating_sub(ago) % POSITIONS]
    }

    /// Takes the sample at which the next command is decided, books the period before it, and returns the newly guaranteed energy, J. Inputs are
    /// finite.
    pub(super) fn sample(&mut self, position_m: f64, force_n: f64) -> Result<f64, HapticsError> {
        self.positions[self.step % POSITIONS] = position_m;
        let first = self.step == 0;
        self.step += 1;
        self.commands[self.step % COMMANDS] = 0.0;
        let [f1, f2, _] = self.forces;
        self.forces = if first {
            [force_n; 3]
        } else {
            [force_n, f1, f2]
        };
        if first {
            return Ok(0.0);
        }
        let (old, new) = (self.command(self.whole + 2), self.command(self.whole + 1));
        let moved_m = self.position(0) - self.position(1);
        let (seen_j, hidden_j) = match self.config.causality {
            Causality::Impedance => self.of_held_force(old, new, moved_m),
            Causality::Admittance => self.of_held_velocity(old, new, moved_m),
        };
        self.seen.book_energy(seen_j)?;
        self.sure_j += seen_j - hidden_j;
        Ok(seen_j - hidden_j)
    }

    /// Force on the device by the actuator: `old`, then `new`.
    fn of_held_force(&self, old: f64, new: f64, moved_m: f64) -> (f64, f64) {
        let work_j = (old * self.share + new * (1.0 - self.share)) * moved_m;
        let error_m = self.config.position_error_m;
        // ∫ v² dt >= displacement² / T.
        let sure_m = (moved_m.abs() - 2.0 * error_m).max(0.0);
        let friction = self.config.damping_n_s_per_m / self.config.sampling.period_s;
        let seen_j = friction * moved_m * moved_m - work_j;
        let hidden_j = (new - old).abs() * self.position_doubt_m()
            + friction * (moved_m * moved_m - sure_m * sure_m);
        (seen_j, hidden_j)
    }

    /// Position error at a change of force, m: the sensor's error plus, where the position is interpolated, that of a straight line,
    /// `a t (T - t) / 2`. The acceleration is twice the measured second difference plus, because that is a mean, the spread of the forces then.
    fn position_doubt_m(&self) -> f64 {
        let bend = |ago: usize| {
            (self.position(ago) - 2.0 * self.position(ago + 1) + self.position(ago + 2)).abs()
        };
        let (mut high, mut low) = (f64::NEG_INFINITY, f64::INFINITY);
        for ago in self.whole..self.whole + 6 {
            let force_n = self.command(ago.max(1));
            (high, low) = (high.max(force_n), low.min(force_n));
        }
        let period_s = self.config.sampling.period_s;
        let spread_m = (high - low) / self.config.mass_kg * period_s * period_s;
        let bend_m = bend(0).max(bend(1)) + spread_m;
        self.config.position_error_m + bend_m * self.share * (1.0 - self.share)
    }

    /// Velocity of the device: `old`, then `new`; the force of the hand is interpolated.
    fn of_held_velocity(&self, old: f64, new: f64, moved_m: f64) -> (f64, f64) {
        let period_s = self.config.sampling.period_s;
        let [f0, f1, f2] = self.forces;
        let (mean_n, rise_n) = (0.5 * (f0 + f1), f0 - f1);
        let later = 0.5 * self.share * (1.0 - self.share) * period_s;
        let seen_j = mean_n * moved_m + rise_n * (new - old) * later;
        let path_m = period_s * (old.abs() * self.share + new.abs() * (1.0 - self.share));
        let bend_n = (f0 - 2.0 * f1 + f2).abs();
        // A reversal between the samples meets a force that neither sample shows.
        let hand = self.config.hand;
        let turn_m = (new - old).abs() * self.share * (1.0 - self.share) * period_s;
        let unseen_n = hand.stiffness_n_per_m * turn_m + hand.damping_n_s_per_m * (new - old).abs();
        let hidden_j = path_m * (self.config.force_error_n + 0.5 * bend_n + unseen_n)
            + (0.5 * (f0 - f2)).abs() * self.config.position_error_m;
        (seen_j, hidden_j)
    }

    /// Cost of the pending commands, and of a further one towards `wanted`. Costs reduce the guaranteed energy.
    pub(super) fn cost(&self, wanted: f64) -> Cost {
        match self.config.causality {
            Causality::Impedance => self.cost_of_force(wanted),
            Causality::Admittance => self.cost_of_velocity(wanted),
        }
    }

    /// The windows in which pending commands act, from now on: force or velocity, and duration in s.
    fn windows(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let period_s = self.config.sampling.period_s;
        let first = (self.command(self.whole + 1), self.share * period_s);
        let rest = (1..=self.whole)
            .rev()
            .map(move |ago| (self.command(ago), period_s));
        std::iter::once(first).chain(rest)
    }

    fn cost_of_force(&self, sign: f64) -> Cost {
        let PortConfig { mass_kg, hand, .. } = self.config;
        let period_s = self.config.sampling.period_s;
        let doubt_m = self.position_doubt_m();
        let [mut ahead, mut back] = self.fastest_m_per_s();
        let mut reserved_j = 0.0;
        let mut last = self.command(self.whole + 2);
        for (force_n, time_s) in self.windows() {
            let (a_ahead, a_back) = (
                (force_n + hand.push_n) / mass_kg,
                (hand.pull_n - force_n) / mass_kg,
            );
            let moved_m = |v: f64, a: f64| (v + 0.5 * a * time_s) * time_s;
            reserved_j += force_n.abs()
                * if force_n > 0.0 {
                    moved_m(ahead, a_ahead)
                } else {
                    moved_m(back, a_back)
                };
            reserved_j += (force_n - last).abs() * doubt_m;
            last = force_n;
            ahead += a_ahead * time_s;
            back += a_back * time_s;
        }
        // The change to the further command, and the change back to zero after it.
        reserved_j += last.abs() * doubt_m;
        let (v, hand_n) = if sign > 0.0 {
            (ahead, hand.push_n)
        } else {
            (back, hand.pull_n)
        };
        let half = 0.5 * period_s * period_s / mass_kg;
        Cost {
            a: half,
            b: v * period_s + half * hand_n + 2.0 * doubt_m,
            reserved_j,
        }
    }

    /// Upper bounds of the present velocity along the axis and against it, m/s.
    fn fastest_m_per_s(&self) -> [f64; 2] {
        let PortConfig { mass_kg, hand, .. } = self.config;
        let period_s = self.config.sampling.period_s;
        let mut best = [f64::INFINITY; 2];
        let (mut high, mut low) = (0.0_f64, 0.0_f64);
        let mut covered = 0;
        for span in SPANS {
            if self.step <= span && span > 1 {
                break;
            }
            while covered < span {
                covered += 1;
                for ago in [covered + self.whole, covered + self.whole + 1] {
                    high = high.max(self.command(ago));
                    low = low.min(self.command(ago));
                }
            }
            let time_s = span as f64 * period_s;
            let moved_m = self.position(0) - self.position(span);
            let slack = 2.0 * self.config.position_error_m / time_s
                + self.config.damping_n_s_per_m * moved_m.abs() / mass_kg;
            let mean = moved_m / time_s;
            let ahead = mean + slack + 0.5 * (high + hand.push_n) / mass_kg * time_s;
            let back = -mean + slack + 0.5 * (hand.pull_n - low) / mass_kg * time_s;
            best = [best[0].min(ahead), best[1].min(back)];
        }
        best
    }

    fn cost_of_velocity(&self, wanted: f64) -> Cost {
        let hand = self.config.hand;
        let period_s = self.config.sampling.period_s;
        let now_n = self.forces[0].max(0.0) + self.config.force_error_n;
        // The force may rise as hand and device approach each other.
        let force_n = |speed: f64, time_s: f64| {
            let closing = hand.speed_m_per_s + speed;
            (now_n + closing * (hand.stiffness_n_per_m * time_s + hand.damping_n_s_per_m))
                .min(hand.push_n.max(now_n))
        };
        let (mut time_s, mut reserved_j) = (0.0, 0.0);
        for (velocity, window_s) in self.windows() {
            time_s += window_s;
            let speed = (-velocity).max(0.0);
            reserved_j += force_n(speed, time_s) * speed * window_s;
        }
        let left_m = self.outstanding_m;
        let mean_n = (now_n + 0.5 * hand.stiffness_n_per_m * left_m).min(hand.push_n.max(now_n));
        reserved_j = reserved_j.max(mean_n * left_m);
        time_s += period_s;
        // Moving away from a hand that only pushes costs nothing.
        if wanted > 0.0 {
            return Cost {
                a: 0.0,
                b: 0.0,
                reserved_j,
            };
        }
        // The device brakes at a limited rate: it overruns by v²/2a, against a force that rises meanwhile.
        let speed = wanted.abs();
        let braking_s = speed / self.config.braking_m_per_s2;
        let mean_n = 0.5 * (force_n(speed, time_s) + force_n(speed, time_s + 0.5 * braking_s));
        Cost {
            a: 0.5 * mean_n / self.config.braking_m_per_s2,
            b: period_s * force_n(speed, time_s),
            reserved_j,
        }
    }

    /// Stores the command that was decided at the newest sample.
    pub(super) fn decided(&mut self, command: f64) {
        self.commands[self.step % COMMANDS] = command;
    }
}

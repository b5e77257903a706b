//! Simulation of one contact, in closed form between samples.

use super::contact::{Behind, Contact};
use hwall_haptics::HapticsError;
use hwall_haptics::passivity::{
    Causality, HandBounds, PassivePort, PassivityMethod, PortConfig, PortInput, Sampling,
};
use hwall_testkit::Sampler;

/// Simulated duration of a contact, s.
pub const DURATION_S: f64 = 1.2;
/// Simulated duration of a contact that still oscillates, s.
pub const LONG_S: f64 = 12.0;
/// Oscillations above this are simulated longer, m.
const LOOKED_AT_LONGER_M: f64 = 1e-3;
/// Final part in which oscillations are evaluated, s.
const LAST_S: f64 = 0.4;
/// An oscillation that shrinks below this ratio in that time dies out.
const STILL_THERE: f64 = 0.7;
/// Longest interval between checks of the contact of skin and device, s.
const LONGEST_STEP_S: f64 = 0.5e-3;
/// Largest force of the actuator, N.
const MOST_N: f64 = 140.0;
/// Largest speed of a device that is position-controlled, m/s.
const MOST_M_PER_S: f64 = 1.5;
/// Time constant of the low pass on the device's velocity, s.
const VELOCITY_FILTER_S: f64 = 4e-3;
/// Position of the stop of a pushed object (admittance), m.
const STOP_M: f64 = 0.05;

/// The result of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Largest net energy output at any time, J: output minus input and the dissipation of the device's friction.
    pub generated_j: f64,
    /// Persistent oscillation, peak to peak, m: the least of the last four in the last 0.4 s; 0 if it dies out or there is none.
    pub swing_m: f64,
    /// Sum of the reductions of commands, relative to the sum of the commands.
    pub intrusion: f64,
}

/// Hand and device between two samples: `[x, v, x_hand, v_hand, command, goal of the hand, ∫F, 0]` for impedance; for admittance
/// the device's velocity is the command.
type State = [f64; 7];

/// The two motions, with and without contact of the skin, over a substep and over a part of it.
struct Steps {
    coarse: Motions,
    fine: Motions,
    count: usize,
}

/// Subdivision of a substep in which contact is lost.
const PARTS: usize = 16;

impl Steps {
    fn new(contact: &Contact, time_s: f64) -> Self {
        let count = (time_s / LONGEST_STEP_S).ceil() as usize;
        let time_s = time_s / count.max(1) as f64;
        Self {
            coarse: Motions::new(contact, time_s),
            fine: Motions::new(contact, time_s / PARTS as f64),
            count,
        }
    }
}

struct Motions {
    touching: Square<7>,
    apart: Square<7>,
    time_s: f64,
}

impl Motions {
    fn new(contact: &Contact, time_s: f64) -> Self {
        Self {
            touching: exponential(&motion(contact, true), time_s),
            apart: exponential(&motion(contact, false), time_s),
            time_s,
        }
    }

    /// The state after a substep, and the energy output, J.
    fn after(&self, contact: &Contact, before: &State) -> (State, f64) {
        let mut state = *before;
        state[6] = 0.0;
        let of_skin = match skin_n(contact, &state) > 0.0 {
            true => &self.touching,
            false => &self.apart,
        };
        state = apply(of_skin, &state);
        let moved_m = state[0] - before[0];
        let generated_j = match contact.causality {
            Causality::Impedance => {
                let friction = contact.friction_n_s_per_m * moved_m * moved_m / self.time_s;
                state[4] * moved_m - friction
            }
            // The skin does not pull, although its spring and damper would at the end of the substep.
            Causality::Admittance => -state[4] * state[6].max(0.0),
        };
        (state, generated_j)
    }
}

/// The derivative of the state.
fn motion(contact: &Contact, touching: bool) -> Square<7> {
    let (m, b, hand) = (contact.mass_kg, contact.friction_n_s_per_m, contact.hand);
    let (k, c) = match touching {
        true => (hand.skin_n_per_m, hand.skin_n_s_per_m),
        false => (0.0, 0.0),
    };
    let mut a = [[0.0; 7]; 7];
    // The force of the skin on the device.
    let skin;
    match contact.causality {
        Causality::Impedance => {
            skin = [-k, -c, k, c, 0.0, 0.0, 0.0];
            a[0][1] = 1.0;
            a[1] = skin.map(|x| x / m);
            a[1][1] -= b / m;
            a[1][4] += 1.0 / m;
        }
        Causality::Admittance => {
            skin = [-k, 0.0, k, c, -c, 0.0, 0.0];
            a[0][4] = 1.0;
        }
    }
    a[2][3] = 1.0;
    a[3] = skin.map(|x| -x / hand.mass_kg);
    a[3][2] -= hand.arm_n_per_m / hand.mass_kg;
    a[3][3] -= hand.arm_n_s_per_m / hand.mass_kg;
    a[3][5] += hand.arm_n_per_m / hand.mass_kg;
    a[6] = skin;
    a
}

/// The settings of the port for a contact, from what a user would know of the device.
pub fn port_config(contact: &Contact, method: PassivityMethod) -> PortConfig {
    let position_error_m = contact.position_error_m();
    let base = match contact.causality {
        Causality::Impedance => PortConfig {
            damping_n_s_per_m: contact.friction_n_s_per_m,
            still_band: contact.stiffness_n_per_m * position_error_m,
            ..PortConfig::impedance(contact.sampling, contact.mass_kg)
        },
        Causality::Admittance => PortConfig {
            damping_n_s_per_m: 0.0,
            still_band: 0.0,
            ..PortConfig::admittance(contact.sampling, MOST_M_PER_S)
        },
    };
    PortConfig {
        method,
        position_error_m,
        force_error_n: contact.force_error_n(),
        hand: HandBounds {
            stiffness_n_per_m: contact.hand.skin_n_per_m,
            damping_n_s_per_m: contact.hand.skin_n_s_per_m,
            ..HandBounds::default()
        },
        ..base
    }
}

/// Simulates a contact. The passivity controller sees only measured values.
///
/// Energy is accounted independently, along the simulated motion. Impedance: actuator force times displacement of the
/// device, exact in every substep because the force is constant; its friction enters by the lower bound
/// `b displacement² / time`, so that too little is subtracted. Admittance: velocity times the integral of the skin's force,
/// which is part of the closed form.
///
/// # Errors
/// None for a drawn contact; the port rejects invalid settings and non-finite numbers.
pub fn run(contact: &Contact, method: PassivityMethod) -> Result<Outcome, HapticsError> {
    let outcome = follow(contact, method, DURATION_S)?;
    if outcome.swing_m > LOOKED_AT_LONGER_M {
        // An oscillation may still use the hand's energy; a limit cycle persists.
        return follow(contact, method, LONG_S);
    }
    Ok(outcome)
}

fn follow(
    contact: &Contact,
    method: PassivityMethod,
    duration_s: f64,
) -> Result<Outcome, HapticsError> {
    let mut port = PassivePort::new(port_config(contact, method))?;
    let period_s = contact.sampling.period_s;
    let (whole, parts_s) = delay_in_periods(&contact.sampling);
    let steps = parts_s.map(|part_s| Steps::new(contact, part_s));
    let mut noise = Sampler::new(contact.seed);
    let mut state: State = [0.0; 7];
    state[3] = contact.hand.speed_m_per_s;
    let mut commands = vec![0.0; whole + 2];
    let mut environment = Environment::default();
    let mut ledger = Ledger {
        last_part_s: duration_s - LAST_S,
        ..Ledger::default()
    };
    let samples = (duration_s / period_s) as usize;
    for k in 0..samples {
        let t_s = k as f64 * period_s;
        state[5] = match contact.hand.release_s {
            Some(release_s) if t_s >= release_s => -0.1,
            _ => contact.hand.depth_m,
        };
        // A sensor value with noise and resolution.
        let mut measured = |value: f64, most: f64, step: f64| {
            ((value + noise.uniform(-most, most)) / step).round() * step
        };
        let force_n = skin_n(contact, &state).max(0.0);
        let position_m = measured(state[0], contact.position_noise_m, contact.position_step_m);
        let hand_force_n = measured(force_n, contact.force_noise_n, contact.force_step_n);
        let wanted = environment.wanted(contact, position_m, hand_force_n);
        let output = port.step(&PortInput {
            position_m,
            hand_force_n,
            wanted,
            stored_j: Some(environment.stored_j(contact, wanted)),
        })?;
        environment.obey(contact, output.command);
        ledger.commands(wanted, output.command);
        // Commands act after the delay: first the one from `whole + 1` samples ago, then the next.
        commands.rotate_right(1);
        commands[0] = output.command;
        for (part, steps) in steps.iter().enumerate() {
            state[4] = commands[whole + 1 - part];
            for _ in 0..steps.count {
                let (after, generated_j) = steps.coarse.after(contact, &state);
                let lets_go = skin_n(contact, &state) > 0.0 && skin_n(contact, &after) <= 0.0;
                if !lets_go {
                    ledger.book(generated_j);
                    state = after;
                    continue;
                }
                for _ in 0..PARTS {
                    let (after, generated_j) = steps.fine.after(contact, &state);
                    ledger.book(generated_j);
                    state = after;
                }
            }
        }
        ledger.look(t_s, state[0]);
    }
    Ok(ledger.outcome())
}

/// Force of the skin on the device, N, including negative (pulling) values.
fn skin_n(contact: &Contact, state: &State) -> f64 {
    if state[2] <= state[0] {
        return 0.0;
    }
    let velocity = match contact.causality {
        Causality::Impedance => state[1],
        Causality::Admittance => state[4],
    };
    contact.hand.skin_n_per_m * (state[2] - state[0])
        + contact.hand.skin_n_s_per_m * (state[3] - velocity)
}

/// A delay in whole periods, and the two parts of a period before and after a command change, s.
pub(super) fn delay_in_periods(sampling: &Sampling) -> (usize, [f64; 2]) {
    let periods = sampling.delay_s / sampling.period_s;
    let whole = (periods + 1e-9).floor();
    let share = (periods - whole).max(0.0);
    let parts_s = [share, 1.0 - share].map(|part| part * sampling.period_s);
    (whole as usize, parts_s)
}

/// The virtual environment.
#[derive(Debug, Default)]
struct Environment {
    last_m: Option<f64>,
    /// Of the device, low-passed.
    device_m_per_s: f64,
    /// The object, m and m/s.
    position_m: f64,
    velocity_m_per_s: f64,
}

impl Environment {
    fn wanted(&mut self, contact: &Contact, position_m: f64, hand_force_n: f64) -> f64 {
        let period_s = contact.sampling.period_s;
        let moved_m = position_m - self.last_m.replace(position_m).unwrap_or(position_m);
        let share = period_s / (period_s + VELOCITY_FILTER_S);
        self.device_m_per_s += share * (moved_m / period_s - self.device_m_per_s);
        let velocity = self.device_m_per_s;
        let (k, b) = (contact.stiffness_n_per_m, contact.damping_n_s_per_m);
        match (contact.causality, contact.behind) {
            (Causality::Impedance, Behind::Wall) if position_m > 0.0 => {
                (-k * position_m - b * velocity).clamp(-MOST_N, 0.0)
            }
            (Causality::Impedance, Behind::Wall) => 0.0,
            (Causality::Impedance, Behind::Mass(mass)) => {
                let off_m = position_m - self.position_m;
                let pull = k * off_m + b * (velocity - self.velocity_m_per_s);
                let force_n = pull.clamp(-MOST_N, MOST_N);
                let friction_n = mass.friction_n_s_per_m * self.velocity_m_per_s;
                self.velocity_m_per_s += (force_n - friction_n) / mass.mass_kg * period_s;
                self.position_m += self.velocity_m_per_s * period_s;
                -force_n
            }
            (Causality::Admittance, behind) => {
                let (mass_kg, friction) = match behind {
                    Behind::Mass(mass) => (mass.mass_kg, mass.friction_n_s_per_m),
                    Behind::Wall => (f64::INFINITY, 0.0),
                };
                // Ignore forces within the noise.
                let felt_n = match hand_force_n > 2.0 * contact.force_error_n() {
                    true => hand_force_n,
                    false => 0.0,
                };
                // A door: a spring of a tenth of the stiffness, and the stop.
                let beyond_m = (self.position_m - STOP_M).max(0.0);
                let spring_n = 0.1 * k * self.position_m + k * beyond_m;
                let force_n = felt_n - spring_n - (friction + b) * self.velocity_m_per_s;
                (self.velocity_m_per_s + force_n / mass_kg * period_s)
                    .clamp(-MOST_M_PER_S, MOST_M_PER_S)
            }
        }
    }

    /// Energy stored in its springs and masses, J.
    fn stored_j(&self, contact: &Contact, wanted: f64) -> f64 {
        let k = contact.stiffness_n_per_m;
        let moving_j = match contact.behind {
            Behind::Mass(mass) => 0.5 * mass.mass_kg * self.velocity_m_per_s.powi(2),
            Behind::Wall => 0.0,
        };
        let spring_j = match contact.causality {
            Causality::Impedance => 0.5 * wanted * wanted / k,
            Causality::Admittance => {
                let beyond_m = (self.position_m - STOP_M).max(0.0);
                0.05 * k * self.position_m.powi(2) + 0.5 * k * beyond_m * beyond_m
            }
        };
        spring_j + moving_j
    }

    /// For admittance, the object follows the permitted command.
    fn obey(&mut self, contact: &Contact, command: f64) {
        if contact.causality == Causality::Admittance {
            self.velocity_m_per_s = command;
            self.position_m += command * contact.sampling.period_s;
        }
    }
}

/// Records of a simulation.
#[derive(Debug, Default)]
struct Ledger {
    last_part_s: f64,
    generated_j: f64,
    most_j: f64,
    wanted: f64,
    taken: f64,
    /// The last turning point, the direction since, and the latest oscillations.
    turn_m: Option<f64>,
    last_m: f64,
    rising: bool,
    swings_m: [f64; 4],
    first_swings_m: [f64; 4],
    turns: usize,
}

impl Ledger {
    fn book(&mut self, generated_j: f64) {
        self.generated_j += generated_j;
        self.most_j = self.most_j.max(self.generated_j);
    }

    fn commands(&mut self, wanted: f64, command: f64) {
        self.wanted += wanted.abs();
        self.taken += (wanted - command).abs();
    }

    fn look(&mut self, t_s: f64, x_m: f64) {
        if t_s < self.last_part_s {
            return;
        }
        let Some(turn_m) = self.turn_m else {
            (self.turn_m, self.last_m) = (Some(x_m), x_m);
            return;
        };
        let rises = x_m > self.last_m;
        if rises != self.rising && x_m != self.last_m {
            self.swings_m.rotate_right(1);
            self.swings_m[0] = (self.last_m - turn_m).abs();
            // The first turn comes from the window, not from the motion.
            if let Some(place) = self.turns.checked_sub(1)
                && let Some(first) = self.first_swings_m.get_mut(place)
            {
                *first = self.swings_m[0];
            }
            (self.turn_m, self.rising) = (Some(self.last_m), rises);
            self.turns += 1;
        }
        self.last_m = x_m;
    }

    fn outcome(&self) -> Outcome {
        let least = |swings: &[f64; 4]| swings.iter().copied().fold(f64::INFINITY, f64::min);
        let goes_on = self.turns > 2 * self.swings_m.len()
            && least(&self.swings_m) > STILL_THERE * least(&self.first_swings_m);
        Outcome {
            generated_j: self.most_j,
            swing_m: if goes_on { least(&self.swings_m) } else { 0.0 },
            intrusion: match self.wanted > 0.0 {
                true => self.taken / self.wanted,
                false => 0.0,
            },
        }
    }
}

/// `N × N`, rows.
type Square<const N: usize> = [[f64; N]; N];

/// `exp(A h)` by scaling and a Taylor series of order 12: with a norm of at most 1/4 the remainder is below 1e-17.
fn exponential<const N: usize>(a: &Square<N>, h: f64) -> Square<N> {
    let norm = a
        .iter()
        .map(|row| row.iter().map(|x| (x * h).abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let halvings = (norm / 0.25).log2().ceil().clamp(0.0, 60.0) as i32;
    let scale = h / 2f64.powi(halvings);
    let scaled = a.map(|row| row.map(|x| x * scale));
    let mut sum = identity();
    for order in (1..=12).rev() {
        // Horner: I + A/1 (I + A/2 (I + ...)).
        sum = product(&scaled, &sum);
        for (i, row) in sum.iter_mut().enumerate() {
            for x in row.iter_mut() {
                *x /= f64::from(order);
            }
            row[i] += 1.0;
        }
    }
    for _ in 0..halvings {
        sum = product(&sum, &sum);
    }
    sum
}

fn identity<const N: usize>() -> Square<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

fn product<const N: usize>(a: &Square<N>, b: &Square<N>) -> Square<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..N).map(|k| a[i][k] * b[k][j]).sum()))
}

/// `A x`.
#[inline]
fn apply<const N: usize>(a: &Square<N>, x: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| (0..N).map(|k| a[i][k] * x[k]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillator_turns() {
        for h in [1e-6, 0.3, 40.0] {
            let turned = exponential(&[[0.0, 1.0], [-1.0, 0.0]], h);
            let (sin, cos) = f64::sin_cos(h);
            let wanted = [[cos, sin], [-sin, cos]];
            for (row, wanted) in turned.iter().zip(wanted) {
                for (x, wanted) in row.iter().zip(wanted) {
                    assert!((x - wanted).abs() < 1e-13 * (1.0 + h), "{h}: {x} {wanted}");
                }
            }
        }
        assert_eq!(apply(&[[1.0, 2.0], [3.0, 4.0]], &[1.0, -1.0]), [-1.0, -1.0]);
    }
}

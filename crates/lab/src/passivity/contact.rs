//! Random contacts.

use hwall_haptics::passivity::{Causality, Sampling};
use hwall_testkit::Sampler;

/// The object behind the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Behind {
    /// A fixed wall.
    Wall,
    /// A movable mass.
    Mass(Mass),
}

/// A mass with friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mass {
    /// kg.
    pub mass_kg: f64,
    /// N s/m.
    pub friction_n_s_per_m: f64,
}

/// A hand: a mass on the spring and damper of an arm, with a skin that only pushes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hand {
    /// kg.
    pub mass_kg: f64,
    /// Stiffness of the arm towards the hand's goal, N/m.
    pub arm_n_per_m: f64,
    /// N s/m.
    pub arm_n_s_per_m: f64,
    /// Stiffness of the skin, N/m.
    pub skin_n_per_m: f64,
    /// N s/m.
    pub skin_n_s_per_m: f64,
    /// Speed at which it meets the device, m/s.
    pub speed_m_per_s: f64,
    /// Depth of its goal beyond the surface, m.
    pub depth_m: f64,
    /// Time at which it returns to 0.1 m in front of the surface, s; `None`: it stays.
    pub release_s: Option<f64>,
}

/// One contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Which variable is commanded.
    pub causality: Causality,
    /// Period and delay.
    pub sampling: Sampling,
    /// Mass of the device, kg (impedance).
    pub mass_kg: f64,
    /// Friction of the device, N s/m (impedance).
    pub friction_n_s_per_m: f64,
    /// Virtual stiffness, N/m: of the wall, of the coupling to the mass, or (admittance) of the object's spring and stop.
    pub stiffness_n_per_m: f64,
    /// Virtual damping in parallel with it, N s/m.
    pub damping_n_s_per_m: f64,
    /// The object behind the surface.
    pub behind: Behind,
    /// Largest noise of a position, m; uniform.
    pub position_noise_m: f64,
    /// Resolution of a position, m.
    pub position_step_m: f64,
    /// Largest noise of a force, N; uniform.
    pub force_noise_n: f64,
    /// Resolution of a force, N.
    pub force_step_n: f64,
    /// The hand.
    pub hand: Hand,
    /// Seed of the noise.
    pub seed: u64,
}

/// Log-uniform between the ends.
fn decades(sampler: &mut Sampler, low: f64, high: f64) -> f64 {
    sampler.uniform(low.ln(), high.ln()).exp()
}

impl Contact {
    /// Contact number `index` of a seed.
    pub fn draw(seed: u64, index: u64) -> Self {
        // Scramble: seeds must be far apart to give unrelated sequences.
        let own =
            (seed ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15)).wrapping_mul(0xd134_2543_de82_ef95);
        let s = &mut Sampler::new(own);
        let causality = match s.bool() {
            true => Causality::Impedance,
            false => Causality::Admittance,
        };
        let behind = match causality == Causality::Impedance && s.bool() {
            true => Behind::Wall,
            false => Behind::Mass(Mass {
                mass_kg: decades(s, 0.1, 20.0),
                friction_n_s_per_m: decades(s, 0.1, 20.0),
            }),
        };
        let mass_kg = decades(s, 0.3, 2.0);
        let (arm_n_per_m, skin_n_per_m) = (decades(s, 50.0, 500.0), decades(s, 300.0, 3000.0));
        let hand = Hand {
            mass_kg,
            arm_n_per_m,
            arm_n_s_per_m: 2.0 * s.uniform(0.3, 1.0) * (arm_n_per_m * mass_kg).sqrt(),
            skin_n_per_m,
            skin_n_s_per_m: 2.0 * s.uniform(0.05, 0.3) * (skin_n_per_m * mass_kg).sqrt(),
            speed_m_per_s: s.uniform(0.05, 2.0),
            depth_m: s.uniform(0.005, 0.1),
            release_s: s.bool().then_some(0.6),
        };
        let stiffness_n_per_m = decades(s, 100.0, 10_000.0);
        let mass_kg = decades(s, 0.3, 10.0);
        let critical = 2.0 * (stiffness_n_per_m * mass_kg).sqrt();
        // Avoid undamped masses, which oscillate legitimately.
        let ratio = match (behind, s.bool()) {
            (Behind::Wall, true) => 0.0,
            (Behind::Wall, false) => s.uniform(0.0, 0.3),
            (Behind::Mass(_), _) => s.uniform(0.1, 0.5),
        };
        Self {
            causality,
            sampling: Sampling {
                period_s: decades(s, 0.5e-3, 8e-3),
                delay_s: s.uniform(0.0, 10e-3),
            },
            mass_kg,
            friction_n_s_per_m: decades(s, 0.1, 20.0),
            stiffness_n_per_m,
            damping_n_s_per_m: match causality {
                Causality::Impedance => ratio * critical,
                Causality::Admittance => 0.0,
            },
            behind: match (causality, behind) {
                // Avoid weakly damped doors, which oscillate legitimately.
                (Causality::Admittance, Behind::Mass(mass)) => {
                    let critical = (0.1 * stiffness_n_per_m * mass.mass_kg).sqrt();
                    Behind::Mass(Mass {
                        friction_n_s_per_m: 2.0 * s.uniform(0.1, 1.0) * critical,
                        ..mass
                    })
                }
                _ => behind,
            },
            position_noise_m: s.uniform(0.0, 50e-6),
            position_step_m: decades(s, 1e-6, 50e-6),
            force_noise_n: s.uniform(0.0, 0.5),
            force_step_n: decades(s, 0.01, 0.2),
            hand,
            seed: own ^ 0x5eed,
        }
    }

    /// Largest error of a measured position, m.
    pub fn position_error_m(&self) -> f64 {
        self.position_noise_m + 0.5 * self.position_step_m
    }

    /// Largest error of a measured force, N.
    pub fn force_error_n(&self) -> f64 {
        self.force_noise_n + 0.5 * self.force_step_n
    }
}

//! Energy balance between a hand and the board on a moving object, and the resulting limits of commands.

use super::felt_stiffness::FeltStiffness;
use crate::error::HapticsError;
use crate::object::ObjectPath;
use crate::passivity::{HandBounds, PassivePort, PassivityMethod, PortConfig, PortInput, Sampling};
use hwall_geometry::Pose;
use hwall_numeric::check::{non_negative, positive};

/// Positions stored until the corresponding force is known; a power of two.
const POSITIONS: usize = 64;
/// Longest delay in the balance, periods; longer ones count as this.
const MOST_PERIODS: f64 = 60.0;
/// Smallest position error, even of perfect sensors, m: smaller motions say nothing about the hand.
const LEAST_ERROR_M: f64 = 1e-6;
/// Lever of an object that turns about the centre of the face, m.
const LEAST_LEVER_M: f64 = 0.1;
/// Cosine between path and normal above which the pushing direction of a bare hand is known.
const FACING: f64 = 0.1;

/// Settings of the energy balance of a touched object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectPortConfig {
    /// Response when energy runs out; default [`Tank`](PassivityMethod::Tank). With [`Off`](PassivityMethod::Off) the balance is tracked without
    /// limiting anything.
    pub method: PassivityMethod,
    /// Energy that may come out before any has gone in, in addition to the object's energy at the beginning of the touch, and that the tank keeps
    /// afterwards, J; default 0.05. It covers what the sensors hide in slow pushes; a self-excited oscillation stops once it is spent.
    pub reserve_j: f64,
    /// Largest error of a measured force, N; default 0.1.
    pub force_error_n: f64,
    /// Largest error of a measured position along the path, m; default 1e-5.
    pub position_error_m: f64,
    /// Fastest motion against the push of a hand, m/s at the face; default 1.
    pub most_m_per_s: f64,
    /// What the hand may do while a command is pending: by default it has 1000 N/m and 20 N s/m, or the stiffness detected in this touch. Energy that
    /// it takes beyond that is a debt, which is paid before anything else comes out.
    pub hand: HandBounds,
    /// Time constant with which the tank drops energy beyond that of the object and the reserve, s; default 0.05.
    pub spill_s: f64,
}

impl Default for ObjectPortConfig {
    fn default() -> Self {
        Self {
            method: PassivityMethod::Tank,
            reserve_j: 0.05,
            force_error_n: 0.1,
            position_error_m: 1e-5,
            most_m_per_s: 1.0,
            hand: HandBounds {
                speed_m_per_s: 0.0,
                stiffness_n_per_m: 1000.0,
                ..HandBounds::default()
            },
            spill_s: 0.05,
        }
    }
}

impl ObjectPortConfig {
    /// Rejects settings outside their ranges.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        non_negative("reserve_j", self.reserve_j)?;
        positive("most_m_per_s", self.most_m_per_s)?;
        let sampling = Sampling {
            period_s: 1e-3,
            delay_s: 0.0,
        };
        self.port(sampling, 0.0).validate()
    }

    /// `held_j`: energy of the object when the touch begins.
    fn port(&self, sampling: Sampling, held_j: f64) -> PortConfig {
        PortConfig {
            method: self.method,
            hand: self.hand,
            force_error_n: self.force_error_n,
            position_error_m: self.position_error_m,
            initial_j: self.reserve_j + held_j,
            capacity_j: f64::INFINITY,
            spill_s: self.spill_s,
            ..PortConfig::admittance(sampling, self.most_m_per_s)
        }
    }
}

/// Energy exchanged between the hand and the board on a moving object, since the touch began.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PortLedger {
    /// Energy from the hand, as measured, J.
    pub given_j: f64,
    /// Energy returned to the hand, as measured, J.
    pub returned_j: f64,
    /// Energy that may still come out, J.
    pub tank_j: f64,
    /// Unpredicted energy that came out and is not paid back yet, J.
    pub debt_j: f64,
    /// Was the motion of the last step limited?
    pub limited: bool,
    /// Steps with a limited motion.
    pub limited_steps: u64,
    /// All steps.
    pub steps: u64,
}

/// A passive port along the path of an object. Forces and displacements are those of the centre of the face.
#[derive(Debug, Clone)]
pub(in crate::render) struct ObjectPort {
    config: ObjectPortConfig,
    force_delay_s: f64,
    motion_delay_s: f64,
    port: Option<PassivePort>,
    /// Displacement of the face per rad or m of the object, m; the sign shows which way the hand pushes.
    lever_m: f64,
    path: ObjectPath,
    /// The face where the touch began.
    face: Pose,
    positions: [f64; POSITIONS],
    stiffness: FeltStiffness,
    ledger: PortLedger,
}

impl ObjectPort {
    /// `loop_s`: sum of all delays from the force to the motion, s.
    pub(in crate::render) fn new(
        config: ObjectPortConfig,
        force_delay_s: f64,
        motion_delay_s: f64,
        loop_s: f64,
    ) -> Result<Self, HapticsError> {
        config.validate()?;
        Ok(Self {
            config,
            force_delay_s,
            motion_delay_s,
            port: None,
            lever_m: 1.0,
            path: ObjectPath::Sliding {
                direction: glam::DVec3::X,
            },
            face: Pose::IDENTITY,
            positions: [0.0; POSITIONS],
            stiffness: FeltStiffness::new(loop_s, 4.0 * config.position_error_m.max(LEAST_ERROR_M)),
            ledger: PortLedger::default(),
        })
    }

    /// Begins a touch with the face at a pose.
    pub(in crate::render) fn begin(&mut self, path: ObjectPath, face: Pose) {
        let way = path.velocity_at(face.position_m(), 1.0).linear_m_per_s;
        let size_m = way.length().max(LEAST_LEVER_M);
        let outward = way.dot(face.rotation().z_axis);
        // Along the face a hand may push either way: its first push decides.
        self.lever_m = if outward.abs() > FACING * size_m {
            -size_m.copysign(outward)
        } else {
            size_m
        };
        (self.path, self.face, self.port) = (path, face, None);
        self.stiffness.begin();
        self.ledger = PortLedger::default();
    }

    /// Estimated stiffness of the hand, N m/rad or N/m along the path.
    pub(in crate::render) fn felt_stiffness(&self) -> f64 {
        self.stiffness.n_per_m() * self.lever_m * self.lever_m
    }

    pub(in crate::render) const fn ledger(&self) -> &PortLedger {
        &self.ledger
    }

    /// Was less energy available in the last step than wanted?
    pub(in crate::render) fn is_spent(&self) -> bool {
        let acts = self.config.method != PassivityMethod::Off;
        self.ledger.limited || (acts && self.ledger.debt_j > 0.0)
    }

    /// One period. Takes the measured force along the path, N m or N, the measured face, and the slide of the board, which is no motion of the object,
    /// rad or m; then the energy of the object, J, and the motion of the face that was commanded in this touch, rad or m. `rate` is the wanted
    /// rate, rad/s or m/s; returns the allowed one.
    pub(in crate::render) fn limited(
        &mut self,
        (force, face, slid_along): (f64, &Pose, f64),
        (held_j, commanded): (f64, f64),
        rate: f64,
        dt_s: f64,
    ) -> Result<f64, HapticsError> {
        let along = self.path.way_between(&self.face, face) - slid_along;
        let position_m = self.lever_m * along;
        let late = (self.force_delay_s / dt_s).min((POSITIONS - 2) as f64);
        let port = match &mut self.port {
            Some(port) => port,
            empty => {
                let delay_s = (self.motion_delay_s + late * dt_s).min(MOST_PERIODS * dt_s);
                let sampling = Sampling {
                    period_s: dt_s,
                    delay_s,
                };
                self.positions = [position_m; POSITIONS];
                empty.insert(PassivePort::new(self.config.port(sampling, held_j))?)
            }
        };
        let newest = (self.ledger.steps as usize) % POSITIONS;
        self.positions[newest] = position_m;
        let ago = |periods: usize| self.positions[(newest + POSITIONS - periods) % POSITIONS];
        let (whole, share) = (late as usize, late.fract());
        let then_m = (1.0 - share) * ago(whole) + share * ago(whole + 1);
        let hand_force_n = force / self.lever_m;
        self.stiffness.step(hand_force_n, then_m, dt_s);
        let least_n_per_m = self.config.hand.stiffness_n_per_m;
        port.set_hand_stiffness(self.stiffness.n_per_m().max(least_n_per_m));
        // A cut of the supervisor or the link may delay what was commanded by more than is known.
        port.set_outstanding((position_m - self.lever_m * commanded).max(0.0));
        let wanted = self.lever_m * rate;
        let most = self.config.most_m_per_s;
        let out = port.step(&PortInput {
            position_m: then_m,
            hand_force_n,
            wanted: wanted.min(most),
            stored_j: Some(held_j + 0.5 * self.config.reserve_j),
        })?;
        // Moving away from the hand is not limited.
        let command = if wanted > 0.0 { wanted } else { out.command };
        let limited = (command - wanted).abs() > 1e-9;
        self.ledger = PortLedger {
            given_j: port.observer().absorbed_j(),
            returned_j: port.observer().released_j(),
            tank_j: out.tank_j,
            debt_j: port.tank().debt_j(),
            limited,
            limited_steps: self.ledger.limited_steps + u64::from(limited),
            steps: self.ledger.steps + 1,
        };
        Ok(if limited {
            command / self.lever_m
        } else {
            rate
        })
    }

    /// Reports the rate actually commanded, rad/s or m/s, and the largest deceleration, rad/s² or m/s².
    pub(in crate::render) fn sent(&mut self, rate: f64, braking: f64) {
        if let Some(port) = &mut self.port {
            port.sent(self.lever_m * rate);
            port.set_braking(self.lever_m.abs() * braking.max(1e-3));
        }
    }
}

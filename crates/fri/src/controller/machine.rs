//! The controller as a pure state machine: it receives datagrams and writes one in every send period.

use super::config::ControllerConfig;
use super::faults::{FaultConfig, Faults};
use super::plant::SimulatedPlant;
use super::quality::AnswerWindow;
use super::report::{ControllerEvent, ControllerStatistics, EndReason, EventKind};
use super::wanted::{LateAnswer, Wanted, cycles_between};
use crate::codec::{ClientCommandMode, Codec, ConnectionQuality, Datagram, SessionState};
use crate::error::{ControllerError, FriError};
use crate::limits::CommandLimits;
use crate::wrench::wrench_in_base;
use hwall_haptics::{ArmCommand, ArmState};
use hwall_kinematics::{JointPositions, JointTorques, Wrench};
use std::collections::VecDeque;

/// Most events stored until they are taken.
const EVENTS: usize = 64;
/// Period of the impedance laws of the modes torque and wrench, s.
const IMPEDANCE_PERIOD_S: f64 = 1e-3;

/// The control law of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Law {
    /// Its own servo: positions, or holding.
    Servo,
    /// Springs of the joints and the overlay.
    Joints,
    /// Springs of the tool and the overlay.
    Tool,
}

/// A simulated controller around a simulated arm.
///
/// It has no clock, no socket and no threads: call [`receive`](Self::receive) for every received datagram, then [`cycle`](Self::cycle), and send the
/// result; a second of its time is a thousand milliseconds of cycles. The same datagrams in the same cycles give bit-identical answers.
/// [`UdpController`](super::UdpController) is the loop around it.
///
/// A command takes effect in the cycle after its arrival. Nothing is allocated after construction.
#[derive(Debug)]
pub struct Controller<P> {
    pub(super) plant: P,
    pub(super) config: ControllerConfig,
    pub(super) codec: Codec,
    pub(super) limits: CommandLimits,
    pub(super) expiry_s: f64,
    pub(super) cycles: u64,
    pub(super) state: SessionState,
    pub(super) since_s: f64,
    pub(super) may_command: bool,
    pub(super) window: AnswerWindow,
    pub(super) faults: Faults,
    pub(super) quality: ConnectionQuality,
    /// Sequence number of the newest message.
    pub(super) sequence: u32,
    /// Messages sent outside `IDLE` in this session.
    pub(super) counted: u64,
    pub(super) answered: bool,
    pub(super) misses: u64,
    /// Sequence number of the client's newest message, and of the message that it answered.
    pub(super) client_sequence: u32,
    pub(super) last_answered: Option<u32>,
    pub(super) incoming: Option<Wanted>,
    pub(super) late: Option<LateAnswer>,
    /// Positions of the interpolator: the arm's position when commanding began.
    pub(super) interpolator: JointPositions,
    pub(super) in_force: Wanted,
    pub(super) in_force_since_s: f64,
    /// Current commanded angles: each command moves them towards the positions in force, no faster than the joints.
    pub(super) commanded_rad: [f64; 7],
    /// Time of the last positions that matched the interpolator's, s.
    pub(super) mirrored_s: Option<f64>,
    pub(super) expired: bool,
    law: Law,
    pub(super) commanded_torque_n_m: [f64; 7],
    pub(super) statistics: ControllerStatistics,
    pub(super) events: VecDeque<ControllerEvent>,
    pub(super) refusal: Option<FriError>,
    pub(super) ended: Option<EndReason>,
}

impl<P: SimulatedPlant> Controller<P> {
    /// A controller at time zero, before a session; the arm holds.
    ///
    /// # Errors
    /// A setting outside its range, or a mode that the arm does not support.
    pub fn new(mut plant: P, config: ControllerConfig) -> Result<Self, ControllerError<P::Error>> {
        config.validate()?;
        if config.mode != ClientCommandMode::Position && !plant.takes_torques() {
            return Err(FriError::NeedsTorques(config.mode).into());
        }
        let q = plant.state().map_err(ControllerError::Plant)?.q;
        plant
            .command(ArmCommand::Hold)
            .map_err(ControllerError::Plant)?;
        let limits = CommandLimits::new(&**plant.model(), config.max_overlay_torque_n_m);
        let interpolator = JointPositions(limits.clamped(&q.0));
        let answer_s = config.send_period_s() * f64::from(config.receive_multiplier);
        Ok(Self {
            limits,
            codec: Codec::new(config.version),
            // A command must stay valid until the next one can come.
            expiry_s: config.command_expiry_s.max(2.0 * answer_s),
            cycles: 0,
            state: SessionState::Idle,
            since_s: 0.0,
            may_command: config.ready_s.is_some(),
            window: AnswerWindow::new(config.quality)?,
            faults: Faults::new(config.faults)?,
            quality: ConnectionQuality::Poor,
            sequence: u32::MAX,
            counted: 0,
            answered: false,
            misses: 0,
            client_sequence: 0,
            last_answered: None,
            incoming: None,
            late: None,
            interpolator,
            in_force: Wanted {
                answers: 0,
                position_rad: interpolator.0,
                torque_n_m: [0.0; 7],
                wrench: Wrench::default(),
            },
            in_force_since_s: 0.0,
            commanded_rad: interpolator.0,
            mirrored_s: None,
            expired: false,
            law: Law::Servo,
            commanded_torque_n_m: [0.0; 7],
            statistics: ControllerStatistics::default(),
            events: VecDeque::with_capacity(EVENTS),
            refusal: None,
            ended: None,
            plant,
            config,
        })
    }

    /// One send period: moves the arm, evaluates the answers of the last period, and writes the next message. Returns its length.
    ///
    /// # Errors
    /// An error of the simulated arm.
    pub fn cycle(&mut self, datagram: &mut Datagram) -> Result<usize, ControllerError<P::Error>> {
        if self.cycles > 0 {
            self.advance().map_err(ControllerError::Plant)?;
        }
        let stamp_off_s = self.faults.cycle(self.config.send_period_ms);
        let now_s = self.t_s();
        let measured = self.plant.state().map_err(ControllerError::Plant)?;
        self.judge_answers();
        self.step_session(now_s, &measured)
            .map_err(ControllerError::Plant)?;
        self.cycles += 1;
        self.sequence = self.sequence.wrapping_add(1);
        self.counted += u64::from(self.state != SessionState::Idle);
        self.statistics.sent += 1;
        let message = self.message(&measured, (now_s + stamp_off_s).max(0.0));
        self.take_late();
        Ok(match self.config.faults.unknown_enumerations {
            true => self.codec.encode_odd_monitor(&message, datagram)?,
            false => self.codec.encode_monitor(&message, datagram)?,
        })
    }

    fn advance(&mut self) -> Result<(), P::Error> {
        if self.law == Law::Servo {
            self.commanded_torque_n_m = [0.0; 7];
            return self.plant.advance(self.config.send_period_s());
        }
        for _ in 0..self.config.send_period_ms {
            let state = self.plant.state()?;
            let reference = JointPositions(self.commanded_rad);
            let impedance = &self.config.impedance;
            let torques = match self.law {
                Law::Tool => {
                    let arm = &**self.plant.model();
                    impedance.cartesian_torques(arm, &state, &reference, &self.in_force.wrench)
                }
                _ => impedance.joint_torques(&state, &reference, &self.in_force.torque_n_m),
            };
            self.commanded_torque_n_m = torques;
            self.plant
                .command(ArmCommand::Torque(JointTorques(torques)))?;
            self.plant.advance(IMPEDANCE_PERIOD_S)?;
        }
        Ok(())
    }

    fn step_session(&mut self, now_s: f64, measured: &ArmState) -> Result<(), P::Error> {
        let is_good = self.quality >= ConnectionQuality::Good;
        let for_s = now_s - self.since_s;
        let incoming = self.incoming.take();
        match self.state {
            SessionState::Idle if for_s >= self.config.idle_s => {
                self.enter(SessionState::MonitoringWait);
            }
            SessionState::Idle => {}
            SessionState::MonitoringWait if is_good => self.enter(SessionState::MonitoringReady),
            SessionState::MonitoringWait => {}
            SessionState::MonitoringReady if !is_good => self.enter(SessionState::MonitoringWait),
            SessionState::MonitoringReady => {
                let is_asked = self.config.ready_s.is_some_and(|after_s| for_s >= after_s);
                if self.may_command && is_asked {
                    self.prepare(measured);
                    self.enter(SessionState::CommandingWait);
                }
            }
            SessionState::CommandingWait | SessionState::CommandingActive if !is_good => {
                self.end(EndReason::Quality(self.quality))?;
            }
            SessionState::CommandingActive if self.faults.leaves() => {
                self.end(EndReason::Application)?;
            }
            SessionState::CommandingWait => self.wait_for_commands(now_s, incoming),
            SessionState::CommandingActive => self.follow(now_s, measured, incoming)?,
        }
        Ok(())
    }

    /// Sets the positions that the client has to repeat and, with torques, the springs that hold there.
    fn prepare(&mut self, measured: &ArmState) {
        self.interpolator = JointPositions(self.limits.clamped(&measured.q.0));
        self.in_force = Wanted {
            answers: self.sequence,
            position_rad: self.interpolator.0,
            torque_n_m: [0.0; 7],
            wrench: Wrench::default(),
        };
        self.commanded_rad = self.interpolator.0;
        self.mirrored_s = None;
        self.expired = false;
        self.ended = None;
        self.law = self.law_of_mode();
    }

    const fn law_of_mode(&self) -> Law {
        match self.config.mode {
            ClientCommandMode::Torque => Law::Joints,
            ClientCommandMode::Wrench => Law::Tool,
            _ => Law::Servo,
        }
    }

    fn wait_for_commands(&mut self, now_s: f64, incoming: Option<Wanted>) {
        if let Some(wanted) = incoming {
            let asked = JointPositions(wanted.position_rad);
            let off_rad = self.interpolator.max_abs_difference(&asked);
            let is_mirrored = off_rad <= self.config.mirror_tolerance_rad;
            self.mirrored_s = is_mirrored.then_some(now_s);
        }
        let is_fresh = |then_s: f64| now_s - then_s <= self.expiry_s;
        let for_s = now_s - self.since_s;
        if for_s >= self.config.wait_s && self.mirrored_s.is_some_and(is_fresh) {
            self.in_force.answers = self.sequence;
            self.in_force_since_s = now_s;
            self.statistics.activations += 1;
            self.enter(SessionState::CommandingActive);
        }
    }

    fn follow(
        &mut self,
        now_s: f64,
        measured: &ArmState,
        incoming: Option<Wanted>,
    ) -> Result<(), P::Error> {
        if let Some(reason) = self.external_torque_reason(measured) {
            return self.end(reason);
        }
        let Some(wanted) = incoming else {
            if !self.expired && now_s - self.in_force_since_s > self.expiry_s {
                self.expired = true;
                self.statistics.expired += 1;
                self.say(EventKind::Expired);
                // Later commands must begin at the arm's position.
                self.in_force.position_rad = self.limits.clamped(&measured.q.0);
                self.commanded_rad = self.in_force.position_rad;
                self.law = Law::Servo;
                return self.plant.command(ArmCommand::Hold);
            }
            return Ok(());
        };
        let period_s = self.config.send_period_s();
        let dt_s = (cycles_between(self.in_force.answers, wanted.answers) * period_s)
            .clamp(period_s, self.expiry_s);
        let last_rad = self.in_force.position_rad;
        let checked = self
            .limits
            .check_step(&last_rad, &wanted.position_rad, dt_s)
            .and_then(|()| self.limits.check_torque(&wanted.torque_n_m))
            .and_then(|()| {
                let arm = self.plant.model();
                let (tool, jacobian) = arm.forward_and_jacobian(&measured.q);
                let torques = jacobian.torques(&wrench_in_base(&tool, &wanted.wrench));
                self.limits.check_torque(&torques.0)
            });
        if let Err(violation) = checked {
            return self.end(EndReason::Limit(violation));
        }
        self.statistics.accepted += 1;
        self.in_force = wanted;
        self.in_force.position_rad = self.limits.clamped(&wanted.position_rad);
        self.in_force_since_s = now_s;
        self.expired = false;
        self.law = self.law_of_mode();
        // After missed cycles this may take several steps: the arm is delayed, it does not jump.
        let answer_s = period_s * f64::from(self.config.receive_multiplier);
        let to_rad = &self.in_force.position_rad;
        self.commanded_rad = self.limits.followed(&self.commanded_rad, to_rad, answer_s);
        match self.law {
            Law::Servo => {
                let q = JointPositions(self.commanded_rad);
                self.plant.command(ArmCommand::Position(q))
            }
            _ => Ok(()),
        }
    }

    fn external_torque_reason(&self, measured: &ArmState) -> Option<EndReason> {
        let torques = measured.external_torque?.0;
        let limits = self.config.max_external_torque_n_m;
        // NaN exceeds every limit.
        let joint = (0..7).find(|&i| torques[i].abs() > limits[i] || torques[i].is_nan())?;
        Some(EndReason::ExternalTorque {
            joint,
            value_n_m: torques[joint],
            max_n_m: limits[joint],
        })
    }

    fn end(&mut self, reason: EndReason) -> Result<(), P::Error> {
        self.ended = Some(reason);
        self.say(EventKind::Ended(reason));
        self.may_command = match reason {
            EndReason::Quality(_) => self.config.asks_again,
            EndReason::Application => true,
            _ => false,
        };
        self.law = Law::Servo;
        self.incoming = None;
        self.enter(match self.quality >= ConnectionQuality::Good {
            true => SessionState::MonitoringReady,
            false => SessionState::MonitoringWait,
        });
        self.plant.command(ArmCommand::Hold)
    }

    fn enter(&mut self, to: SessionState) {
        let from = std::mem::replace(&mut self.state, to);
        self.since_s = self.t_s();
        self.say(EventKind::State { from, to });
    }

    pub(super) fn say(&mut self, kind: EventKind) {
        if self.events.len() == EVENTS {
            self.events.pop_front();
            self.statistics.dropped_events += 1;
        }
        let t_s = self.t_s();
        self.events.push_back(ControllerEvent { t_s, kind });
    }

    /// Closes the session: the arm holds, the next messages report `IDLE`, and no more answers are expected.
    ///
    /// # Errors
    /// An error of the simulated arm.
    pub fn close(&mut self) -> Result<(), ControllerError<P::Error>> {
        if self.state >= SessionState::CommandingWait {
            self.end(EndReason::Closed)
                .map_err(ControllerError::Plant)?;
        }
        self.may_command = false;
        self.config.idle_s = f64::INFINITY;
        self.counted = 0;
        self.enter(SessionState::Idle);
        Ok(())
    }

    /// Lets the application request commands again after a limit ended commanding.
    pub const fn acknowledge(&mut self) {
        self.may_command = self.config.ready_s.is_some();
    }

    /// Takes the oldest event.
    pub fn next_event(&mut self) -> Option<ControllerEvent> {
        self.events.pop_front()
    }

    /// Statistics since the start.
    #[must_use]
    pub const fn statistics(&self) -> &ControllerStatistics {
        &self.statistics
    }

    /// The error of the last refused datagram or command.
    #[must_use]
    pub const fn refusal(&self) -> Option<&FriError> {
        self.refusal.as_ref()
    }

    /// Why commanding ended last; `None` while it has not, or since it began again.
    #[must_use]
    pub const fn ended(&self) -> Option<EndReason> {
        self.ended
    }

    /// The state of the session.
    #[must_use]
    pub const fn state(&self) -> SessionState {
        self.state
    }

    /// The quality of the connection.
    #[must_use]
    pub const fn quality(&self) -> ConnectionQuality {
        self.quality
    }

    /// Time of the next message on the clock of the controller, s.
    #[must_use]
    pub fn t_s(&self) -> f64 {
        (self.cycles * u64::from(self.config.send_period_ms)) as f64 * 1e-3
    }

    /// Settings.
    #[must_use]
    pub const fn config(&self) -> &ControllerConfig {
        &self.config
    }

    /// The simulated arm.
    #[must_use]
    pub const fn plant(&self) -> &P {
        &self.plant
    }

    /// Sets the faults of the connection from now on; the seed stays.
    ///
    /// # Errors
    /// A setting outside its range; nothing is then changed.
    pub fn set_faults(&mut self, faults: FaultConfig) -> Result<(), FriError> {
        self.faults.set(faults)?;
        self.config.faults = faults;
        Ok(())
    }

    /// The simulated arm, for pushing it or reading its state.
    pub const fn plant_mut(&mut self) -> &mut P {
        &mut self.plant
    }
}

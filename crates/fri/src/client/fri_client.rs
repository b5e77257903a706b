//! The connection to a controller: messages in, answers out.

use super::commanded::Commanded;
use super::config::{ClientStatistics, FriClientConfig};
use super::newest::{Newest, RanAhead, is_finite, set_back, time_of_message};
use super::transport::{Transport, UdpTransport};
use super::unfit::{Unfit, unfit};
use super::velocity::VelocityFilter;
use crate::codec::{
    ClientCommandMode, Codec, ConnectionQuality, DATAGRAM_BYTES, Datagram, FriVersion,
    MonitorMessage, SessionState,
};
use crate::error::FriError;
use crate::limits::CommandLimits;
use hwall_kinematics::{ArmKinematics, JointPositions};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

/// A message this much older than the newest one is not a late one: the controller has begun anew.
const NEW_SEQUENCE: u32 = 1000;
/// Datagrams that are read in one go at most.
const MOST_WAITING: u32 = 64;

/// A client of the Fast Robot Interface, and an [`Arm`](hwall_haptics::Arm).
///
/// The controller sets the pace: wait for its next message ([`wait_for_message`](Self::wait_for_message)), read the state, give
/// a command, which answers that message. Whoever only waits uses [`mirror`](Self::mirror), which answers without
/// wanting anything, or [`wait_for_commanding`](Self::wait_for_commanding), which does it until commands are taken. A message that gets no
/// answer before the next wait is counted ([`ClientStatistics::unanswered`]) and lowers the quality of the connection.
///
/// What commands do depends on what the application on the controller has chosen ([`command_mode`](Self::command_mode)):
/// positions and `Hold` in mode position, torques and `Hold` in mode torque, [`command_wrench`](Self::command_wrench) and `Hold` in mode
/// wrench. Before commanding is active they have no effect and the positions of the interpolator go out instead; once it was
/// active and has ended, they are refused ([`FriError::CommandingEnded`]).
///
/// A message that says that the arm takes no commands ([`unfit`](Self::unfit): a safety stop, drives that are off, a control mode that does
/// not go with the commands) is not commanded on: before commanding begins the client waits, afterwards the arm brakes and commands are
/// refused ([`FriError::Unfit`]) until the values fit again.
///
/// Positions begin where the controller's interpolator holds the arm ([`interpolator`](Self::interpolator)). Whoever begins at the measured
/// angles is off by the error of the arm's servo: up to 0.05 rad are laid over what is commanded and fade within a second. A command
/// moves the arm no further than the joints may go between two answers. Missed or lost answers delay the arm: it stays
/// on the path that was asked for, goes on from where the controller holds it ([`behind_s`](Self::behind_s)), and catches up by at most
/// 15 % of its speed. After 50 ms without a command it is taken to stand, and begins from rest. More than 0.2 s behind it brakes, and the command is refused ([`FriError::Behind`]).
///
/// In mode torque positions are held by the springs of the controller, so its stiffness must not be zero for them. From positions
/// to torques and back the springs are led over no faster than the joints may move.
///
/// Times count from the first message, on the clock of the controller: one period a message, slowly corrected by its stamps. A period that is
/// stated too long is refused ([`Unfit::Period`]). Velocities are differences of the
/// measured positions through a first-order low-pass ([`FriClientConfig::velocity_hz`]): exact for steady motion,
/// late by 3.2 ms and half a period at 50 Hz. After construction nothing is allocated.
///
/// Datagrams go over UDP ([`bind`](FriClient::bind)), or another way ([`over`](FriClient::over)): to a simulated controller in the
/// same program, for tests in simulated time.
///
/// Only tested against the simulated controller of this crate.
#[derive(Debug)]
pub struct FriClient<T = UdpTransport> {
    pub(super) config: FriClientConfig,
    pub(super) limits: CommandLimits,
    pub(super) transport: T,
    pub(super) codec: Codec,
    pub(super) peer: Option<SocketAddr>,
    pub(super) newest: Option<Newest>,
    /// What is added to the time of the client to get the stamps of the controller, ns.
    stamps_ahead_ns: i128,
    ran_ahead: RanAhead,
    velocity: VelocityFilter,
    /// Messages since the last answer.
    pub(super) since_answer: u32,
    /// Is an answer to the newest message due, and not given?
    pub(super) owes: bool,
    pub(super) sequence: u32,
    was_active: bool,
    pub(super) commanded: Commanded,
    pub(super) statistics: ClientStatistics,
    /// What the first datagrams of the controller, or the last that made no sense, look like.
    looks_like: Option<FriVersion>,
}

impl FriClient {
    /// Listens for a controller. `model` gives the limits that commands must keep.
    ///
    /// # Errors
    /// A setting outside its range, or a socket that cannot be had: another program may listen there.
    pub fn bind(model: &Arc<dyn ArmKinematics>, config: FriClientConfig) -> Result<Self, FriError> {
        config.validate()?;
        Self::over(model, config, UdpTransport::bind(config.listen)?)
    }

    /// The address that is listened on.
    ///
    /// # Errors
    /// What the system says.
    pub fn local_address(&self) -> Result<SocketAddr, FriError> {
        self.transport
            .local_address()
            .map_err(FriError::io("asking for the address"))
    }
}

impl<T: Transport> FriClient<T> {
    /// As [`bind`](FriClient::bind), over another way than a socket; [`FriClientConfig::listen`] is not used.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn over(
        model: &Arc<dyn ArmKinematics>,
        config: FriClientConfig,
        transport: T,
    ) -> Result<Self, FriError> {
        config.validate()?;
        Ok(Self {
            limits: CommandLimits::new(&**model, config.max_torque_n_m),
            transport,
            codec: Codec::new(config.version),
            peer: None,
            newest: None,
            stamps_ahead_ns: 0,
            ran_ahead: RanAhead::default(),
            velocity: VelocityFilter::new(config.velocity_hz),
            since_answer: 0,
            owes: false,
            sequence: 0,
            was_active: false,
            commanded: Commanded::new(),
            statistics: ClientStatistics::default(),
            looks_like: None,
            config,
        })
    }

    /// Waits for the next message of the controller; returns its time, s. Of several that have come the newest counts.
    ///
    /// # Errors
    /// No message within `timeout` ([`FriError::Silent`]), a state without positions, or what the network says.
    pub fn wait_for_message(&mut self, timeout: Duration) -> Result<f64, FriError> {
        if std::mem::take(&mut self.owes) {
            self.statistics.unanswered += 1;
        }
        let until = self.transport.elapsed().saturating_add(timeout);
        loop {
            let left = until.saturating_sub(self.transport.elapsed());
            if left.is_zero() {
                return Err(self.silent(timeout));
            }
            if self.receive(Some(left))? == Some(true) {
                break;
            }
        }
        self.take_waiting()?;
        self.t_s().ok_or(FriError::NoMessage)
    }

    /// Takes what has come, without waiting: no more than a cycle has time for.
    pub(super) fn take_waiting(&mut self) -> Result<(), FriError> {
        for _ in 0..MOST_WAITING {
            let Some(is_message) = self.receive(None)? else {
                break;
            };
            self.statistics.skipped += u64::from(is_message);
        }
        Ok(())
    }

    /// Answers every message, wanting nothing, until commanding is active and the arm takes commands; returns the time of the first such
    /// message, s.
    ///
    /// # Errors
    /// As [`wait_for_message`](Self::wait_for_message); commanding that does not begin within `timeout`, with the value that forbids it
    /// ([`FriError::Unfit`]), if there is one.
    pub fn wait_for_commanding(&mut self, timeout: Duration) -> Result<f64, FriError> {
        let until = self.transport.elapsed().saturating_add(timeout);
        loop {
            let left = until.saturating_sub(self.transport.elapsed());
            let waited = self.wait_for_message(left);
            let unfit = self.unfit();
            let t_s = match (waited, unfit) {
                (Err(FriError::Silent { .. }), Some(unfit)) if !self.is_silent() => {
                    return Err(unfit.into());
                }
                (waited, _) => waited?,
            };
            let is_active = self.session_state() == Some(SessionState::CommandingActive);
            match (is_active, unfit) {
                (true, None) => return Ok(t_s),
                (true, Some(_)) => self.stand()?,
                (false, _) => self.mirror()?,
            }
        }
    }

    /// One datagram: `Some(true)` for a new message, `None` if there is no datagram.
    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<bool>, FriError> {
        let mut datagram: Datagram = [0; DATAGRAM_BYTES];
        let received = self
            .transport
            .receive(&mut datagram, wait)
            .map_err(FriError::io("receiving from the controller"))?;
        let Some((length, from)) = received else {
            return Ok(None);
        };
        if !self.listens_to(from) {
            self.statistics.foreign += 1;
            return Ok(Some(false));
        }
        let bytes = datagram.get(..length).unwrap_or(&[]);
        let decoded = self.codec.decode_monitor(bytes);
        if self.newest.is_none() || decoded.is_err() {
            self.looks_like = FriVersion::of_datagram(bytes);
        }
        match decoded {
            Ok(message) => self.take(message, from).map(Some),
            Err(_) => {
                self.statistics.malformed += 1;
                Ok(Some(false))
            }
        }
    }

    /// One controller at a time; another one only when the first has fallen silent.
    fn listens_to(&self, from: SocketAddr) -> bool {
        let is_allowed = self.config.controller.is_none_or(|ip| ip == from.ip());
        let is_free = self.peer.is_none_or(|peer| peer == from) || self.is_silent();
        is_allowed && is_free
    }

    fn is_silent(&self) -> bool {
        let silence_s = self.config.silence_s;
        let now = self.transport.elapsed();
        let heard = |newest: &Newest| now.saturating_sub(newest.arrived).as_secs_f64() <= silence_s;
        !self.newest.as_ref().is_some_and(heard)
    }

    fn take(&mut self, message: MonitorMessage, from: SocketAddr) -> Result<bool, FriError> {
        let data = message.data.unwrap_or_default();
        let q_rad = match data.position_rad {
            Some(q_rad) if is_finite(&message) => q_rad,
            // A controller that never sends them says nothing of the arm.
            None if self.newest.is_none() => return Err(FriError::NoPositions),
            _ => {
                self.statistics.malformed += 1;
                return Ok(false);
            }
        };
        let sequence = message.header.sequence;
        let stamp_ns = data.time.map(|time| i128::from(time.to_ns()));
        let ahead = self
            .newest
            .as_ref()
            .map(|newest| sequence.wrapping_sub(newest.message.header.sequence));
        let is_stale = ahead.is_some_and(|ahead| ahead == 0 || ahead > u32::MAX - NEW_SEQUENCE);
        // After a silence it is one that has begun anew, whatever its number.
        if is_stale && self.peer == Some(from) && !self.is_silent() {
            self.statistics.stale += 1;
            return Ok(false);
        }
        let last = self.newest.take();
        let time_ns = match (ahead, &last) {
            (Some(ahead @ 1..NEW_SEQUENCE), Some(last)) if self.peer == Some(from) => {
                self.statistics.lost += u64::from(ahead - 1);
                let stamp_ns = stamp_ns.map(|stamp_ns| stamp_ns - self.stamps_ahead_ns);
                let time_ns = time_of_message(last.time_ns, ahead, &message, stamp_ns);
                if let Some(behind_ns) = stamp_ns.and_then(|stamp_ns| set_back(stamp_ns, time_ns)) {
                    self.stamps_ahead_ns -= behind_ns;
                    self.ran_ahead.note(time_ns);
                }
                let dt_ns = time_ns.saturating_sub(last.time_ns);
                self.velocity.update(&q_rad, dt_ns as f64 * 1e-9);
                time_ns
            }
            _ => {
                self.begin_session(&q_rad);
                // Time goes on from one session to the next, and never back.
                let silence = |last: &Newest| self.transport.elapsed().saturating_sub(last.arrived);
                let time_ns = last
                    .as_ref()
                    .map_or(0, |last| last.time_ns + silence(last).as_nanos() as u64);
                self.stamps_ahead_ns = stamp_ns.unwrap_or(0) - i128::from(time_ns);
                time_ns
            }
        };
        let reflected = message.header.reflected_sequence;
        let arrival = self.commanded.answers.reflected(reflected);
        self.statistics.note_arrival(arrival);
        self.peer = Some(from);
        self.was_active |= message.connection.state == SessionState::CommandingActive;
        self.newest = Some(Newest {
            message,
            q_rad,
            time_ns,
            arrived: self.transport.elapsed(),
        });
        self.statistics.received += 1;
        self.since_answer = self.since_answer.saturating_add(1);
        let multiplier = message.connection.receive_multiplier.unwrap_or(1);
        self.owes =
            message.connection.state != SessionState::Idle && self.since_answer >= multiplier;
        Ok(true)
    }

    fn begin_session(&mut self, q_rad: &[f64; 7]) {
        self.velocity.reset();
        self.velocity.update(q_rad, 0.0);
        self.since_answer = 0;
        self.ran_ahead = RanAhead::default();
        self.commanded = Commanded::new();
        self.statistics.sessions += 1;
    }

    fn silent(&self, waited: Duration) -> FriError {
        let now = self.transport.elapsed();
        let since = |newest: &Newest| now.saturating_sub(newest.arrived);
        let waited = self.newest.as_ref().map_or(waited, since);
        FriError::Silent {
            waited_s: waited.as_secs_f64(),
            other_version: self.looks_like.filter(|v| *v != self.config.version),
        }
    }

    /// The newest message, unless the controller has been silent for too long.
    pub(super) fn newest(&self) -> Result<&Newest, FriError> {
        let newest = self.newest.as_ref().ok_or(FriError::NoMessage)?;
        match self.is_silent() {
            true => Err(self.silent(Duration::ZERO)),
            false => Ok(newest),
        }
    }

    /// Is commanding active, or did it end (an error), or has it not begun?
    pub(super) fn is_active(&self) -> Result<bool, FriError> {
        let connection = self.newest()?.message.connection;
        let is_active = connection.state == SessionState::CommandingActive;
        if self.was_active && !is_active {
            return Err(FriError::CommandingEnded {
                state: connection.state,
                quality: connection.quality,
            });
        }
        Ok(is_active)
    }

    /// After commanding has ended: commands may be given again when it begins again.
    pub const fn begin_again(&mut self) {
        self.was_active = false;
        self.commanded.forget();
    }

    /// How far the arm is behind what was asked for, because answers did not arrive or were not given, s.
    #[must_use]
    pub fn behind_s(&self) -> f64 {
        self.commanded.behind_ns as f64 * 1e-9
    }

    pub(super) const fn velocity_rad_per_s(&self) -> &[f64; 7] {
        self.velocity.velocity_rad_per_s()
    }

    /// Time of the newest message since the first one, on the clock of the controller, s. It never goes back.
    #[must_use]
    pub fn t_s(&self) -> Option<f64> {
        let newest = self.newest.as_ref()?;
        Some(newest.time_ns as f64 * 1e-9)
    }

    /// The newest message as it came.
    #[must_use]
    pub fn message(&self) -> Option<&MonitorMessage> {
        self.newest.as_ref().map(|newest| &newest.message)
    }

    /// Where the session stands.
    #[must_use]
    pub fn session_state(&self) -> Option<SessionState> {
        self.message().map(|message| message.connection.state)
    }

    /// How well answers come, as the controller judges it.
    #[must_use]
    pub fn quality(&self) -> Option<ConnectionQuality> {
        self.message().map(|message| message.connection.quality)
    }

    /// What the controller says that forbids commands, from when commanding is about to begin: the newest message.
    #[must_use]
    pub fn unfit(&self) -> Option<Unfit> {
        let newest = self.newest.as_ref()?;
        let said_ms = newest.message.connection.send_period_ms;
        let period = said_ms.filter(|_| self.ran_ahead.is_wrong(newest.time_ns));
        let period = period.map(|said_ms| Unfit::Period { said_ms });
        unfit(&newest.message).or(period)
    }

    /// What the controller takes; known from when commanding is about to begin. A controller that names no mode, or an unknown one, is
    /// taken to accept positions.
    #[must_use]
    pub fn command_mode(&self) -> ClientCommandMode {
        let mode = |message: &MonitorMessage| {
            let said = message.interpolator.and_then(|i| i.command_mode);
            let is_commanding = message.connection.state >= SessionState::CommandingWait;
            said.or_else(|| is_commanding.then_some(ClientCommandMode::Position))
        };
        self.message()
            .and_then(mode)
            .unwrap_or(ClientCommandMode::None)
    }

    /// Where the controller's interpolator holds the arm, rad; known from when commanding is about to begin.
    ///
    /// A program that moves the arm by positions begins here. The measured angles differ by the error of the arm's servo.
    #[must_use]
    pub fn interpolator(&self) -> Option<JointPositions> {
        let interpolator = self.message()?.interpolator?;
        interpolator.position_rad.map(JointPositions)
    }

    /// The controller that is listened to.
    #[must_use]
    pub const fn controller(&self) -> Option<SocketAddr> {
        self.peer
    }

    /// The way to the controller.
    #[must_use]
    pub const fn transport(&self) -> &T {
        &self.transport
    }

    /// The way to the controller.
    pub const fn transport_mut(&mut self) -> &mut T {
        &mut self.transport
    }

    /// What was counted.
    #[must_use]
    pub const fn statistics(&self) -> &ClientStatistics {
        &self.statistics
    }
}

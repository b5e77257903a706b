//! The connection to a controller: receives messages, sends answers.

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

/// A message this much older than the newest one is not late: the controller has restarted.
const NEW_SEQUENCE: u32 = 1000;
/// Most datagrams read in one call.
const MOST_WAITING: u32 = 64;

/// A client of the Fast Robot Interface, and an [`Arm`](hwall_haptics::Arm).
///
/// The controller determines the timing: wait for its next message ([`wait_for_message`](Self::wait_for_message)), read the state, and give a
/// command, which answers that message. To wait without moving, use [`mirror`](Self::mirror), which answers without moving the arm, or
/// [`wait_for_commanding`](Self::wait_for_commanding), which does so until commands are accepted. A message without an answer before the next wait is
/// counted ([`ClientStatistics::unanswered`]) and lowers the quality of the connection.
///
/// The application on the controller chooses the command mode ([`command_mode`](Self::command_mode)): positions and `Hold` in mode position, torques
/// and `Hold` in mode torque, [`command_wrench`](Self::command_wrench) and `Hold` in mode wrench. Before commanding is active, commands have no
/// effect and the interpolator's positions are sent instead. After it has ended, commands are refused ([`FriError::CommandingEnded`]).
///
/// If a message shows that the arm accepts no commands ([`unfit`](Self::unfit): a safety stop, drives that are off, an unsuitable control mode), the
/// client waits before commanding begins. Afterwards the arm brakes and commands are refused ([`FriError::Unfit`]) until the values are suitable
/// again.
///
/// Begin positions where the controller's interpolator holds the arm ([`interpolator`](Self::interpolator)). The measured angles differ from it by
/// the servo error of the arm: an offset of up to 0.05 rad is added to the commands and fades within a second. A command moves the arm no further
/// than the joints can move between two answers. Missed or lost answers delay the arm: it stays on the requested path, continues from where the
/// controller holds it ([`behind_s`](Self::behind_s)), and catches up by at most 15 % of its speed. After 50 ms without a command it counts as
/// standing, and begins from rest. If it is delayed by more than 0.2 s it brakes, and the command is refused ([`FriError::Behind`]).
///
/// In mode torque the controller's springs hold positions, so its stiffness must not be zero for them. Between positions and torques the springs'
/// reference moves no faster than the joints may.
///
/// Times count from the first message, on the clock of the controller: one period per message, slowly corrected by its time stamps. A stated period
/// that is too long is refused ([`Unfit::Period`]). Velocities are differences of the measured positions through a first-order low-pass
/// ([`FriClientConfig::velocity_hz`]): exact for steady motion, delayed by 3.2 ms and half a period at 50 Hz. Nothing is allocated after
/// construction.
///
/// Datagrams use UDP ([`bind`](FriClient::bind)) or another transport ([`over`](FriClient::over)): for example a simulated controller in the same
/// program, for tests in simulated time.
///
/// Tested only against the simulated controller of this crate.
#[derive(Debug)]
pub struct FriClient<T = UdpTransport> {
    pub(super) config: FriClientConfig,
    pub(super) limits: CommandLimits,
    pub(super) transport: T,
    pub(super) codec: Codec,
    pub(super) peer: Option<SocketAddr>,
    pub(super) newest: Option<Newest>,
    /// Offset from the client's time to the controller's time stamps, ns.
    stamps_ahead_ns: i128,
    ran_ahead: RanAhead,
    velocity: VelocityFilter,
    /// Messages since the last answer.
    pub(super) since_answer: u32,
    /// Is an answer to the newest message still due?
    pub(super) owes: bool,
    pub(super) sequence: u32,
    was_active: bool,
    pub(super) commanded: Commanded,
    pub(super) statistics: ClientStatistics,
    /// Apparent version of the controller's first datagrams, or of the last unreadable one.
    looks_like: Option<FriVersion>,
}

impl FriClient {
    /// Listens for a controller. `model` gives the limits for commands.
    ///
    /// # Errors
    /// A setting outside its range, or a socket that cannot be opened: another program may be listening there.
    pub fn bind(model: &Arc<dyn ArmKinematics>, config: FriClientConfig) -> Result<Self, FriError> {
        config.validate()?;
        Self::over(model, config, UdpTransport::bind(config.listen)?)
    }

    /// The address that the client listens on.
    ///
    /// # Errors
    /// A system error.
    pub fn local_address(&self) -> Result<SocketAddr, FriError> {
        self.transport
            .local_address()
            .map_err(FriError::io("asking for the address"))
    }
}

impl<T: Transport> FriClient<T> {
    /// As [`bind`](FriClient::bind), over another transport; [`FriClientConfig::listen`] is not used.
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

    /// Waits for the next message of the controller; returns its time, s. Of several waiting messages the newest counts.
    ///
    /// # Errors
    /// No message within `timeout` ([`FriError::Silent`]), a state without positions, or a network error.
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

    /// Reads the waiting datagrams without blocking: no more than a cycle has time for.
    pub(super) fn take_waiting(&mut self) -> Result<(), FriError> {
        for _ in 0..MOST_WAITING {
            let Some(is_message) = self.receive(None)? else {
                break;
            };
            self.statistics.skipped += u64::from(is_message);
        }
        Ok(())
    }

    /// Answers every message without moving the arm until commanding is active and the arm accepts commands; returns the time of the first such
    /// message, s.
    ///
    /// # Errors
    /// As [`wait_for_message`](Self::wait_for_message); commanding that does not begin within `timeout`, with the value that prevents it
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

    /// Receives one datagram: `Some(true)` for a new message, `None` if there is no datagram.
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

    /// One controller at a time; another one only after the first has fallen silent.
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
            // A controller that never sends positions gives no information about the arm.
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
        // After a silence the controller has restarted, whatever the sequence number.
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
                // Time continues from one session to the next, and never runs backwards.
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

    /// The newest message; an error if the controller has been silent for too long.
    pub(super) fn newest(&self) -> Result<&Newest, FriError> {
        let newest = self.newest.as_ref().ok_or(FriError::NoMessage)?;
        match self.is_silent() {
            true => Err(self.silent(Duration::ZERO)),
            false => Ok(newest),
        }
    }

    /// Is commanding active (true) or not begun (false)? An error if it has ended.
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

    /// Allows commands again after commanding has ended, as soon as it begins again.
    pub const fn begin_again(&mut self) {
        self.was_active = false;
        self.commanded.forget();
    }

    /// Delay of the arm on the requested path, because answers were lost or not given, s.
    #[must_use]
    pub fn behind_s(&self) -> f64 {
        self.commanded.behind_ns as f64 * 1e-9
    }

    pub(super) const fn velocity_rad_per_s(&self) -> &[f64; 7] {
        self.velocity.velocity_rad_per_s()
    }

    /// Time of the newest message since the first one, on the clock of the controller, s. Never decreases.
    #[must_use]
    pub fn t_s(&self) -> Option<f64> {
        let newest = self.newest.as_ref()?;
        Some(newest.time_ns as f64 * 1e-9)
    }

    /// The newest message, as received.
    #[must_use]
    pub fn message(&self) -> Option<&MonitorMessage> {
        self.newest.as_ref().map(|newest| &newest.message)
    }

    /// The state of the session.
    #[must_use]
    pub fn session_state(&self) -> Option<SessionState> {
        self.message().map(|message| message.connection.state)
    }

    /// The quality of the connection, as judged by the controller.
    #[must_use]
    pub fn quality(&self) -> Option<ConnectionQuality> {
        self.message().map(|message| message.connection.quality)
    }

    /// The value in the newest message that prevents commands, if any; known from shortly before commanding begins.
    #[must_use]
    pub fn unfit(&self) -> Option<Unfit> {
        let newest = self.newest.as_ref()?;
        let said_ms = newest.message.connection.send_period_ms;
        let period = said_ms.filter(|_| self.ran_ahead.is_wrong(newest.time_ns));
        let period = period.map(|said_ms| Unfit::Period { said_ms });
        unfit(&newest.message).or(period)
    }

    /// The command mode; known from shortly before commanding begins. A controller that reports no mode, or an unknown one, is assumed to accept
    /// positions.
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

    /// Where the controller's interpolator holds the arm, rad; known from shortly before commanding begins.
    ///
    /// A program that commands positions begins here. The measured angles differ by the servo error of the arm.
    #[must_use]
    pub fn interpolator(&self) -> Option<JointPositions> {
        let interpolator = self.message()?.interpolator?;
        interpolator.position_rad.map(JointPositions)
    }

    /// The controller that the client listens to.
    #[must_use]
    pub const fn controller(&self) -> Option<SocketAddr> {
        self.peer
    }

    /// The transport to the controller.
    #[must_use]
    pub const fn transport(&self) -> &T {
        &self.transport
    }

    /// The transport to the controller.
    pub const fn transport_mut(&mut self) -> &mut T {
        &mut self.transport
    }

    /// The statistics.
    #[must_use]
    pub const fn statistics(&self) -> &ClientStatistics {
        &self.statistics
    }
}

//! The client as an `Arm`: states and commands.

use super::asked_path::{MOST_BEHIND_NS, Sent};
use super::beginning::Beginning;
use super::braking::CommandedMotion;
use super::fri_client::FriClient;
use super::newest::answer_period_s;
use super::transport::Transport;
use crate::codec::{
    ClientCommandMode, CommandData, CommandMessage, DATAGRAM_BYTES, Datagram, Header,
};
use crate::error::FriError;
use crate::wrench::wrench_to_wire;
use hwall_haptics::{Arm, ArmCommand, ArmState};
use hwall_kinematics::{JointPositions, JointTorques, JointVelocities, Wrench};
use hwall_numeric::check::all_finite;

/// Longest time that a commanded step may span, s: older positions do not show how fast a command moves.
const LONGEST_STEP_S: f64 = 0.05;
/// The first positions after torques may be this far from the arm's position, rad: a push may have displaced a soft arm. A larger step is refused as
/// a jump.
const LEAD_RAD: f64 = 0.2;
/// An arm without a command for this long, and for more than five answer periods, counts as standing, ns: two time constants of a 40 rad/s servo.
const STANDS_NS: u64 = 50_000_000;

impl<T: Transport> FriClient<T> {
    /// In mode wrench: commands a wrench at the tool, along the axes of the tool, in addition to the springs that hold the arm where commanding
    /// began.
    ///
    /// # Errors
    /// As [`Arm::command`].
    pub fn command_wrench(&mut self, wrench: &Wrench) -> Result<(), FriError> {
        if !self.begin_command()? {
            return self.mirror();
        }
        if let Err(error) = all_finite("wrench", &wrench.to_array()) {
            return self.refuse(error.into());
        }
        match self.command_mode() {
            ClientCommandMode::Wrench => self.wrench(wrench),
            mode => self.refuse(FriError::OtherMode {
                asked: "a wrench",
                mode,
            }),
        }
    }

    /// Answers the newest message without moving the arm: with the positions of the interpolator, zero torques, no wrench.
    ///
    /// # Errors
    /// A network error; no message to answer.
    pub fn mirror(&mut self) -> Result<(), FriError> {
        let newest = self.newest.as_ref().ok_or(FriError::NoMessage)?;
        let interpolator = newest.message.interpolator.and_then(|i| i.position_rad);
        let data = newest.message.data.unwrap_or_default();
        let q_rad = interpolator
            .or(data.commanded_position_rad)
            .unwrap_or(newest.q_rad);
        let mode = self.command_mode();
        self.commanded.motion_ns = newest.time_ns;
        self.commanded.forget();
        self.commanded.keep(CommandedMotion::at_rest(q_rad), None);
        self.answer(CommandData {
            position_rad: Some(q_rad),
            torque_n_m: (mode == ClientCommandMode::Torque).then_some([0.0; 7]),
            wrench: (mode == ClientCommandMode::Wrench).then_some([0.0; 6]),
            ..CommandData::default()
        })
    }

    /// Sends an answer to the newest message, if one is due.
    pub(super) fn answer(&mut self, data: CommandData) -> Result<(), FriError> {
        let (Some(newest), Some(peer)) = (&self.newest, self.peer) else {
            return Err(FriError::NoMessage);
        };
        if !std::mem::take(&mut self.owes) {
            return Ok(());
        }
        let message = CommandMessage {
            header: Header {
                sequence: self.sequence,
                reflected_sequence: newest.message.header.sequence,
            },
            data: Some(data),
        };
        self.since_answer = 0;
        if let Some(motion) = self.commanded.motion {
            let sent = Sent {
                motion,
                path_ns: self.commanded.path_ns,
                time_ns: newest.time_ns,
            };
            self.commanded.answers.push(self.sequence, sent);
        }
        let mut datagram: Datagram = [0; DATAGRAM_BYTES];
        let length = self.codec.encode_command(&message, &mut datagram)?;
        self.sequence = self.sequence.wrapping_add(1);
        let bytes = datagram.get(..length).unwrap_or(&[]);
        if let Err(error) = self.transport.send(bytes, peer) {
            self.statistics.unanswered += 1;
            return Err(FriError::NotSent { kind: error.kind() });
        }
        self.statistics.answered += 1;
        Ok(())
    }

    /// The arm brakes instead of executing a refused command, so that the controller gets an answer.
    pub(super) fn refuse(&mut self, error: FriError) -> Result<(), FriError> {
        self.statistics.refused += 1;
        self.stand()?;
        Err(error)
    }

    /// Are commands accepted now? Otherwise the answer is a mirror.
    fn begin_command(&mut self) -> Result<bool, FriError> {
        match self.is_active() {
            Ok(true) => match self.unfit() {
                None => Ok(true),
                Some(unfit) => self.refuse(unfit.into()).map(|()| false),
            },
            Ok(false) => {
                self.statistics.not_in_force += 1;
                Ok(false)
            }
            Err(ended @ FriError::CommandingEnded { .. }) => {
                // Keep the connection, so that commanding can begin again.
                self.mirror()?;
                Err(ended)
            }
            Err(error) => Err(error),
        }
    }

    fn wrench(&mut self, wrench: &Wrench) -> Result<(), FriError> {
        let q_rad = self.interpolator_rad()?;
        self.answer(CommandData {
            position_rad: Some(q_rad),
            wrench: Some(wrench_to_wire(wrench)),
            ..CommandData::default()
        })
    }

    fn position(&mut self, q_rad: [f64; 7]) -> Result<(), FriError> {
        if let Err(error) = all_finite("commanded position", &q_rad) {
            return self.refuse(error.into());
        }
        let last = self.last_motion()?;
        let (period_s, since_s) = self.times_s()?;
        let time_ns = self.newest()?.time_ns;
        let leads = self.commanded.leads && self.is_near(&q_rad)?;
        // After other commands than positions the arm may stand slightly away from the commanded position.
        let resumes = self.commanded.asked_rad.is_none() && !leads;
        let beginning = match self.commanded.beginning {
            Some(begun) if !resumes || goes_on(&last, &begun.lead(&q_rad, time_ns), period_s) => {
                Some(begun)
            }
            _ => Beginning::of(&last.q_rad, &q_rad, time_ns),
        };
        // A step is measured from the previously requested position, which the arm may still be moving to.
        let before_rad = match self.commanded.asked_rad {
            _ if leads || (resumes && beginning.is_some()) => q_rad,
            Some(asked_rad) => asked_rad,
            None => last.q_rad,
        };
        if let Err(violation) = self.limits.check_step(&before_rad, &q_rad, since_s) {
            return self.refuse(violation.into());
        }
        if self.is_answered()? {
            return Ok(());
        }
        let begun_rad = beginning.map_or(q_rad, |begun| begun.lead(&q_rad, time_ns));
        self.commanded.path.push(time_ns, begun_rad);
        let held = Sent {
            motion: last,
            ..self.held()?
        };
        let period_ns = (period_s * 1e9).round() as u64;
        let most = &self.config.braking_rad_per_s2;
        let (path_ns, path_rad) = self
            .commanded
            .path
            .next(&held, period_ns, &self.limits, most);
        self.commanded.behind_ns = time_ns.saturating_sub(path_ns);
        self.statistics.note_behind(self.commanded.behind_ns);
        if self.commanded.behind_ns > MOST_BEHIND_NS {
            let behind_s = self.behind_s();
            return self.refuse(FriError::Behind { behind_s });
        }
        let sent_rad = self.limits.led(&last.q_rad, &path_rad, period_s);
        let next = match leads {
            false => last.moved_to(sent_rad, period_s),
            // The arm does not move like the positions that catch up with it.
            true => CommandedMotion {
                q_rad: sent_rad,
                ..CommandedMotion::at_rest(self.commanded.asked_rad.unwrap_or(q_rad))
                    .moved_to(q_rad, since_s)
            },
        };
        if !leads && let Err(violation) = self.limits.check_change(&last, &next, most, period_s) {
            return self.refuse(violation.into());
        }
        self.commanded.beginning = beginning;
        self.commanded.asked_rad = Some(q_rad);
        self.commanded.leads = leads && sent_rad != path_rad;
        self.send_motion(next, Some(path_ns))
    }

    /// Could a pushed arm have come from there?
    fn is_near(&self, q_rad: &[f64; 7]) -> Result<bool, FriError> {
        let measured_rad = &self.newest()?.q_rad;
        let mut off_rad = q_rad.iter().zip(measured_rad).map(|(a, b)| (a - b).abs());
        Ok(off_rad.all(|off_rad| off_rad <= LEAD_RAD))
    }

    /// The motion that the controller holds, as far as it has reported.
    fn last_motion(&self) -> Result<CommandedMotion, FriError> {
        Ok(self.held()?.motion)
    }

    fn held(&self) -> Result<Sent, FriError> {
        let newest = self.newest()?;
        let reflected = newest.message.header.reflected_sequence;
        let is_commanded = self.commanded.motion.is_some();
        let held = is_commanded.then(|| self.commanded.answers.held(reflected));
        let mut held = held.flatten().unwrap_or(Sent {
            motion: match self.commanded.motion {
                Some(motion) => motion,
                None => CommandedMotion::at_rest(newest.held_rad()),
            },
            path_ns: None,
            time_ns: newest.time_ns,
        });
        let period_ns = (answer_period_s(&newest.message) * 1e9) as u64;
        if newest.time_ns.saturating_sub(held.time_ns) > STANDS_NS.max(5 * period_ns) {
            held.motion = CommandedMotion::at_rest(held.motion.q_rad);
        }
        Ok(held)
    }

    /// Time between two answers, s, and time since the last command, s, at least as long.
    fn times_s(&self) -> Result<(f64, f64), FriError> {
        let newest = self.newest()?;
        let period_s = answer_period_s(&newest.message);
        let since_s = newest.time_ns.saturating_sub(self.commanded.motion_ns) as f64 * 1e-9;
        let since_s = match self.commanded.motion {
            Some(_) => since_s.clamp(period_s, LONGEST_STEP_S.max(period_s)),
            None => period_s,
        };
        Ok((period_s, since_s))
    }

    /// Has this message been answered? No time has passed since: the arm is no further than commanded.
    fn is_answered(&self) -> Result<bool, FriError> {
        let time_ns = self.newest()?.time_ns;
        Ok(!self.owes && self.commanded.motion.is_some() && time_ns == self.commanded.motion_ns)
    }

    fn send_motion(
        &mut self,
        motion: CommandedMotion,
        path_ns: Option<u64>,
    ) -> Result<(), FriError> {
        if self.is_answered()? {
            return Ok(());
        }
        let time_ns = self.newest()?.time_ns;
        let torques = self.command_mode() == ClientCommandMode::Torque;
        self.commanded.motion_ns = time_ns;
        self.commanded.keep(motion, path_ns);
        self.answer(CommandData {
            position_rad: Some(motion.q_rad),
            torque_n_m: torques.then_some([0.0; 7]),
            ..CommandData::default()
        })
    }

    fn torque(&mut self, torque_n_m: [f64; 7]) -> Result<(), FriError> {
        if let Err(error) = all_finite("commanded torque", &torque_n_m) {
            return self.refuse(error.into());
        }
        if let Err(violation) = self.limits.check_torque(&torque_n_m) {
            return self.refuse(violation.into());
        }
        let newest = self.newest()?;
        let (measured, time_ns) = (newest.q_rad, newest.time_ns);
        // The arm may lag behind the previous commands: jumping to the measured position would end commanding.
        let (last, (period_s, _)) = (self.last_motion()?, self.times_s()?);
        let q_rad = self.limits.led(&last.q_rad, &measured, period_s);
        self.commanded.leads = true;
        self.commanded.beginning = Some(Beginning::NOWHERE_ELSE);
        self.commanded.leave_path();
        self.commanded.motion_ns = time_ns;
        self.commanded.keep(CommandedMotion::at_rest(q_rad), None);
        self.answer(CommandData {
            position_rad: Some(q_rad),
            torque_n_m: Some(torque_n_m),
            ..CommandData::default()
        })
    }

    /// Brakes with a command that the controller accepts.
    pub(super) fn stand(&mut self) -> Result<(), FriError> {
        match self.command_mode() {
            ClientCommandMode::Wrench => self.wrench(&Wrench::default()),
            _ => self.hold(),
        }
    }

    fn hold(&mut self) -> Result<(), FriError> {
        let (last, (period_s, _)) = (self.last_motion()?, self.times_s()?);
        let braked = last.braked(&self.config.braking_rad_per_s2, period_s);
        if !self.is_answered()? {
            self.commanded.leave_path();
        }
        // At a range limit the arm stops harder than it would brake.
        let motion = CommandedMotion {
            q_rad: self.limits.clamped(&braked.q_rad),
            ..braked
        };
        self.send_motion(motion, None)
    }

    pub(super) fn interpolator_rad(&self) -> Result<[f64; 7], FriError> {
        let newest = self.newest()?;
        let interpolator = newest.message.interpolator.and_then(|i| i.position_rad);
        Ok(interpolator.unwrap_or(newest.q_rad))
    }
}

/// Does moving to these positions change the speed less than stopping would?
fn goes_on(last: &CommandedMotion, q_rad: &[f64; 7], period_s: f64) -> bool {
    let before = &last.speed_rad_per_s;
    let most = before.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let next = last.moved_to(*q_rad, period_s).speed_rad_per_s;
    // NaN does not continue the motion.
    (next.iter().zip(before)).all(|(next, before)| (next - before).abs() <= most)
}

impl<T: Transport> Arm for FriClient<T> {
    type Error = FriError;

    /// The newest state, including messages that arrived meanwhile. Noise and delay are those of the controller.
    fn state(&mut self) -> Result<ArmState, FriError> {
        if !self.owes {
            self.take_waiting()?;
        }
        let newest = self.newest()?;
        let data = newest.message.data.unwrap_or_default();
        let state = ArmState {
            t_s: self.t_s().ok_or(FriError::NoMessage)?,
            q: JointPositions(newest.q_rad),
            qd: JointVelocities(*self.velocity_rad_per_s()),
            external_torque: data.external_torque_n_m.map(JointTorques),
        };
        Ok(state)
    }

    fn is_transient(error: &FriError) -> bool {
        error.is_transient()
    }

    /// Answers the newest message; a second command for the same message has no effect. If a command is refused, the arm brakes.
    fn command(&mut self, command: ArmCommand) -> Result<(), FriError> {
        if !self.begin_command()? {
            return self.mirror();
        }
        let mode = self.command_mode();
        match (command, mode) {
            (ArmCommand::Position(q), ClientCommandMode::Position | ClientCommandMode::Torque) => {
                self.position(q.0)
            }
            (ArmCommand::Torque(torque), ClientCommandMode::Torque) => self.torque(torque.0),
            (ArmCommand::Hold, _) => self.stand(),
            (ArmCommand::Torque(_), _) => self.refuse(FriError::OtherMode {
                asked: "torque",
                mode,
            }),
            _ => self.refuse(FriError::OtherMode {
                asked: "position",
                mode,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{CommandedMotion, goes_on};

    #[test]
    fn a_motion_goes_on_unless_it_leaps_or_is_nan() {
        let motion = CommandedMotion::at_rest([0.0; 7]).moved_to([1e-3; 7], 1e-3);
        assert!(goes_on(&motion, &[2e-3; 7], 1e-3));
        assert!(!goes_on(&motion, &[4e-3; 7], 1e-3));
        let mut one_is_nan = [2e-3; 7];
        one_is_nan[3] = f64::NAN;
        assert!(!goes_on(&motion, &one_is_nan, 1e-3));
        let from_nan = CommandedMotion {
            q_rad: one_is_nan,
            ..motion
        };
        assert!(!goes_on(&from_nan, &[2e-3; 7], 1e-3));
        for period_s in [0.0, f64::NAN] {
            assert!(!goes_on(&motion, &motion.q_rad, period_s), "{period_s}");
        }
    }
}

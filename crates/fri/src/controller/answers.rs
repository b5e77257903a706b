//! The client's answers, and whether they are in time.

use super::faults::Delay;
use super::machine::Controller;
use super::plant::SimulatedPlant;
use super::report::EventKind;
use super::wanted::{LateAnswer, Wanted, cycles_between};
use crate::codec::{ClientCommandMode, CommandMessage, SessionState};
use crate::error::FriError;
use crate::wrench::wrench_from_wire;
use hwall_numeric::check::all_finite;

impl<P: SimulatedPlant> Controller<P> {
    /// Takes a datagram of the client. Any error is counted.
    pub fn receive(&mut self, datagram: &[u8]) {
        if self.faults.is_deaf() {
            self.statistics.not_arrived += 1;
            return;
        }
        match self.codec.decode_command(datagram) {
            Ok(message) => match self.faults.delay() {
                Some(Delay { cycles, is_used }) if self.late.is_none() => {
                    let due = self.cycles + u64::from(cycles);
                    self.late = Some(LateAnswer {
                        message,
                        due,
                        is_used,
                    });
                }
                _ => self.take_answer(&message),
            },
            Err(error) => {
                self.statistics.malformed += 1;
                self.refusal = Some(error);
            }
        }
    }

    fn take_answer(&mut self, message: &CommandMessage) {
        let answers = message.header.reflected_sequence;
        let age = self.sequence.wrapping_sub(answers);
        if self.counted == 0 || age >= self.config.receive_multiplier {
            self.statistics.late += 1;
            // Too late to be used, but acknowledged all the same.
            if self.is_newest(message) {
                self.client_sequence = message.header.sequence;
            }
            return;
        }
        if self.last_answered == Some(answers) {
            self.statistics.repeated += 1;
            return;
        }
        self.last_answered = Some(answers);
        self.client_sequence = message.header.sequence;
        self.answered = true;
        if self.state >= SessionState::CommandingWait {
            match self.wanted(message) {
                Ok(Some(wanted)) => self.incoming = Some(wanted),
                Ok(None) => self.statistics.incomplete += 1,
                Err(error) => {
                    self.statistics.non_finite += 1;
                    self.refusal = Some(error);
                }
            }
        }
    }

    /// Takes the held-back answer, unless a newer one overtook it.
    pub(super) fn take_late(&mut self) {
        let Some(late) = self.late.take_if(|late| late.due <= self.cycles) else {
            return;
        };
        let is_newest = self.is_newest(&late.message);
        self.take_answer(&late.message);
        if is_newest && late.is_used && self.state >= SessionState::CommandingWait {
            self.incoming = self.wanted(&late.message).ok().flatten();
        }
    }

    const fn is_newest(&self, message: &CommandMessage) -> bool {
        cycles_between(self.client_sequence, message.header.sequence) > 0.0
    }

    /// The part of a command that the mode needs; `None` if it is missing.
    fn wanted(&self, message: &CommandMessage) -> Result<Option<Wanted>, FriError> {
        let data = message.data.unwrap_or_default();
        let Some(position_rad) = data.position_rad else {
            return Ok(None);
        };
        let (mut torque_n_m, mut wrench) = ([0.0; 7], [0.0; 6]);
        match self.config.mode {
            ClientCommandMode::Torque => match data.torque_n_m {
                Some(torque) => torque_n_m = torque,
                None => return Ok(None),
            },
            ClientCommandMode::Wrench => match data.wrench {
                Some(given) => wrench = given,
                None => return Ok(None),
            },
            _ => {}
        }
        all_finite("commanded position", &position_rad)?;
        all_finite("commanded torque", &torque_n_m)?;
        all_finite("commanded wrench", &wrench)?;
        Ok(Some(Wanted {
            answers: message.header.reflected_sequence,
            position_rad,
            torque_n_m,
            wrench: wrench_from_wire(&wrench),
        }))
    }

    /// Closes the window of an expected answer, if the next message expects one.
    pub(super) fn judge_answers(&mut self) {
        let multiplier = u64::from(self.config.receive_multiplier);
        if self.counted == 0 || !self.counted.is_multiple_of(multiplier) {
            return;
        }
        let answered = std::mem::take(&mut self.answered);
        self.window.push(answered);
        self.statistics.expected += 1;
        if answered {
            self.statistics.in_time += 1;
            self.misses = 0;
        } else {
            self.statistics.missed += 1;
            self.misses += 1;
            self.statistics.longest_miss = self.statistics.longest_miss.max(self.misses);
        }
        let (from, to) = (self.quality, self.faults.said(self.window.quality()));
        if from != to {
            self.quality = to;
            self.say(EventKind::Quality { from, to });
        }
    }
}

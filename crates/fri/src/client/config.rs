//! Settings and statistics of a client.

use super::asked_path::Arrival;
use crate::codec::FriVersion;
use crate::error::FriError;
use hwall_motion::IIWA7_ACCELERATION_RAD_PER_S2;
use hwall_numeric::check::{each, non_negative, positive, within};
use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

/// Settings of a [`FriClient`](super::FriClient).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FriClientConfig {
    /// Address to listen on; default 127.0.0.1:30200, which only this machine reaches. For a real controller: the address of the connected interface,
    /// or 0.0.0.0 for all, with the controller's own address in [`controller`](Self::controller); it uses ports 30200 to 30209.
    pub listen: SocketAddr,
    /// Only messages of this controller are accepted; others are counted ([`ClientStatistics::foreign`]) and dropped. `None`, the default: the first
    /// sender is accepted.
    pub controller: Option<IpAddr>,
    /// Version of the interface; default 1.15.
    pub version: FriVersion,
    /// After this time without a message the connection counts as lost, s; default 0.5.
    pub silence_s: f64,
    /// Corner frequency of the velocity filter, Hz, at most 1000; default 50. See [`FriClient`](super::FriClient).
    pub velocity_hz: f64,
    /// Largest commanded torques, N m; default 176, 176, 110, 110, 110, 40, 40, those of the iiwa 7's joints.
    pub max_torque_n_m: [f64; 7],
    /// Decelerations to rest, rad/s²: for `Hold` while positions are commanded. Default those of the iiwa 7.
    pub braking_rad_per_s2: [f64; 7],
}

impl Default for FriClientConfig {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 30200)),
            controller: None,
            version: FriVersion::V1_15,
            silence_s: 0.5,
            velocity_hz: 50.0,
            max_torque_n_m: [176.0, 176.0, 110.0, 110.0, 110.0, 40.0, 40.0],
            braking_rad_per_s2: IIWA7_ACCELERATION_RAD_PER_S2,
        }
    }
}

impl FriClientConfig {
    pub(super) fn validate(&self) -> Result<(), FriError> {
        within("silence_s", self.silence_s, ..=1e6, "at most 1e6")?;
        positive("silence_s", self.silence_s)?;
        within("velocity_hz", self.velocity_hz, ..=1000.0, "at most 1000")?;
        positive("velocity_hz", self.velocity_hz)?;
        each(non_negative, "max_torque_n_m", &self.max_torque_n_m)?;
        each(positive, "braking_rad_per_s2", &self.braking_rad_per_s2)?;
        Ok(())
    }
}

/// Statistics of a client.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ClientStatistics {
    /// Messages of the controller that were accepted.
    pub received: u64,
    /// Answers sent.
    pub answered: u64,
    /// Messages that expected an answer and got none: the program was too slow or gave no command.
    pub unanswered: u64,
    /// Messages that reported a missing answer: the arm held its position.
    pub not_arrived: u64,
    /// Messages that acknowledged an answer, but not the newest: it reached the controller after its next message.
    pub late: u64,
    /// Most consecutive answers that had not arrived.
    pub longest_gap: u64,
    /// Largest delay of the arm on the requested path, us.
    pub most_behind_us: u64,
    /// Messages that never came: gaps in the sequence.
    pub lost: u64,
    /// Messages that came after a newer one, or repeated it.
    pub stale: u64,
    /// Messages that were read only together with a newer one: the program was late.
    pub skipped: u64,
    /// Datagrams that are no controller message, or contain NaN.
    pub malformed: u64,
    /// Datagrams from other senders than the controller.
    pub foreign: u64,
    /// Commands refused.
    pub refused: u64,
    /// Commands given while the controller accepted none.
    pub not_in_force: u64,
    /// Sessions: how often the sequence restarted.
    pub sessions: u64,
}

impl ClientStatistics {
    pub(super) fn note_arrival(&mut self, Arrival { missing, is_late }: Arrival) {
        self.late += u64::from(is_late);
        self.not_arrived += u64::from(missing > 0);
        self.longest_gap = self.longest_gap.max(missing.into());
    }

    pub(super) fn note_behind(&mut self, behind_ns: u64) {
        self.most_behind_us = self.most_behind_us.max(behind_ns / 1000);
    }
}

impl fmt::Display for ClientStatistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} messages of the controller in {} sessions: {} answered, {} not answered in time, {} read too late",
            self.received, self.sessions, self.answered, self.unanswered, self.skipped
        )?;
        writeln!(
            f,
            "on the way: {} lost, {} overtaken or repeated, {} malformed, {} from others",
            self.lost, self.stale, self.malformed, self.foreign
        )?;
        writeln!(
            f,
            "answers sent that did not reach the controller: {}, {} in a row at most; after its next message: {}; the arm was up to {:.1} ms behind",
            self.not_arrived,
            self.longest_gap,
            self.late,
            self.most_behind_us as f64 * 1e-3
        )?;
        write!(
            f,
            "commands refused: {}; given while the controller took none: {}",
            self.refused, self.not_in_force
        )
    }
}

//! Parses versions and command modes from text and from datagrams.

use super::states::ClientCommandMode;
use super::version::FriVersion;
use super::{frame, monitor};
use crate::error::FriError;
use std::str::FromStr;

impl FriVersion {
    /// The apparent version of a controller's datagram. `None`: no version, or nothing that distinguishes 1.x from 2.x.
    #[must_use]
    pub fn of_datagram(datagram: &[u8]) -> Option<Self> {
        let framed = frame::open(datagram).ok();
        if framed.is_some_and(|message| monitor::read(message, Self::V2_7).is_ok()) {
            return Some(Self::V2_7);
        }
        let state = |version| monitor::read(datagram, version).ok()?.data;
        let commanded = state(Self::V1_15).is_some_and(|s| s.commanded_position_rad.is_some());
        let pose = state(Self::V2_5).is_some_and(|s| s.pose.is_some() || s.redundancy.is_some());
        match (commanded, pose) {
            (true, false) => Some(Self::V1_15),
            (false, true) => Some(Self::V2_5),
            _ => None,
        }
    }
}

impl FromStr for FriVersion {
    type Err = FriError;

    fn from_str(text: &str) -> Result<Self, FriError> {
        let same = |version: &Self| version.to_string() == text;
        Self::ALL
            .into_iter()
            .find(same)
            .ok_or_else(|| FriError::UnknownVersion(text.to_owned()))
    }
}

impl FromStr for ClientCommandMode {
    type Err = FriError;

    /// From the protocol name, ignoring case.
    fn from_str(text: &str) -> Result<Self, FriError> {
        let same = |mode: &&Self| mode.to_string().eq_ignore_ascii_case(text);
        let mode = Self::ALL.iter().find(same).copied();
        mode.ok_or_else(|| FriError::UnknownMode(text.to_owned()))
    }
}

//! A build without TLS.

use super::Certificate;
use crate::error::BridgeError;
use std::io;
use std::net::SocketAddr;

/// Has no value in this build.
pub(crate) enum Security {}

/// Has no value in this build.
pub(crate) enum Session {}

impl Security {
    pub(crate) fn open(_: &Certificate) -> Result<Self, BridgeError> {
        Err(BridgeError::NoTls)
    }

    pub(crate) fn session(&self) -> io::Result<Session> {
        match *self {}
    }

    pub(crate) fn fingerprint(&self) -> &str {
        match *self {}
    }

    pub(crate) fn names(&self) -> Vec<String> {
        match *self {}
    }

    pub(crate) fn is_self_signed(&self) -> bool {
        match *self {}
    }
}

impl Session {
    pub(crate) fn is_handshaking(&self) -> bool {
        match *self {}
    }

    pub(crate) fn has_to_send(&self) -> bool {
        match *self {}
    }

    pub(crate) fn end(&self) {
        match *self {}
    }

    pub(crate) fn take(&self, _: &[u8]) -> io::Result<()> {
        match *self {}
    }

    pub(crate) fn opened(&self, _: &mut [u8]) -> io::Result<Option<usize>> {
        match *self {}
    }

    pub(crate) fn sealed(&self, _: &[u8]) -> io::Result<Vec<u8>> {
        match *self {}
    }
}

/// The address to open.
pub(crate) fn invitation(
    url: &str,
    _: &str,
    security: Option<&Security>,
    _: SocketAddr,
    _: &[String],
) -> String {
    match security {
        None => format!("open {url}"),
        Some(security) => match *security {},
    }
}

//! Errors of starting a bridge, and of received datagrams.

use hwall::numeric::ArgumentError;
use std::net::SocketAddr;

/// A bridge that cannot be started, or an invalid datagram.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BridgeError {
    /// The server cannot listen on the address.
    #[error("cannot listen on {address}; another address may be free")]
    Listen {
        /// The requested address.
        address: SocketAddr,
        /// The cause.
        source: std::io::Error,
    },
    /// A thread could not be started, or a socket could not be set up.
    #[error("cannot set up the server: {0}")]
    Setup(#[from] std::io::Error),
    /// A setting outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A datagram that does not have the length of five numbers.
    #[error("a datagram of {bytes} bytes, expected 20")]
    DatagramLength {
        /// Its length.
        bytes: usize,
    },
    /// A roughness code that is not a whole number of two digits.
    #[error("roughness code {code}, expected a whole number from 0 to 99")]
    RoughnessCode {
        /// The received code.
        code: f64,
    },
}

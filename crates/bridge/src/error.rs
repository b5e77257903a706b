//! What can go wrong before a bridge runs, or with what others send it.

use hwall::numeric::ArgumentError;
use std::net::SocketAddr;

/// A bridge that cannot be started, or a datagram that makes no sense.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BridgeError {
    /// The address cannot be listened on.
    #[error("cannot listen on {address}; another address may be free")]
    Listen {
        /// The address asked for.
        address: SocketAddr,
        /// Why.
        source: std::io::Error,
    },
    /// A thread could not be started, or a socket not be set up.
    #[error("cannot set up the server: {0}")]
    Setup(#[from] std::io::Error),
    /// A setting outside its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// A datagram of another length than five numbers.
    #[error("a datagram of {bytes} bytes, expected 20")]
    DatagramLength {
        /// Its length.
        bytes: usize,
    },
    /// A roughness code that is no whole number of two digits.
    #[error("roughness code {code}, expected a whole number from 0 to 99")]
    RoughnessCode {
        /// What came.
        code: f64,
    },
}

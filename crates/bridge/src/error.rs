//! Errors of starting a bridge, and of received datagrams.

use crate::calibration::CalibrationError;
use hwall::numeric::ArgumentError;
use std::net::SocketAddr;
use std::path::PathBuf;

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
    /// HTTPS was asked for, but this build has none.
    #[error(
        "this build has no TLS; build it with `cargo run --release --features tls --example bridge -- --tls`"
    )]
    NoTls,
    /// The processor lacks what the encryption is built on.
    #[error(
        "the encryption needs a processor with AES and AVX2 instructions (x86-64) or AES and SHA-2 (ARM); put a TLS proxy in front instead"
    )]
    Processor,
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The file is not a usable calibration.
    #[error("{}: {source}; delete the file, start again and calibrate", path.display())]
    Calibration {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: CalibrationError,
    },
    /// A certificate or a key is malformed, of an unknown kind, or the two do not belong together.
    #[error("{}: {reason}", path.display())]
    Certificate {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
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

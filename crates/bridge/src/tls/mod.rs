//! HTTPS, behind the feature `tls`. Without it, asking for HTTPS is an error.

#[cfg(not(feature = "tls"))]
mod absent;
#[cfg(feature = "tls")]
mod identity;
#[cfg(feature = "tls")]
mod invitation;
#[cfg(feature = "tls")]
mod made;
#[cfg(feature = "tls")]
mod security;

#[cfg(not(feature = "tls"))]
pub(crate) use absent::{Security, Session, invitation};
#[cfg(feature = "tls")]
pub(crate) use invitation::invitation;
#[cfg(feature = "tls")]
pub(crate) use security::{Security, Session};

use std::path::PathBuf;

/// Where a server's certificate comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Certificate {
    /// A self-signed certificate for this host, stored with its key in this file; made at the first start. Browsers ask once whether to
    /// accept it.
    SelfSigned(PathBuf),
    /// Your own: a chain, the server's certificate first, and its key. Both as PEM.
    Own {
        /// The chain.
        certificates: PathBuf,
        /// The key: PKCS #8, PKCS #1 or SEC 1.
        key: PathBuf,
    },
}

#[cfg(feature = "tls")]
impl Certificate {
    /// The file with the key.
    pub(crate) fn key_path(&self) -> &std::path::Path {
        match self {
            Self::SelfSigned(path) => path,
            Self::Own { key, .. } => key,
        }
    }
}

//! Settings of a bridge.

use crate::error::BridgeError;
use crate::hands::Side;
use crate::tls::Certificate;
use hwall::geometry::Pose;
use hwall::numeric::check::{positive, that};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

/// Which hand the board serves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FollowedHand {
    /// The hand that is seen first; the other hand after the first one was not seen for [`BridgeConfig::lost_after_s`]. For cameras that
    /// see one hand at a time: if two are seen, the second is not followed.
    Either,
    /// The left hand.
    Left,
    /// The right hand; a mouse counts as one.
    #[default]
    Right,
}

impl FollowedHand {
    /// The hand that touches the corners of the board.
    pub(crate) const fn calibrates(self) -> Side {
        match self {
            Self::Left => Side::Left,
            Self::Right | Self::Either => Side::Right,
        }
    }
}

/// Settings of a [`BridgeServer`](crate::BridgeServer).
#[derive(Debug, Clone, PartialEq)]
pub struct BridgeConfig {
    /// Address to listen on. Default 127.0.0.1:8080, for this machine only; port 0 takes a free one. At other addresses, and with
    /// [`hosts`](Self::hosts), clients need a key, see [`BridgeServer::url`](crate::BridgeServer::url).
    pub listen: SocketAddr,
    /// Names other than this machine's that a browser may use for the server, without a port, such as those of a proxy. Numeric addresses
    /// and `localhost` are always allowed. Default none.
    pub hosts: Vec<String>,
    /// Serves HTTPS with this certificate; default plain HTTP. Needs the feature `tls`.
    pub certificate: Option<Certificate>,
    /// Origin of the headset's space (z up, after the change of axes) in the arm's base frame; default the base itself.
    pub base_from_headset: Pose,
    /// Keeps the calibration of the headset's space in this file. The arm then stands until the space is calibrated, and after a start until two
    /// touches have checked it. A calibration is of one headset and supersedes `base_from_headset`. Default none.
    pub calibration: Option<PathBuf>,
    /// Which hand is followed; default the right one.
    pub hand: FollowedHand,
    /// Most clients at a time; default 8.
    pub max_clients: usize,
    /// Longest message, bytes; default 65536.
    pub max_message_bytes: usize,
    /// Samples older than this are dropped, s; default 0.15.
    pub max_age_s: f64,
    /// The hand counts as lost if no sample comes for this long, s; default 0.15.
    pub lost_after_s: f64,
    /// Another client may lead after the leading one has shown no hand for this long, s; default 1.
    pub takeover_s: f64,
    /// Most time for a request to arrive, s; default 5.
    pub request_s: f64,
    /// A client that sends nothing for this long is disconnected, s; default 15.
    pub silent_s: f64,
    /// Period of the view, s; default 1/60.
    pub view_period_s: f64,
    /// Period of the loop, s; default 1e-3.
    pub period_s: f64,
    /// A loop that is behind by more than this skips cycles, s; otherwise it catches up. Default 0.05.
    pub max_behind_s: f64,
}

impl Default for BridgeConfig {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 8080)),
            hosts: Vec::new(),
            certificate: None,
            base_from_headset: Pose::IDENTITY,
            calibration: None,
            hand: FollowedHand::Right,
            max_clients: 8,
            max_message_bytes: 65_536,
            max_age_s: 0.15,
            lost_after_s: 0.15,
            takeover_s: 1.0,
            request_s: 5.0,
            silent_s: 15.0,
            view_period_s: 1.0 / 60.0,
            period_s: 1e-3,
            max_behind_s: 0.05,
        }
    }
}

impl BridgeConfig {
    /// Rejects settings outside their range.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), BridgeError> {
        // Sockets accept no longer time-outs, and none of zero.
        for (what, value_s) in [
            ("max_age_s", self.max_age_s),
            ("lost_after_s", self.lost_after_s),
            ("takeover_s", self.takeover_s),
            ("request_s", self.request_s),
            ("silent_s", self.silent_s),
            ("view_period_s", self.view_period_s),
            ("period_s", self.period_s),
            ("max_behind_s", self.max_behind_s),
        ] {
            positive(what, value_s)?;
            let holds = (1e-4..=3600.0).contains(&value_s);
            that(holds, what, value_s, "in [1e-4, 3600] s")?;
        }
        let clients = self.max_clients;
        let holds = (1..=1000).contains(&clients);
        that(holds, "max_clients", clients as f64, "in 1..=1000")?;
        let bytes = self.max_message_bytes;
        let holds = (1024..=16_777_216).contains(&bytes);
        let wanted = "in 1024..=16777216";
        that(holds, "max_message_bytes", bytes as f64, wanted)?;
        Ok(())
    }
}

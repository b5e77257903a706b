#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod bridge;
mod calibration;
mod config;
mod counts;
mod error;
mod hands;
mod http;
mod locked;
mod pacing;
mod questions;
mod server;
mod tls;
mod unity;

// The server and its settings.
pub use calibration::{CHECK_BOUND_M, Calibration, CalibrationError, FIT_BOUND_M};
pub use config::{BridgeConfig, FollowedHand};
pub use counts::BridgeCounts;
pub use error::BridgeError;
pub use server::{BridgeServer, Order, Orders, StopHandle};
pub use tls::Certificate;

// The loop's side.
pub use bridge::{Bridge, ViewSender};
pub use hands::HandQueue;
pub use pacing::Pacing;

// A page of questions, for studies.
pub use questions::{Answering, Question, QuestionServer};

// The dissertation's datagram.
pub use unity::{BoardDatagram, RoughnessCode, UnityConfig, UnityReceiver, UnityTarget};

pub use hwall_view as view;

//! Hand-over between the halves of a session, on one thread or on two: neither half waits, and the newest value wins.

mod barriers;
mod felt;
mod guidance;
mod newest;
mod openings;
mod sequence_lock;

pub(super) use barriers::{BarrierReceiver, WorldBarriers};
pub(super) use felt::{Feeler, FeltTouches, felt_touches};
pub(super) use guidance::Guidance;
pub(super) use newest::{Receiver, Sender, handover};
pub(super) use openings::{OpeningReceiver, OpeningSender, openings};

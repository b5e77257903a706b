//! Input of hands: messages, clocks, the leading client, the queue to the loop.

mod clock;
mod intake;
mod joints;
mod message;
mod queue;
mod window;

pub use queue::HandQueue;

pub(crate) use intake::{ClientStream, HAND_QUEUE, Intake};
pub(crate) use message::{PageMessage, Side, seen};

//! A live session with a recorder.

use super::flags::LiveFlags;
use super::holds::{Holds, tell_left_out};
use crate::console::note;
use crate::recording::{self, SessionSource, run_of};
use crate::run::stage::SessionSettings;
use hwall::Cycle;
use hwall::contact::Predictor;
use hwall_bridge::{Bridge, Order, Orders};
use hwall_record::{Recorded, Recorder, RecorderConfig, Request};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Capacity of the message queue: a disk may stall for ten seconds without loss.
const CAPACITY: usize = 1 << 14;

/// Begins the requested recording. The loop never waits for it: messages that find the queue full are dropped and counted.
pub(super) fn begin(
    flags: &LiveFlags,
    source: &SessionSource<'_>,
    settings: &SessionSettings<'_>,
) -> anyhow::Result<Option<Recorder>> {
    let Some(path) = &flags.record else {
        return Ok(None);
    };
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let config = RecorderConfig {
        capacity: CAPACITY,
        epoch_ns: now.map_or(0, |now| u64::try_from(now.as_nanos()).unwrap_or(0)),
        ..RecorderConfig::default()
    };
    let mut recorder = recording::start(path, source, &config)?;
    recorder.begin(run_of(0, settings)?);
    Ok(Some(recorder))
}

/// Timeout of the enabling switch, which reports five times in this time while held.
const ENABLED: Duration = Duration::from_millis(250);

/// The person's request to the arm in this cycle. `switch`: the arm moves only while an enabling switch is held; releasing it or
/// losing its signal stops the arm. So does a headset's space that is not calibrated.
#[must_use]
pub fn asked(orders: &Orders, is_latched: bool, switch: bool) -> Option<Order> {
    let obstacle = if orders.is_uncalibrated() {
        Some(
            "the headset is not calibrated or its calibration not checked (the page says what to touch)",
        )
    } else if switch && !orders.is_enabled(ENABLED) {
        Some("nobody holds the enabling switch")
    } else {
        None
    };
    match (orders.take(), obstacle) {
        (Some(Order::LetGo), Some(obstacle)) => {
            note(format_args!("{obstacle}: the arm is not let go"));
            (!is_latched).then_some(Order::Stop)
        }
        (None, Some(_)) if !is_latched => Some(Order::Stop),
        (order, _) => order,
    }
}

/// At the end of a cycle: applies the person's [request](asked), prints holds, then sends events and views to the clients and
/// into the recording.
pub fn after<P: Predictor>(
    bridge: &mut Bridge,
    holds: &mut Holds,
    recorded: &mut Recorded<'_, P>,
    cycle: &Cycle,
    switch: bool,
) {
    let is_latched = recorded.session.control().is_latched();
    match asked(&bridge.view.orders(), is_latched, switch) {
        Some(Order::Stop) => recorded.request(Request::Stop),
        // Reset only a latch already reported, not one from this cycle.
        Some(Order::LetGo) if holds.is_latched() => recorded.request(Request::Reset),
        Some(Order::LetGo) | None => {}
    }
    let Recorded { session, recorder } = recorded;
    holds.see(cycle.t_s, session.state(), session.control().is_latched());
    holds.see_link(cycle.t_s, session.control().link_in_front());
    tell_left_out(session.control());
    if let Some(recorder) = recorder {
        while let Some(event) = session.next_event() {
            bridge.view.event(&event);
            recorder.event(&event);
        }
        recorder.view(session, cycle);
    }
    bridge.show(session, &cycle.state);
}

/// Ends a recording and prints what was written.
pub(super) fn finish(recorder: Option<Recorder>, flags: &LiveFlags) -> anyhow::Result<()> {
    if let (Some(recorder), Some(path)) = (recorder, &flags.record) {
        note(recording::finish(recorder, path)?);
    }
    Ok(())
}

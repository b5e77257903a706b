//! A live session with a recorder beside it.

use super::holds::Holds;
use super::preparation::{ARM_MINUS_TRACKER_S, LiveOptions, Prepared, SEES_HEAD, TEXTURED};
use crate::console::note;
use crate::person::predictors::TrainingPeople;
use crate::recording::{self, SessionSource};
use hwall::Cycle;
use hwall::contact::Predictor;
use hwall_bridge::{Bridge, Order};
use hwall_record::{Recorded, Recorder, RecorderConfig, Request};
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Messages that wait at most: a disc may stand still for ten seconds and nothing is left out.
const CAPACITY: usize = 1 << 14;

/// Begins the recording that the options ask for. The loop never waits for it: what finds no room is left out and counted.
pub(super) fn begin(
    prepared: &Prepared,
    options: &LiveOptions<'_>,
) -> anyhow::Result<Option<Recorder>> {
    let Some(path) = options.record else {
        return Ok(None);
    };
    let people = TrainingPeople::default();
    let source = SessionSource {
        scene: options.scene,
        arm: &"iiwa7".into(),
        board: &prepared.board,
        room: prepared.room.as_ref().map(|read| read.text.as_str()),
        base: prepared.base,
        textured: TEXTURED,
        level: options.level,
        predictor: prepared.leader,
        adapts: true,
        training_people: &people,
        likely_touches: &prepared.likely_touches,
    };
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let config = RecorderConfig {
        capacity: CAPACITY,
        epoch_ns: now.map_or(0, |now| u64::try_from(now.as_nanos()).unwrap_or(0)),
        ..RecorderConfig::default()
    };
    let perception = prepared.session.perception();
    let mut recorder = recording::start(path, &source, &prepared.arm, perception.scene(), &config)?;
    recorder.begin(recording::run_of(
        0,
        &prepared.filter,
        SEES_HEAD,
        ARM_MINUS_TRACKER_S,
    )?);
    Ok(Some(recorder))
}

/// A switch that is held says so five times in this time.
const ENABLED: Duration = Duration::from_millis(250);

/// What a person asked of the arm, and what the arm does about it. `switch`: it moves only while an enabling switch is held, and a switch
/// that is let go, or is heard of no more, stops it.
pub(super) fn obey<P: Predictor>(
    bridge: &Bridge,
    holds: &mut Holds,
    recorded: &mut Recorded<'_, P>,
    cycle: &Cycle,
    switch: bool,
) {
    let orders = bridge.view.orders();
    let is_enabled = !switch || orders.is_enabled(ENABLED);
    let is_latched = recorded.session.control().is_latched();
    if !is_enabled && !is_latched {
        recorded.request(Request::Stop);
    }
    match orders.take() {
        Some(Order::Stop) => recorded.request(Request::Stop),
        Some(Order::LetGo) if is_enabled => recorded.request(Request::Reset),
        Some(Order::LetGo) => note("nobody holds the enabling switch: the arm is not let go"),
        None => {}
    }
    let session = &recorded.session;
    holds.see(cycle.t_s, session.state(), session.control().is_latched());
}

/// At the end of a cycle: events and views to the clients, and into the recording.
pub(super) fn show<P: Predictor>(
    bridge: &mut Bridge,
    recorded: &mut Recorded<'_, P>,
    cycle: &Cycle,
) {
    let Recorded { session, recorder } = recorded;
    if let Some(recorder) = recorder {
        while let Some(event) = session.next_event() {
            bridge.view.event(&event);
            recorder.event(&event);
        }
        recorder.view(session, cycle);
    }
    bridge.show(session, &cycle.state);
}

/// Ends a recording and says what was written.
pub(super) fn finish(recorder: Option<Recorder>, path: Option<&Path>) -> anyhow::Result<()> {
    if let (Some(recorder), Some(path)) = (recorder, path) {
        note(recording::finish(recorder, path)?);
    }
    Ok(())
}

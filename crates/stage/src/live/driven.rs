//! A live session on an arm behind FRI, a real one or a simulated one.

use super::flags::LiveFlags;
use super::holds::{Holds, listen_to_console};
use super::preparation::Prepared;
use super::recorded;
use crate::console::{NotesApart, note};
use anyhow::{Context, bail};
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, ArmCommand};
use hwall::{Surroundings, drive};
use hwall_bridge::{Bridge, BridgeServer};
use hwall_fri::{FriClient, FriClientConfig, FriError};
use hwall_record::Recorded;
use hwall_view::ViewScene;
use std::time::{Duration, Instant};

/// A controller without messages for this long is reported as silent.
const SILENCE: Duration = Duration::from_millis(500);
/// After this long it counts as gone.
const GONE: Duration = Duration::from_secs(10);
/// Period at which waiting for a controller checks for a stop.
const LOOK: Duration = Duration::from_millis(200);
/// A controller that sends messages for this long without commanding is reported.
const BEGINS: Duration = Duration::from_secs(3);
/// Braking time at the end: from full speed the slowest joint, the second, stops within 0.32 s.
const BRAKING: Duration = Duration::from_millis(500);

/// The clock of an arm behind FRI, the hands of the bridge.
pub struct Driven {
    /// Hands, and views for the clients.
    pub bridge: Bridge,
    /// Time of the first commanding message while it is unanswered, s on the controller's clock.
    unanswered: Option<f64>,
    end_s: f64,
    /// Why the last command was refused.
    refused: Option<FriError>,
}

impl Driven {
    /// Runs from the first commanding message, at `begun_s`, until `end_s`, s on the controller's clock.
    #[must_use]
    pub const fn new(bridge: Bridge, begun_s: f64, end_s: f64) -> Self {
        Self {
            bridge,
            unanswered: Some(begun_s),
            end_s,
            refused: None,
        }
    }

    /// Time of the next message. Waits for a pausing controller, whose arm is at rest. `None`: the server stops.
    fn next_message(&self, arm: &mut FriClient) -> Result<Option<f64>, FriError> {
        let since = Instant::now();
        let mut told = false;
        loop {
            match arm.wait_for_message(LOOK) {
                Ok(now_s) => {
                    if told {
                        let waited_s = since.elapsed().as_secs_f64();
                        note(format_args!(
                            "{now_s:9.3} s  the controller speaks again after {waited_s:.1} s"
                        ));
                    }
                    return Ok(Some(now_s));
                }
                Err(FriError::Silent { .. }) if self.bridge.view.is_stopped() => return Ok(None),
                Err(FriError::Silent { .. }) if since.elapsed() < GONE => {
                    if !told && since.elapsed() >= SILENCE {
                        told = true;
                        note(format_args!(
                            "{:9.3} s  no sound message of the controller for {} s: waiting for it, {} s at most",
                            arm.t_s().unwrap_or(0.0),
                            SILENCE.as_secs_f64(),
                            GONE.as_secs()
                        ));
                    }
                }
                Err(error) => return Err(error),
            }
        }
    }
}

impl Surroundings<FriClient> for Driven {
    fn next_cycle(&mut self, arm: &mut FriClient) -> Result<Option<f64>, FriError> {
        if self.bridge.view.is_stopped() {
            return Ok(None);
        }
        let now_s = match self.unanswered.take() {
            Some(now_s) => now_s,
            None => match self.next_message(arm)? {
                Some(now_s) => now_s,
                None => return Ok(None),
            },
        };
        self.bridge.view.count_cycle(0);
        Ok((now_s < self.end_s).then_some(now_s))
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        self.bridge.hands.next_frame(now_s)
    }

    fn refused(&mut self, reason: &FriError) {
        self.refused = Some(reason.clone());
    }
}

/// Waits for a controller, then lets the clients' hands lead its arm until the server stops or time is up.
///
/// # Errors
/// A controller that is silent for 10 s; a recording that cannot be written.
pub(super) fn run_driven(
    server: &BridgeServer,
    prepared: Prepared,
    config: FriClientConfig,
    flags: &LiveFlags,
) -> anyhow::Result<()> {
    // Prepared before messages need answers, because it takes longer than a period.
    let scene = ViewScene::of("iiwa 7 over FRI", &prepared.session)?;
    let mut recorder = prepared.recorder;
    let session = prepared.session.plan_on_thread();
    let session = session.context("no thread for the planner")?;
    let session = session.perceive_on_thread();
    let mut session = session.context("no thread for the tracker's half")?;
    let mut client = FriClient::bind(session.control().arm(), config)?;
    let Some(begun_s) = commanding(server, &mut client, &config, flags.seconds)? else {
        note(client.statistics());
        return Ok(());
    };
    note(format_args!("{begun_s:9.3} s  commanding begins"));
    let end_s = flags.seconds.map_or(f64::INFINITY, |s| begun_s + s);
    let bridge = server.connect(&scene);
    session.perception_mut().explain_to(&bridge.explanations);
    let mut surroundings = Driven::new(bridge, begun_s, end_s);
    let mut holds = Holds::default();
    let notes = NotesApart::begin();
    listen_to_console(&surroundings.bridge.view);
    let mut recorded = Recorded {
        session,
        recorder: recorder.as_mut(),
    };
    let ended = drive(
        &mut recorded,
        &mut client,
        &mut surroundings,
        |recorded,
         _,
         Driven {
             bridge, refused, ..
         },
         cycle| {
            if let Some(cause) = refused.take() {
                holds.refused(&cause);
            }
            recorded::after(bridge, &mut holds, recorded, cycle, flags.enabling_switch);
            Ok(())
        },
    );
    brake(&mut client);
    drop(notes);
    holds.finish();
    note(client.statistics());
    let finished = recorded::finish(recorder, flags);
    ended.context("the arm behind FRI")?;
    finished
}

/// Waits until the controller accepts commands, and reports on the console what it waits for. Returns that time, s on the
/// controller's clock; `None`: the server was stopped.
fn commanding(
    server: &BridgeServer,
    client: &mut FriClient,
    config: &FriClientConfig,
    seconds: Option<f64>,
) -> anyhow::Result<Option<f64>> {
    let who = match config.controller {
        Some(named) => format!("the FRI controller {named}"),
        None => "an FRI controller".to_owned(),
    };
    let waiting = format!("waiting for {who} at {}", config.listen);
    server.prepare(&waiting);
    note(&waiting);
    if config.controller.is_none() && !config.listen.ip().is_loopback() {
        note("whoever sends first leads; --fri-controller names the one that may");
    }
    let since = Instant::now();
    let (mut told, mut told_version, mut told_unfit) = (false, false, None);
    let mut speaks_since = None;
    loop {
        let error = match client.wait_for_commanding(LOOK) {
            Ok(begun_s) => return Ok(Some(begun_s)),
            Err(error @ (FriError::Silent { .. } | FriError::Unfit(_))) => error,
            Err(error) => bail!(error),
        };
        if server.is_stopped() {
            return Ok(None);
        }
        if let FriError::Unfit(unfit) = error
            && told_unfit.replace(unfit) != Some(unfit)
        {
            note(format_args!("the arm takes no commands yet: {unfit}"));
        }
        if let Some(seconds) = seconds.filter(|s| since.elapsed().as_secs_f64() >= *s) {
            bail!("no FRI controller reached commanding within {seconds} s");
        }
        let statistics = client.statistics();
        if let (false, Some(state), Some(quality)) =
            (told, client.session_state(), client.quality())
            && speaks_since.get_or_insert_with(Instant::now).elapsed() > BEGINS
        {
            told = true;
            let unanswered = statistics.unanswered + statistics.not_arrived;
            let (received, late) = (statistics.received, statistics.late);
            let why = match 2 * late > received {
                true => format!(
                    "{late} of {received} answers reach it after its next message; choose a longer send period in its \
                     application, or a faster network"
                ),
                false => format!(
                    "{unanswered} of {received} messages got no answer in time; start the motion of its application, \
                     or look at the network"
                ),
            };
            note(format_args!(
                "the controller speaks, but does not begin commanding: it is in {state}, quality {quality}, and {why}"
            ));
        }
        if let FriError::Silent {
            other_version: Some(version),
            ..
        } = error
            && !std::mem::replace(&mut told_version, true)
        {
            note(format_args!("{error}: --fri-version {version}"));
        } else if !told && !told_version && statistics.malformed > 0 {
            told = true;
            note(format_args!(
                "datagrams come, but none that FRI {} understands: is the controller of another version?",
                config.version
            ));
        }
    }
}

/// Brings the arm to rest: otherwise the controller's last command would be one in motion.
pub fn brake(client: &mut FriClient) {
    let began = Instant::now();
    while began.elapsed() < BRAKING {
        let waited = client.wait_for_message(SILENCE);
        // No braking if commanding has ended or the controller is gone.
        match client.command(ArmCommand::Hold) {
            // A command refused as unfit still brakes.
            Ok(()) | Err(FriError::Unfit(_)) if waited.is_ok() => {}
            _ => return,
        }
    }
}

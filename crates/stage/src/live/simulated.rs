//! A live session on the simulated arm.

use super::holds::{Holds, listen_to_console};
use super::preparation::{LiveOptions, Prepared};
use super::recorded;
use super::touching::Touching;
use crate::run::simulated_arm::SimulatedArm;
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, ArmState};
use hwall::{Surroundings, drive};
use hwall_bridge::{Bridge, BridgeServer};
use hwall_record::Recorded;
use hwall_view::ViewScene;
use std::sync::Arc;

/// A bridge, for a limited time.
pub(super) struct Limited {
    pub(super) bridge: Bridge,
    pub(super) end_s: f64,
    /// Time by which the arm's own clock is behind that of the loop, s.
    pub(super) skipped_s: f64,
}

impl<R: Arm> Surroundings<R> for Limited {
    fn next_cycle(&mut self, arm: &mut R) -> Result<Option<f64>, R::Error> {
        let now_s = self.bridge.next_cycle(arm)?;
        Ok(now_s.filter(|now_s| *now_s < self.end_s))
    }

    fn next_frame(&mut self, now_s: f64) -> Option<HandFrame> {
        self.bridge.hands.next_frame(now_s)
    }

    fn state(&mut self, state: ArmState) -> ArmState {
        ArmState {
            t_s: state.t_s + self.skipped_s,
            ..state
        }
    }
}

/// Until the server stops, or the time is over: the hands of the clients touch the board of the simulated arm.
///
/// # Errors
/// A command that the simulated arm refuses; a recording that cannot be written.
pub fn run_simulated(
    server: &BridgeServer,
    prepared: Prepared,
    options: &LiveOptions<'_>,
) -> anyhow::Result<()> {
    let mut recorder = recorded::begin(&prepared, options)?;
    let Prepared {
        session,
        arm,
        board,
        start,
        ..
    } = prepared;
    let model = Arc::clone(session.control().arm());
    let mut simulated = SimulatedArm::new(options.level, &arm, model, &board, start, options.seed)?;
    let scene = ViewScene::of("iiwa 7", &session)?;
    let mut surroundings = Limited {
        bridge: server.connect(&scene),
        end_s: options.seconds.unwrap_or(f64::INFINITY),
        skipped_s: 0.0,
    };
    let mut touching = Touching::new(&board);
    let mut holds = Holds::default();
    listen_to_console(&surroundings.bridge.view);
    let mut recorded = Recorded {
        session,
        recorder: recorder.as_mut(),
    };
    let ended = drive(
        &mut recorded,
        &mut simulated,
        &mut surroundings,
        |recorded, simulated, limited, cycle| {
            let bridge = &mut limited.bridge;
            let frame = bridge.hands.newest().map(|(frame, _)| *frame);
            let until_s = cycle.t_s + bridge.pacing.period_s();
            let tracking = recorded.session.tracking();
            touching.advance(simulated, until_s, frame.as_ref(), tracking)?;
            limited.skipped_s = touching.skipped_s();
            recorded::obey(bridge, &mut holds, recorded, cycle, options.enabling_switch);
            recorded::show(bridge, recorded, cycle);
            Ok(())
        },
    );
    holds.finish();
    recorded::finish(recorder, options.record)?;
    Ok(ended?)
}

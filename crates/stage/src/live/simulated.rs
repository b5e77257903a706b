//! A live session on the simulated arm.

use super::flags::LiveFlags;
use super::holds::{Holds, listen_to_console};
use super::preparation::Prepared;
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
    pub(super) touching: Touching,
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
            t_s: state.t_s + self.touching.skipped_s(),
            ..state
        }
    }
}

impl Prepared {
    /// The simulated arm in its waiting posture, and a bridge that shows it under this title.
    pub(super) fn on_simulated_arm(
        &self,
        server: &BridgeServer,
        flags: &LiveFlags,
        title: &str,
    ) -> anyhow::Result<(SimulatedArm, Limited)> {
        let model = Arc::clone(self.session.control().arm());
        let arm = SimulatedArm::new(
            flags.led.arm_level,
            &self.arm,
            model,
            self.start,
            flags.seed,
        )?;
        let limited = Limited {
            bridge: server.connect(&ViewScene::of(title, &self.session)?),
            end_s: flags.seconds.unwrap_or(f64::INFINITY),
            touching: Touching::new(self.arm.board()),
        };
        Ok((arm, limited))
    }
}

/// Until the server stops or time is up, the clients' hands touch the simulated arm's board.
///
/// # Errors
/// A command that the simulated arm refuses; a recording that cannot be written.
pub fn run_simulated(
    server: &BridgeServer,
    prepared: Prepared,
    flags: &LiveFlags,
) -> anyhow::Result<()> {
    let (mut arm, mut surroundings) = prepared.on_simulated_arm(server, flags, "iiwa 7")?;
    let Prepared {
        mut session,
        mut recorder,
        ..
    } = prepared;
    session
        .perception_mut()
        .explain_to(&surroundings.bridge.explanations);
    let mut holds = Holds::default();
    listen_to_console(&surroundings.bridge.view);
    let mut recorded = Recorded {
        session,
        recorder: recorder.as_mut(),
    };
    let ended = drive(
        &mut recorded,
        &mut arm,
        &mut surroundings,
        |recorded,
         arm,
         Limited {
             bridge, touching, ..
         },
         cycle| {
            let frame = bridge.hands.newest().map(|(frame, _)| *frame);
            let until_s = cycle.t_s + bridge.pacing.period_s();
            let tracking = recorded.session.tracking();
            touching.advance(arm, until_s, frame.as_ref(), tracking)?;
            recorded::after(bridge, &mut holds, recorded, cycle, flags.enabling_switch);
            Ok(())
        },
    );
    holds.finish();
    recorded::finish(recorder, flags)?;
    Ok(ended?)
}

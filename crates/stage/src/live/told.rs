//! A board commanded by the dissertation's Unity application.

use super::flags::LiveFlags;
use super::preparation::Prepared;
use super::simulated::Limited;
use crate::console::note;
use hwall::haptics::{ContactState, RendererConfig};
use hwall::{TargetControl, drive};
use hwall_bridge::{BridgeServer, UnityConfig, UnityReceiver};
use hwall_view::{ViewFrame, ViewState};

/// Until the server stops or time is up, datagrams command the board, without hand and prediction. Clients only watch.
///
/// # Errors
/// An address that cannot be listened on; a command that the simulated arm refuses.
pub(super) fn run_told(
    server: &BridgeServer,
    prepared: &Prepared,
    config: UnityConfig,
    flags: &LiveFlags,
) -> anyhow::Result<()> {
    let model = &**prepared.session.control().arm();
    let mut control = TargetControl::new(model, prepared.arm.board(), RendererConfig::default())?;
    // Started only now: commands from the time of preparation are outdated.
    let mut unity = UnityReceiver::start(config)?;
    let title = "iiwa 7, told where to go";
    let (mut arm, mut surroundings) = prepared.on_simulated_arm(server, flags, title)?;
    drive(
        &mut control,
        &mut arm,
        &mut surroundings,
        |control,
         arm,
         Limited {
             bridge, touching, ..
         },
         cycle| {
            if let Some(told) = unity.newest(cycle.t_s) {
                control.target = Some(told.target);
                control.slide = told.slide;
            }
            let until_s = cycle.t_s + bridge.pacing.period_s();
            let force_n = touching.advance(arm, until_s, None, None)?;
            if bridge.view.is_due(cycle.t_s) {
                let is_touched =
                    matches!(control.renderer().contact(), ContactState::Contact { .. });
                bridge.view.send(&ViewFrame {
                    goal: control.target.map(|target| (target.point_m, target.normal)),
                    force_n: Some(force_n),
                    state: match (is_touched, control.target) {
                        (true, _) => ViewState::Touched,
                        (false, Some(_)) => ViewState::Approaching,
                        (false, None) => ViewState::Waiting,
                    },
                    ..ViewFrame::new(cycle.t_s, cycle.state.q)
                });
            }
            Ok(())
        },
    )?;
    let counts = unity.counts();
    note(format_args!(
        "Datagrams: {} taken, {} without a place, {} refused.",
        counts.datagrams, counts.unseen_datagrams, counts.refused_datagrams
    ));
    Ok(())
}

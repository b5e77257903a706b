//! A board that the dissertation's Unity side sends to its places.

use super::preparation::{LiveOptions, Prepared};
use super::simulated::Limited;
use super::touching::Touching;
use crate::console::note;
use crate::run::simulated_arm::SimulatedArm;
use hwall::haptics::{ContactState, RendererConfig};
use hwall::{TargetControl, drive};
use hwall_bridge::{BridgeServer, UnityConfig, UnityReceiver};
use hwall_view::{ViewFrame, ViewScene, ViewState};
use std::sync::Arc;

/// Until the server stops, or the time is over: datagrams say where the board goes, without hand and prediction. Clients look on.
///
/// # Errors
/// An address that cannot be listened on; a command that the simulated arm refuses.
pub fn run_told(
    server: &BridgeServer,
    prepared: Prepared,
    config: UnityConfig,
    options: &LiveOptions<'_>,
) -> anyhow::Result<()> {
    let Prepared {
        session,
        arm,
        board,
        start,
        ..
    } = prepared;
    let scene = ViewScene::of("iiwa 7, told where to go", &session)?;
    let model = Arc::clone(session.control().arm());
    let mut control = TargetControl::new(&*model, &board, RendererConfig::default())?;
    let mut simulated = SimulatedArm::new(options.level, &arm, model, &board, start, options.seed)?;
    // Not before: where the board was wanted during the preparation matters no more.
    let mut unity = UnityReceiver::start(config)?;
    let mut surroundings = Limited {
        bridge: server.connect(&scene),
        end_s: options.seconds.unwrap_or(f64::INFINITY),
        skipped_s: 0.0,
    };
    let mut touching = Touching::new(&board);
    drive(
        &mut control,
        &mut simulated,
        &mut surroundings,
        |control, simulated, limited, cycle| {
            let bridge = &mut limited.bridge;
            if let Some(told) = unity.newest(cycle.t_s) {
                control.target = Some(told.target);
                control.slide = told.slide;
            }
            let until_s = cycle.t_s + bridge.pacing.period_s();
            let force_n = touching.advance(simulated, until_s, None, None)?;
            limited.skipped_s = touching.skipped_s();
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
        "Datagrams: {} taken, {} refused.",
        counts.datagrams, counts.refused_datagrams
    ));
    Ok(())
}

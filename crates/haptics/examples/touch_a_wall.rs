//! What does a renderer command while a board is sent to a wall, touched, and released?
//!
//! `cargo run -p hwall-haptics --example touch_a_wall`

use hwall_haptics::glam::DVec3;
use hwall_haptics::kinematics::{JointPositions, JointVelocities, SrsArm, Wrench};
use hwall_haptics::{
    ArmCommand, ArmState, Board, BoardTarget, HapticsError, Phase, Renderer, RendererConfig,
};

fn main() -> Result<(), HapticsError> {
    let board = Board::default();
    let mut renderer = Renderer::new(&SrsArm::iiwa7(), &board, RendererConfig::default())?;
    let mut state = ArmState {
        t_s: 0.0,
        q: JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]),
        qd: JointVelocities::default(),
        external_torque: None,
    };
    let mut phase = String::new();
    for i in 0..3000 {
        let now_s = f64::from(i) * 1e-3;
        state.t_s = now_s;
        // A hand presses with 8 N for half a second, and its tracker is lost for a while.
        let pressed = (1.5..2.0).contains(&now_s);
        let force_n = DVec3::NEG_X * if pressed { 8.0 } else { 0.0 };
        let wrench = Wrench {
            force_n,
            ..Wrench::default()
        };
        state.external_torque = Some(renderer.arm().torques_from_wrench(&state.q, &wrench));
        let point_m = DVec3::new(0.55, 0.25, 0.7);
        let target = BoardTarget::new(point_m, DVec3::X, now_s.min(2.5));
        let step = renderer.step(now_s, &state, Some(&target));
        renderer.plan();
        if let ArmCommand::Position(q) = step.command {
            state.q = q; // an arm that executes commands at once
        }
        let now = match step.phase {
            Phase::NonContact => "following the target".to_owned(),
            Phase::Contact { .. } => "touched, standing still".to_owned(),
            Phase::Hold(reason) => format!("holding: {}", reason.name()),
        };
        if now != phase {
            let at_m = renderer.arm().forward(&state.q).position_m();
            println!("{now_s:.3} s  board at {at_m:.3} m  {now}");
            phase = now;
        }
    }
    Ok(())
}

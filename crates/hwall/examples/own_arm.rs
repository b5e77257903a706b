//! A tracker at 72 Hz, a session, and an arm of your own: everything that a real set-up needs, in sixty lines.
//!
//! `cargo run --release -p hwall --example own_arm`

use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, ArmCommand, ArmState, Board};
use hwall::kinematics::{JointPositions, JointVelocities, SrsArm};
use hwall::scene::Scene;
use hwall::{EventKind, Session, SessionConfig, maps_of};
use std::{convert::Infallible, error::Error};

/// Your driver: this one is an ideal arm that is where it was told to be.
struct MyArm {
    t_s: f64,
    q: JointPositions,
}

impl Arm for MyArm {
    type Error = Infallible;

    fn state(&mut self) -> Result<ArmState, Infallible> {
        let (t_s, q) = (self.t_s, self.q);
        let qd = JointVelocities::default();
        Ok(ArmState {
            t_s,
            q,
            qd,
            external_torque: None,
        })
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), Infallible> {
        if let ArmCommand::Position(q) = command {
            self.q = q;
        }
        self.t_s += 1e-3;
        Ok(())
    }
}

/// Your tracker: a hand that reaches for the wall, and a person who looks where it goes.
fn tracker(t_s: f64) -> HandFrame {
    let (from, to) = (DVec3::new(1.1, 0.2, 0.4), DVec3::new(0.6, 0.1, 0.6));
    let (palm, head) = (
        from.lerp(to, (t_s / 1.5).min(1.0)),
        DVec3::new(1.4, 0.0, 0.9),
    );
    HandFrame {
        palm_m: Some(palm),
        head_m: Some(head),
        gaze: Some(to - head),
        ..HandFrame::empty(t_s)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let wall = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n";
    let (scene, _) = Scene::from_obj_str(wall, None)?;
    let board = Board::default();
    let model = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let maps = maps_of(&scene, &model)?;
    let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led())?;
    let mut session = Session::new(
        &model,
        &board,
        scene,
        maps,
        predictor,
        SessionConfig::default(),
    )?;
    let q = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
    let (mut arm, mut frames) = (MyArm { t_s: 0.0, q }, 0);
    while arm.t_s < 1.5 {
        if f64::from(frames) / 72.0 <= arm.t_s {
            session.frame(&tracker(f64::from(frames) / 72.0));
            frames += 1;
        }
        let (now_s, state) = (arm.t_s, arm.state()?);
        arm.command(session.step(now_s, &state))?;
        while let Some(event) = session.next_event() {
            if !matches!(event.kind, EventKind::Frame(_) | EventKind::Predicted(_)) {
                println!("{:.3} s: {:?}", event.t_s, event.kind);
            }
        }
    }
    println!("{:?}", session.state());
    Ok(())
}

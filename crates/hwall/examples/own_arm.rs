//! A tracker at 72 Hz, a session, an arm of your own: `cargo run --release -p hwall --example own_arm`

use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::{Arm, ArmCommand, ArmState, Board};
use hwall::kinematics::{JointPositions, JointTorques, JointVelocities, SrsArm};
use hwall::scene::Scene;
use hwall::{Session, SessionConfig, SessionState, maps_of};
use std::io::{self, Write};
use std::{convert::Infallible, error::Error};

/// Your driver: this one is an ideal arm that is always where it was commanded.
struct MyArm(ArmState);

impl Arm for MyArm {
    type Error = Infallible;
    fn state(&mut self) -> Result<ArmState, Infallible> {
        Ok(self.0)
    }

    fn command(&mut self, command: ArmCommand) -> Result<(), Infallible> {
        // Anything else is Hold: this arm has stopped already, a real one brakes.
        if let ArmCommand::Position(q) = command {
            self.0.q = q;
        }
        self.0.t_s += 1e-3;
        Ok(())
    }
}

/// Your tracker: a hand that moves to the wall in 1.5 s.
fn tracked(t_s: f64) -> HandFrame {
    let (from_m, to_m) = (DVec3::new(1.1, 0.2, 0.4), DVec3::new(0.6, 0.1, 0.6));
    let mut frame = HandFrame::empty(t_s);
    frame.palm_m = Some(from_m.lerp(to_m, t_s / 1.5));
    // The arm does not move before it knows where the head is.
    frame.head_m = Some(from_m + DVec3::new(0.3, 0.2, 0.4));
    frame
}

/// The board is in place before the hand arrives.
pub fn main() -> Result<(), Box<dyn Error>> {
    let wall = "v 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n";
    let (scene, _) = Scene::from_obj_str(wall, None)?; // in the base frame of the arm
    let board = Board::default();
    let model = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let maps = maps_of(&scene, &model)?;
    let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led())?;
    let config = SessionConfig::default();
    let mut session = Session::new(&model, &board, scene, maps, predictor, config)?;
    let mut arm = MyArm(ArmState {
        t_s: 0.0,
        q: JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]),
        qd: JointVelocities::default(),
        // Nothing touches it. For an arm without torque sensors leave this `None` and set `SupervisorConfig::requires_torque` to false; it
        // then feels neither a touch nor a hand that it squeezes.
        external_torque: Some(JointTorques::default()),
    });
    for cycle in 0..1500 {
        let state = arm.state()?;
        if cycle % 14 == 0 {
            session.frame(&tracked(state.t_s));
            writeln!(io::stdout(), "{:.3} s: {:?}", state.t_s, session.state())?;
        }
        arm.command(session.step(state.t_s, &state))?;
        session.plan();
    }
    assert_eq!(session.state(), SessionState::InPlace);
    Ok(())
}

//! A wall in front of a simulated iiwa, touched from a browser: with a mouse, a finger, or the hands in a headset.
//!
//! `cargo run --release -p hwall-bridge --example wall`

use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::hand::HandFilterConfig;
use hwall::haptics::Board;
use hwall::kinematics::SrsArm;
use hwall::scene::Scene;
use hwall::{Session, SessionConfig, Walls, WallsConfig};
use hwall_bridge::view::ViewScene;
use hwall_bridge::{BridgeConfig, BridgeServer};
use hwall_sim::{HandContact, ServoArm, ServoConfig};
use std::sync::Arc;

const WALL: &str =
    "o wall\nv 0.62 -1 -0.6\nv 0.62 1 -0.6\nv 0.62 1 1.5\nv 0.62 -1 1.5\nf 1 2 3 4\n";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let server = BridgeServer::start(BridgeConfig::default())?;
    println!("open {} (end with Ctrl-C)", server.url());
    let (scene, _) = Scene::from_obj_str(WALL, None)?;
    let board = Board::default();
    let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let walls = Walls::of(&scene, &arm, &board, &WallsConfig::default())?;
    let start = walls.waiting.ok_or("no wall within reach")?;
    let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led())?;
    let config = SessionConfig {
        // A mouse has no tremor.
        hand: HandFilterConfig::simulated(),
        ..SessionConfig::default()
    };
    let mut session = Session::new(&arm, &board, scene, walls, predictor, config)?;
    let model = Arc::clone(session.control().arm());
    let mut driver = ServoArm::new(model, start, ServoConfig::default())?;
    let mut bridge = server.connect(&ViewScene::of("A wall", &session)?);
    let finger = HandContact::default();
    session.drive(
        &mut driver,
        &mut bridge,
        |session, driver, bridge, cycle| {
            bridge.show(session, &cycle.state);
            // A real hand would do this by itself: it presses the board.
            let hand = session.tracking().and_then(|tracking| tracking.state());
            let wrench = match hand {
                Some(hand) => finger.wrench(&driver.pose(), hand.point_m, hand.velocity_m_per_s)?,
                None => None,
            };
            driver.apply_wrench(wrench.unwrap_or_default())?;
            driver.advance(bridge.pacing.period_s())
        },
    )?;
    Ok(())
}

//! An arm with maps for every 22.5 degrees presents a wall at 30 degrees, and a hand is shifted.
//!
//! `cargo run --release -p hwall-redirection --example meet_a_wall`

use hwall_redirection::glam::DVec3;
use hwall_redirection::{
    AvatarTurn, PersonMotion, ReachFrame, ReachShift, ReachThresholds, RedirectedReach,
    SampledOrientations, TurnConfig,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let wall_rad = 30_f64.to_radians();
    let snapped = SampledOrientations::default().snap(wall_rad)?;
    println!(
        "the board stands at {:.1} degrees, the avatar should turn by {:.1}",
        snapped.heading_rad.to_degrees(),
        snapped.turn_rad.to_degrees()
    );

    // Two seconds of walking at 1.2 m/s with a slight turn.
    let mut turn = AvatarTurn::new(TurnConfig::default())?;
    let walking = PersonMotion {
        turn_rad_per_s: 0.1,
        steered_speed_m_per_s: 1.2,
        ..PersonMotion::default()
    };
    for _ in 0..200 {
        turn.step(snapped.turn_rad, &walking, 0.01)?;
    }
    println!(
        "after 2 s it has turned by {:.1} degrees",
        turn.turned_rad().to_degrees()
    );

    // The board stops as far aside as the thresholds allow.
    let thresholds = ReachThresholds::default();
    let (hand, seen) = (DVec3::new(1.0, 0.15, 0.7), DVec3::new(0.62, 0.0, 0.6));
    let aside = ReachShift {
        horizontal_rad: thresholds.horizontal_rad,
        ..ReachShift::NONE
    };
    let board = ReachFrame::new(hand, seen)?.real_goal_m(&aside);
    let reach = RedirectedReach::new(hand, seen, board, DVec3::X, &thresholds)?;
    for share in [0.0, 0.5, 1.0] {
        let shown = reach.virtual_hand(hand.lerp(board, share))?;
        println!(
            "{:3.0} % of the way: the virtual hand is {:4.1} mm beside the real one",
            100.0 * share,
            1e3 * shown.shift_m.length()
        );
    }
    Ok(())
}

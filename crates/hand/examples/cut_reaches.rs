//! Which movements of a recording are reaches, where do they end, and what was left out?
//!
//! `cargo run -p hwall-hand --example cut_reaches` (or `-- recording.csv` for your own)

use hwall_hand::glam::DVec3;
use hwall_hand::{
    HandError, HandFilter, HandFilterConfig, HandFrame, HandPoint, LabelConfig, Recording,
    Tracking, labelled_reaches, read_recordings,
};
use std::fs::File;

/// Three reaches of the index finger and back, at 70 Hz; with a tracking gap.
fn recorded() -> Result<Vec<Recording>, HandError> {
    let mut csv = "t,index_x,index_y,index_z\n".to_owned();
    for i in 0..700 {
        let t_s = f64::from(i) / 70.0;
        // Rest, reach, rest, back: a smooth step out and in every three seconds.
        let step = |s: f64| s.clamp(0.0, 1.0).powi(2) * (3.0 - 2.0 * s.clamp(0.0, 1.0));
        let (round, phase_s) = ((t_s / 3.0).floor(), t_s % 3.0);
        let out = step((phase_s - 0.5) / 0.7) - step((phase_s - 2.0) / 0.7);
        let place_m = DVec3::new(0.3, 0.0, 1.0).lerp(DVec3::new(0.8, 0.1 * round, 1.3), out);
        csv += &match (4.0..4.3).contains(&t_s) {
            true => format!("{t_s},,,\n"),
            false => format!("{t_s},{},{},{}\n", place_m.x, place_m.y, place_m.z),
        };
    }
    read_recordings(csv.as_bytes())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let recordings = match std::env::args().nth(1) {
        Some(path) => read_recordings(File::open(path)?)?,
        None => recorded()?,
    };
    // The result of a live session, frame by frame.
    let mut filter = HandFilter::new(HandFilterConfig::simulated())?;
    let (mut last, mut frames) = (None, 0);
    for sample in recordings.iter().flat_map(|r| &r.samples) {
        let frame: &HandFrame = &sample.frame;
        let reason = match filter.step(frame) {
            Tracking::Lost { reason, .. } => Some(reason),
            _ => None,
        };
        if reason != last {
            println!(
                "{:.2} s: {}",
                frame.t_s,
                reason.map_or("tracked".to_owned(), |r| format!("{r:?}"))
            );
            last = reason;
        }
        frames += usize::from(frame.point(HandPoint::Index).is_some());
    }
    println!("{frames} frames with an index finger");

    // Reaches usable for training.
    let found = labelled_reaches(&recordings, &LabelConfig::default())?;
    for reach in &found.reaches {
        println!(
            "reach of {:.2} s to {:.3} m",
            reach.duration_s(),
            reach.contact_m
        );
    }
    for left_out in &found.left_out {
        println!("left out: {}, {}", left_out.what, left_out.why);
    }
    Ok(())
}

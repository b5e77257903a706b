//! Which roughness model ranks conditions as people did, and which level stands for which virtual texture?
//!
//! `cargo run -p hwall-texton --example rank_textures`

use hwall_texton::{
    Encoding, Level, RoughnessModel, ScanAngle, StudyOrder, TextonError, Texture, Vibration,
    roughness_models, score_order,
};

fn main() -> Result<(), TextonError> {
    let texture = Texture::released();
    // The roughness order found in the dissertation's study; a finger at 70 mm/s.
    let study = StudyOrder::dissertation(70.0);
    println!("model: pairs of orientations and of speeds in the order of the study");
    for model in roughness_models() {
        let score = score_order(model.as_ref(), &texture, &study)?;
        println!(
            "{:40} {:3} of {:3}   {:3} of {:3}",
            score.model,
            score.orientation.hits,
            score.orientation.of,
            score.speed.hits,
            score.speed.of
        );
    }

    // Levels: every orientation and speed of the board, with magnitudes from one of the models.
    let model = Vibration::default();
    let mut levels = Vec::new();
    for deg in [0.0, 45.0, 63.43, 90.0] {
        for speed_mm_per_s in [20.0, 40.0, 80.0] {
            let scan = ScanAngle::from_deg(deg)?;
            if let Some(magnitude) = model.predict(&texture, scan, speed_mm_per_s)?.value() {
                levels.push(Level {
                    scan,
                    speed_mm_per_s,
                    magnitude,
                });
            }
        }
    }
    // Virtual textures get the levels whose magnitudes are spread most evenly.
    let textures = [
        ("silk", 0.05),
        ("paper", 0.2),
        ("linen", 0.5),
        ("sandpaper", 0.9),
    ];
    let encoding = Encoding::new(&textures.map(|(_, roughness)| roughness), &levels)?;
    for (place, (name, roughness)) in textures.iter().enumerate() {
        if let Some(level) = encoding.level(place) {
            println!(
                "{name} ({roughness}): {:.0} deg at {} mm/s",
                level.scan.deg(),
                level.speed_mm_per_s
            );
        }
    }
    Ok(())
}

//! Smaller and finer textons: limits of printers, and resolution of the skin.

use super::wanted::PrinterKind;
use clap::ValueEnum;
use hwall_testkit::{Column, MarkdownTable, table_of, yes_or_no};
use hwall_texton::{
    DeviceLimits, Layout, Radii, RoughnessModel, ScanAngle, Texton, Texture, Vibration,
};

/// Gap that a resting fingertip detects in three of four trials, mm: [Johnson 1981].
const GAP_AT_REST_MM: f64 = 0.87;
/// Lowest dots that a stroking fingertip detects: diameter and height, um: [Johansson 1983].
const DOTS_UM: [[f64; 2]; 3] = [[40.0, 5.97], [231.0, 2.94], [602.0, 1.09]];
/// Least relative step of roughness: the assumption of [`DesignRequest`](hwall_texton::DesignRequest).
const STEP: f64 = 0.1;
/// Blurs of the skin, mm: the default of the model, and half of it.
const BLURS_MM: [f64; 2] = [0.5, 0.25];
/// Ratio of long to short radius, as on the released patch.
const LONG: f64 = 3.0;

/// A texture, and the height of the lowest bump that its printer can make, mm.
struct Fine {
    name: String,
    texture: Texture,
    least_height_mm: Option<f64>,
}

impl Fine {
    fn height_mm(&self) -> f64 {
        self.texture.texton().height_mm()
    }

    /// Width of its bumps, mm.
    fn breadth_mm(&self) -> f64 {
        2.0 * self.texture.texton().radii().short_mm
    }

    /// Least and largest roughness over the angles and speeds of the device.
    fn roughness(&self, blur_mm: f64) -> anyhow::Result<[f64; 2]> {
        let (device, model) = (
            DeviceLimits::default(),
            Vibration {
                blur_mm,
                ..Vibration::default()
            },
        );
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for deg in 0..=90 {
            let scan = ScanAngle::from_deg(f64::from(deg))?;
            for speed in device.speed_mm_per_s {
                if let Some(rough) = model.predict(&self.texture, scan, speed)?.value() {
                    (least, most) = (least.min(rough), most.max(rough));
                }
            }
        }
        Ok([least, most])
    }
}

/// The lowest dot of a diameter that a stroking fingertip detects, um; power-law interpolation between the measured diameters, constant
/// beyond them.
fn least_dot_um(diameter_um: f64) -> f64 {
    let pair = DOTS_UM.windows(2).find(|pair| diameter_um < pair[1][0]);
    let Some(&[[d0, h0], [d1, h1]]) = pair.and_then(|pair| pair.first_chunk::<2>()) else {
        return DOTS_UM[DOTS_UM.len() - 1][1];
    };
    let share = ((diameter_um / d0).ln() / (d1 / d0).ln()).max(0.0);
    h0 * (h1 / h0).powf(share)
}

/// The released patch, and for each printer the smallest bumps at the smallest gaps, at the lowest printable height and at the height of
/// the released bumps.
fn fine() -> anyhow::Result<Vec<Fine>> {
    let released = Texture::released();
    let mut all = vec![Fine {
        name: "released".to_owned(),
        texture: released,
        least_height_mm: None,
    }];
    for kind in PrinterKind::value_variants() {
        let limits = kind.process().limits();
        let short_mm = limits.least_radius_mm;
        let radii = Radii {
            long_mm: LONG * short_mm,
            short_mm,
        };
        let layout = Layout::Rectangular {
            long_mm: 2.0 * radii.long_mm + limits.least_gap_mm,
            short_mm: 2.0 * short_mm + limits.least_gap_mm,
        };
        for (name, height_mm) in [
            ("lowest", limits.least_height_mm),
            ("height of the released", released.texton().height_mm()),
        ] {
            let texton = Texton::hemiellipsoid(radii, height_mm)?;
            all.push(Fine {
                name: format!("finest of {}, {name}", kind.name()),
                texture: Texture::new(texton, layout)?,
                least_height_mm: Some(limits.least_height_mm),
            });
        }
    }
    Ok(all)
}

/// Finest textures of the printers, compared with the resolution of a resting and a moving finger, and their roughness by the model of
/// vibration.
///
/// # Errors
/// None in practice: the limits of printers are positive.
pub fn table() -> anyhow::Result<MarkdownTable> {
    let all = fine()?;
    let ranges = |fine: &Fine| -> anyhow::Result<_> {
        let [a, b] = BLURS_MM.map(|blur_mm| fine.roughness(blur_mm));
        Ok([a?, b?])
    };
    let released = ranges(&all[0])?.map(|[_, most]| most);
    let rows = all.into_iter().map(|fine| Ok((ranges(&fine)?, fine)));
    let rows = rows.collect::<anyhow::Result<Vec<_>>>()?;
    type Row = ([[f64; 2]; 2], Fine);
    let both = |cell: &dyn Fn(usize) -> String| format!("{} / {}", cell(0), cell(1));
    let pitch = |fine: &Fine| fine.texture.layout().pitch_mm();
    let columns: [Column<'_, Row>; 9] = [
        ("patch", &|(_, f)| f.name.clone()),
        ("bump, mm", &|(_, f)| {
            let [a, b] = f.texture.texton().radii().to_array();
            format!("{:.2} x {:.2} x {:.2}", 2.0 * a, 2.0 * b, f.height_mm())
        }),
        ("can be printed so low", &|(_, f)| {
            let lowest = f.least_height_mm;
            lowest
                .map_or("-", |mm| yes_or_no(f.height_mm() >= mm))
                .to_owned()
        }),
        ("pitch, mm", &|(_, f)| {
            let [a, b] = pitch(f);
            format!("{a:.2} x {b:.2}")
        }),
        ("bumps on 1 cm2", &|(_, f)| {
            let [a, b] = pitch(f);
            format!("{:.0}", 100.0 / (a * b))
        }),
        ("gap felt at rest", &|(_, f)| {
            yes_or_no(f.texture.gap_mm() >= GAP_AT_REST_MM).to_owned()
        }),
        ("height in least heights felt on the move", &|(_, f)| {
            format!(
                "{:.0}",
                1e3 * f.height_mm() / least_dot_um(1e3 * f.breadth_mm())
            )
        }),
        ("steps of roughness", &|(ranges, _)| {
            both(&|k| {
                let [least, most] = ranges[k];
                format!("{:.0}", 1.0 + (most / least).ln() / STEP.ln_1p())
            })
        }),
        ("most roughness, released = 1", &|(ranges, _)| {
            both(&|k| format!("{:.3}", ranges[k][1] / released[k]))
        }),
    ];
    Ok(table_of(rows, &columns))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_are_those_that_were_measured_and_between_them() {
        for [diameter_um, height_um] in DOTS_UM {
            assert!((least_dot_um(diameter_um) - height_um).abs() < 1e-12);
        }
        assert_eq!(least_dot_um(1.0), 5.97);
        assert_eq!(least_dot_um(5000.0), 1.09);
        let between = least_dot_um(400.0);
        assert!(1.09 < between && between < 2.94);
    }

    #[test]
    fn roughness_is_in_proportion_to_height() {
        let all = fine().unwrap();
        for pair in all[1..].chunks(2) {
            let [low, high] = [0, 1].map(|k| pair[k].roughness(0.5).unwrap());
            let ratio = pair[1].height_mm() / pair[0].height_mm();
            for k in 0..2 {
                assert!((high[k] / low[k] / ratio - 1.0).abs() < 1e-9);
            }
        }
    }
}

//! A texture for wanted roughnesses: the table of candidates, and the chosen one.

use anyhow::{Context, ensure};
use clap::ValueEnum;
use hwall_scene::Scene;
use hwall_testkit::{Column, or_none, table_of};
use hwall_texton::{
    Calibration, Compression, DesignCandidate, DesignLevel, DesignRequest, GivenUp, LevelPath,
    MagnitudeScale, PrintProcess, RoughnessModel, RoughnessSource, TemporalFrequency, Texture,
    Vibration, Wanted, design,
};
use std::io::Write;
use std::path::{Path, PathBuf};

/// How the patch is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PrinterKind {
    /// Molten filament
    Fdm,
    /// Resin cured by light
    Sla,
    /// Jetted resin
    Polyjet,
}

impl PrinterKind {
    /// Its printing process.
    pub const fn process(self) -> PrintProcess {
        match self {
            Self::Fdm => PrintProcess::Fdm,
            Self::Sla => PrintProcess::Sla,
            Self::Polyjet => PrintProcess::PolyJet,
        }
    }

    /// As on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fdm => "fdm",
            Self::Sla => "sla",
            Self::Polyjet => "polyjet",
        }
    }

    /// Features of a texture that it cannot print, one line each.
    pub fn lacks(self, texture: &Texture) -> Vec<String> {
        let limits = self.process().limits();
        let [_, short_mm] = texture.texton().radii().to_array();
        let height_mm = texture.texton().height_mm();
        let parts = [
            ("gaps", texture.gap_mm(), limits.least_gap_mm),
            ("short radii", short_mm, limits.least_radius_mm),
            ("heights", height_mm, limits.least_height_mm),
        ];
        let short = parts
            .iter()
            .filter(|(_, is, needs)| *is < needs * (1.0 - 1e-9));
        let said =
            short.map(|(what, is, needs)| format!("{what} of {is:.2} mm, it needs {needs:.2} mm"));
        said.collect()
    }
}

/// The model that predicts roughness: those that reproduce the order of the dissertation's study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModelKind {
    /// Vibration weighted by the sensitivity of Pacinian afferents
    Vibration,
    /// Bumps per second
    Frequency,
}

/// Flags of a design.
#[derive(Debug, Clone, clap::Args)]
pub struct WantedArgs {
    /// Design the texture for these roughnesses: 1,2,4. Without --table only their ratios count
    #[arg(
        long = "for",
        value_delimiter = ',',
        value_name = "LEVELS",
        group = "wished",
        allow_negative_numbers = true
    )]
    pub levels: Vec<f64>,
    /// Design it for the roughnesses of the touchable surfaces of this OBJ scene and its sidecar
    #[arg(long, value_name = "FILE", group = "wished")]
    pub for_scene: Option<PathBuf>,
    /// Printing process: sets the smallest gap, radius and height of a design [default: sla]; a preset is checked against them
    #[arg(long, value_enum)]
    pub printer: Option<PrinterKind>,
    /// The model that predicts roughness
    #[arg(long, value_enum, default_value = "vibration", requires = "wished")]
    pub model: ModelKind,
    /// CSV of a study on the released patch (orientation_deg, velocity_mm_s, value): sets the scale of the model, and --for is then in that
    /// study's scale
    #[arg(long, requires = "wished")]
    pub table: Option<PathBuf>,
    /// Just noticeable difference of roughness, relative; the default is an assumption
    #[arg(
        long,
        default_value_t = 0.1,
        requires = "wished",
        allow_negative_numbers = true
    )]
    pub weber: f64,
    /// Narrow ratios that no texture reaches, instead of refusing them
    #[arg(long, requires = "wished")]
    pub narrow: bool,
    /// Number of the candidate to make, from 1
    #[arg(
        long,
        default_value_t = 1,
        requires = "wished",
        allow_negative_numbers = true
    )]
    pub candidate: usize,
}

impl WantedArgs {
    /// Is a design requested?
    pub fn is_given(&self) -> bool {
        !self.levels.is_empty() || self.for_scene.is_some()
    }

    /// Designs, prints the candidates and returns the chosen one; `None` without wanted levels.
    ///
    /// # Errors
    /// Levels that no texture presents, a table that cannot be read, a candidate that does not exist.
    pub fn texture(&self, out: &mut impl Write) -> anyhow::Result<Option<Texture>> {
        let levels = match &self.for_scene {
            Some(path) => roughness_of(path)?,
            None => self.levels.clone(),
        };
        if levels.is_empty() {
            return Ok(None);
        }
        ensure!(self.candidate > 0, "--candidate: they count from 1");
        let (vibration, frequency) = (Vibration::default(), TemporalFrequency);
        let model: &dyn RoughnessModel = match self.model {
            ModelKind::Vibration => &vibration,
            ModelKind::Frequency => &frequency,
        };
        let process = self.printer.unwrap_or(PrinterKind::Sla).process();
        let mut request = DesignRequest {
            weber_fraction: self.weber,
            compression: match self.narrow {
                true => Compression::Allow,
                false => Compression::Refuse,
            },
            ..DesignRequest::of_ratios(levels.clone(), model, process)
        };
        if let Some(path) = &self.table {
            let name = || path.display().to_string();
            let file = std::fs::File::open(path).with_context(name)?;
            let table = Calibration::from_csv(file).with_context(name)?;
            let scale = MagnitudeScale::from_calibration(model, &Texture::released(), &table, 0.0)
                .with_context(name)?;
            writeln!(
                out,
                "scale from {}: {:.4} prediction^{:.3}, magnitudes scatter by {:.1} %",
                path.display(),
                scale.gain,
                scale.exponent,
                100.0 * scale.ln_sd.unwrap_or_default()
            )?;
            request.source = RoughnessSource::Model { model, scale };
            request.wanted = Wanted::Magnitudes(levels);
        }
        let candidates = design(&request).context("--for")?;
        let count = candidates.len();
        ensure!(
            self.candidate <= count,
            "--candidate {}: there are {count}",
            self.candidate
        );
        describe(&candidates, model, out)?;
        Ok(candidates.get(self.candidate - 1).map(|c| c.texture))
    }
}

/// The distinct roughnesses of a scene's touchable surfaces, ascending.
fn roughness_of(path: &Path) -> anyhow::Result<Vec<f64>> {
    let name = || path.display().to_string();
    let (scene, _) = Scene::from_obj_file(path, None).with_context(name)?;
    let touchable = scene.surfaces().iter().filter(|s| s.touchable());
    let mut levels: Vec<f64> = touchable.filter_map(|s| s.roughness).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    ensure!(!levels.is_empty(), "{}: no surface has a roughness", name());
    Ok(levels)
}

fn describe(
    candidates: &[DesignCandidate],
    model: &dyn RoughnessModel,
    out: &mut impl Write,
) -> anyhow::Result<()> {
    let info = model.info();
    let (name, quantity, misfit) = (info.name, info.quantity, info.misfit);
    writeln!(out, "by {name} ({quantity}; {misfit})\n")?;
    let in_range = |c: &DesignCandidate| {
        let all = c.levels.len();
        format!("{} of {all}", all - beyond(c))
    };
    let path = |c: &DesignCandidate| match c.path {
        LevelPath::Speed => "speed",
        LevelPath::Angle => "angle",
        LevelPath::Both => "both",
    };
    let radii = |c: &DesignCandidate| c.texture.texton().radii().to_array();
    let sizes = |[a, b]: [f64; 2]| format!("{a:.3} x {b:.3}");
    let columns: [Column<'_, (usize, &DesignCandidate)>; 8] = [
        ("candidate", &|(i, _)| i.to_string()),
        ("radii, mm", &|(_, c)| sizes(radii(c))),
        ("height, mm", &|(_, c)| {
            c.texture.texton().height_mm().to_string()
        }),
        ("pitch, mm", &|(_, c)| sizes(c.texture.layout().pitch_mm())),
        ("varies", &|(_, c)| path(c).to_owned()),
        ("levels in range", &|(_, c)| in_range(c)),
        ("least step, jnd", &|(_, c)| or_none(c.least_step_jnd, 2)),
        ("largest error, jnd", &|(_, c)| {
            format!("{:.2}", c.worst_error_jnd)
        }),
    ];
    writeln!(out, "{}", table_of((1..).zip(candidates), &columns))?;
    for (i, c) in candidates.iter().enumerate() {
        let columns: [Column<'_, &DesignLevel>; 8] = [
            ("wanted", &|l| l.wanted.to_string()),
            ("angle, deg", &|l| format!("{:.2}", l.scan.deg())),
            ("speed, mm/s", &|l| format!("{:.2}", l.speed_mm_per_s)),
            ("magnitude", &|l| significant(l.magnitude, 5)),
            ("jnd", &|l| significant(l.jnd, 3)),
            ("jnd, deg", &|l| or_none(l.jnd_deg, 2)),
            ("jnd, mm/s", &|l| or_none(l.jnd_mm_per_s, 2)),
            ("error, jnd", &|l| format!("{:.2}", l.error_jnd)),
        ];
        let levels = table_of(&c.levels, &columns);
        writeln!(out, "candidate {}\n\n{levels}\ngiven up:", i + 1)?;
        for given_up in &c.given_up {
            writeln!(out, "- {given_up}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Levels outside the range in which the model was measured.
fn beyond(candidate: &DesignCandidate) -> usize {
    let levels = candidate.given_up.iter().map(|g| match g {
        GivenUp::ModelRange { levels, .. } => *levels,
        _ => 0,
    });
    levels.sum::<usize>().min(candidate.levels.len())
}

/// A positive number with `digits` significant digits.
fn significant(value: f64, digits: i32) -> String {
    let before = value.abs().log10().floor();
    let behind = f64::from(digits) - 1.0 - before;
    if !(0.0..=12.0).contains(&behind) {
        return format!("{value:.*e}", (digits - 1).max(0) as usize);
    }
    format!("{value:.*}", behind as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(levels: Vec<f64>, printer: PrinterKind) -> WantedArgs {
        WantedArgs {
            levels,
            for_scene: None,
            printer: Some(printer),
            model: ModelKind::Vibration,
            table: None,
            weber: 0.1,
            narrow: false,
            candidate: 1,
        }
    }

    #[test]
    fn every_printer_gets_a_texture_and_a_refusal_names_the_nearest() {
        for printer in PrinterKind::value_variants() {
            let mut text = Vec::new();
            let texture = args(vec![1.0, 2.0, 4.0], *printer).texture(&mut text);
            assert!(texture.unwrap().is_some());
            let text = String::from_utf8(text).unwrap();
            let is_whole = text.contains("candidate 5") && text.contains("given up");
            assert!(is_whole, "{text}");
        }
        let refused = args(vec![1.0, 1e7], PrinterKind::Sla).texture(&mut Vec::new());
        let refused = format!("{:#}", refused.unwrap_err());
        let nearest = "the nearest that is possible";
        assert!(refused.contains(nearest), "{refused}");
        let room = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/assets/room.obj");
        let of_scene = WantedArgs {
            for_scene: Some(room),
            ..args(Vec::new(), PrinterKind::Polyjet)
        };
        assert!(of_scene.texture(&mut Vec::new()).unwrap().is_some());
        // A candidate that does not exist is refused before anything is printed.
        for candidate in [0, 6] {
            let mut text = Vec::new();
            let wrong = WantedArgs {
                candidate,
                ..args(vec![1.0, 2.0], PrinterKind::Sla)
            };
            assert!(wrong.texture(&mut text).is_err() && text.is_empty());
        }
        let none = args(Vec::new(), PrinterKind::Sla).texture(&mut Vec::new());
        assert_eq!(none.unwrap(), None);
    }

    #[test]
    fn digits_are_those_that_count() {
        for (value, text) in [
            (0.000_123_456, "0.00012346"),
            (1.0, "1.0000"),
            (12345.6, "12346"),
            (1e9, "1.0000e9"),
            (9.999_999, "10.0000"),
        ] {
            assert_eq!(significant(value, 5), text);
        }
    }

    #[test]
    fn a_printer_says_what_it_lacks() {
        assert_eq!(PrinterKind::Fdm.lacks(&Texture::released()).len(), 2);
        let coarse = Texture::spaced_3_mm();
        assert!(PrinterKind::Polyjet.lacks(&coarse).is_empty());
    }
}

//! A roughness for each surface of a scene, proposed from pictures of its materials.

use crate::report::{Column, table_of};
use crate::texture::sidecar;
use anyhow::{Context, ensure};
use hwall::texture::TextureLevels;
use hwall_stage::input::file_plan::FilePlan;
use hwall_texton::{
    Encoding, HeightField, HeightSource, Level, MaterialPicture, MaterialScale, PictureKind,
    PngSource, RoughnessProposal, order_certainty,
};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Flags of the proposal.
#[derive(Debug, Clone, clap::Args)]
pub struct AssignArgs {
    /// Pictures of materials: FILE, SURFACE=FILE or SURFACE=FILE@WIDTH_M. PNG: colour or, with --height-map, heights; EXR: heights.
    /// Without SURFACE the name of the file without its ending names the surface
    #[arg(value_name = "IMAGE", required_unless_present = "calibration")]
    pub images: Vec<String>,
    /// Width of what each picture shows, m (of those that do not say @WIDTH_M; EXR files may state it)
    #[arg(long, allow_negative_numbers = true)]
    pub width_m: Option<f64>,
    /// The PNG files hold heights; needs --relief-mm
    #[arg(long, requires = "relief_mm")]
    pub height_map: bool,
    /// Height of white above black in a PNG height map, or of one unit in an EXR file that states none, mm
    #[arg(long, allow_negative_numbers = true)]
    pub relief_mm: Option<f64>,
    /// Write the proposals as JSON
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write each proposed roughness into this sidecar of a scene; all else in it stays as it is
    #[arg(long)]
    pub sidecar: Option<PathBuf>,
    /// Print the materials that the proposal is calibrated on, and its cross-validated error
    #[arg(long)]
    pub calibration: bool,
}

/// A surface, its picture and its proposal.
#[derive(Debug, Clone, PartialEq)]
pub struct Assigned {
    /// Name of the surface.
    pub surface: String,
    /// File of the picture.
    pub picture: PathBuf,
    /// The proposal.
    pub proposal: RoughnessProposal,
    /// Orientation and speed of the released patch that stand for it among the surfaces given; `None` if there are more of them than levels.
    pub level: Option<Level>,
    /// Probability that it is rougher than the surface before; `None` for the smoothest.
    pub certainty: Option<f64>,
}

/// Runs the command: proposals, smoothest first, and their files.
///
/// # Errors
/// A picture that cannot be read or carries no information; a file that cannot be written.
pub fn run(args: &AssignArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let images: Vec<Image> = args
        .images
        .iter()
        .map(|text| Image::parse(text, args))
        .collect();
    let mut files = FilePlan::default();
    for image in &images {
        files = files.read("IMAGE", Some(&image.path));
    }
    files = files.write("--json", args.json.as_deref());
    files.write("--sidecar", args.sidecar.as_deref()).check()?;
    let scale = MaterialScale::calibrated()?;
    if args.calibration {
        calibration(&scale, out)?;
    }
    if images.is_empty() {
        return Ok(());
    }
    let assigned = assign(&images, &scale)?;
    describe(&assigned, out)?;
    if let Some(path) = &args.json {
        let text = serde_json::to_string_pretty(&to_json(&assigned))? + "\n";
        hwall_files::write(path, text).with_context(|| path.display().to_string())?;
    }
    if let Some(path) = &args.sidecar {
        let entries = assigned
            .iter()
            .map(|a| (a.surface.as_str(), two_digits(&a.proposal)));
        sidecar::write_roughness(path, entries)?;
    }
    Ok(())
}

/// A picture as named on the command line.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Name of the surface.
    pub surface: String,
    /// The file.
    pub path: PathBuf,
    /// Width of what it shows, m.
    pub width_m: Option<f64>,
    /// Height of white or of one unit, mm; `None` for the colours of a PNG.
    pub relief_mm: Option<f64>,
}

impl Image {
    fn parse(text: &str, args: &AssignArgs) -> Self {
        let (surface, file) = match text.split_once('=') {
            Some((surface, file)) => (Some(surface), file),
            None => (None, text),
        };
        let own = file
            .rsplit_once('@')
            .and_then(|(file, width)| Some((file, width.parse().ok()?)));
        let (file, width_m) = own.map_or((file, args.width_m), |(file, width)| (file, Some(width)));
        let path = PathBuf::from(file);
        let stem = || {
            path.file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned()
        };
        let surface = surface.map_or_else(stem, str::to_owned);
        let heights = args.height_map || is_exr(&path);
        Self {
            surface,
            width_m,
            relief_mm: args.relief_mm.filter(|_| heights),
            path,
        }
    }

    fn read(&self) -> anyhow::Result<MaterialPicture> {
        let width_mm = self.width_m.map(|m| 1e3 * m);
        if !is_exr(&self.path) {
            let relief_mm = self.relief_mm;
            return Ok(MaterialPicture::read_png(
                &self.path,
                &PngSource {
                    width_mm,
                    relief_mm,
                },
            )?);
        }
        let source = HeightSource {
            channel: None,
            // Replaced below, once the number of columns is known.
            pitch_mm: width_mm.map(|_| 1.0),
            unit_mm: self.relief_mm,
        };
        let mut field = HeightField::read_exr(&self.path, &source)?;
        if let Some(width_mm) = width_mm {
            let [columns, _] = field.size();
            let heights = field.heights_mm().to_vec();
            field = HeightField::new(columns, width_mm / columns as f64, heights)?;
        }
        Ok(MaterialPicture::from_heights(&field)?)
    }
}

fn is_exr(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("exr"))
}

/// Proposals for pictures, smoothest first, with the levels of a session that holds these surfaces alone.
///
/// # Errors
/// A picture that cannot be read or carries no information; two pictures for one surface.
pub fn assign(images: &[Image], scale: &MaterialScale) -> anyhow::Result<Vec<Assigned>> {
    let mut assigned: Vec<Assigned> = Vec::with_capacity(images.len());
    for image in images {
        let name = || image.path.display().to_string();
        ensure!(
            assigned.iter().all(|other| other.surface != image.surface),
            "{}: {} has a picture already",
            name(),
            image.surface
        );
        let picture = image.read().with_context(name)?;
        assigned.push(Assigned {
            surface: image.surface.clone(),
            picture: image.path.clone(),
            proposal: scale.propose(&picture).with_context(name)?,
            level: None,
            certainty: None,
        });
    }
    assigned.sort_by(|a, b| a.proposal.roughness.total_cmp(&b.proposal.roughness));
    let mut roughness: Vec<f64> = assigned.iter().map(|a| two_digits(&a.proposal)).collect();
    roughness.dedup();
    let levels = TextureLevels::available()?;
    if roughness.len() <= levels.len() {
        let encoding = Encoding::new(&roughness, &levels)?;
        for one in &mut assigned {
            one.level = encoding.level_for(two_digits(&one.proposal)).copied();
        }
    }
    for i in 1..assigned.len() {
        let [one, other] = [i - 1, i].map(|i| &assigned[i].proposal);
        assigned[i].certainty = Some(order_certainty(one, other));
    }
    Ok(assigned)
}

/// The roughness to two digits: more would pretend an accuracy that a picture does not have.
fn two_digits(proposal: &RoughnessProposal) -> f64 {
    format!("{:.1e}", proposal.roughness)
        .parse()
        .unwrap_or(proposal.roughness)
}

const fn kind_name(kind: PictureKind) -> &'static str {
    match kind {
        PictureKind::Height => "heights",
        PictureKind::Albedo => "colour",
    }
}

fn describe(assigned: &[Assigned], out: &mut impl Write) -> anyhow::Result<()> {
    let columns: [Column<'_, &Assigned>; 9] = [
        ("surface", &|a| a.surface.clone()),
        ("picture", &|a| kind_name(a.proposal.kind).to_owned()),
        ("periods resolved, mm", &|a| {
            let [low, high] = a.proposal.relief.band_mm;
            format!("{low:.3} to {high:.2}")
        }),
        ("rms height, um", &|a| {
            format!("{:.1}", 1e3 * a.proposal.relief.height_mm)
        }),
        ("period, mm", &|a| {
            format!("{:.2}", a.proposal.relief.period_mm())
        }),
        ("roughness, P80 = 1", &|a| {
            two_digits(&a.proposal).to_string()
        }),
        ("90 % interval", &|a| {
            let [low, high] = a.proposal.interval();
            format!("{low:.2} to {high:.2}")
        }),
        ("level", &|a| match &a.level {
            Some(level) => {
                format!(
                    "{:.0} deg at {} mm/s",
                    level.scan.deg(),
                    level.speed_mm_per_s
                )
            }
            None => "more surfaces than levels".to_owned(),
        }),
        ("rougher than the one before", &|a| match a.certainty {
            Some(share) => format!("with probability {share:.2}"),
            None => String::new(),
        }),
    ];
    writeln!(out, "{}", table_of(assigned, &columns))?;
    let mut told: Vec<(String, Vec<&str>)> = Vec::new();
    for one in assigned {
        for caveat in one.proposal.caveats.iter().map(ToString::to_string) {
            match told.iter_mut().find(|(text, _)| *text == caveat) {
                Some((_, surfaces)) => surfaces.push(&one.surface),
                None => told.push((caveat, vec![&one.surface])),
            }
        }
    }
    for (caveat, surfaces) in told {
        writeln!(
            out,
            "not told by the picture of {}: {caveat}",
            surfaces.join(", ")
        )?;
    }
    Ok(())
}

fn to_json(assigned: &[Assigned]) -> Value {
    let one = |a: &Assigned| {
        let relief = &a.proposal.relief;
        json!({
            "surface": a.surface,
            "picture": a.picture.display().to_string(),
            "kind": kind_name(a.proposal.kind),
            "band_mm": relief.band_mm,
            "rms_height_mm": relief.height_mm,
            "rms_slope": relief.slope,
            "period_mm": relief.period_mm(),
            "roughness": a.proposal.roughness,
            "interval_90": a.proposal.interval(),
            "ln_sd": a.proposal.ln_sd,
            "level": a.level.map(|level| json!({
                "angle_deg": level.scan.deg(),
                "speed_mm_per_s": level.speed_mm_per_s,
            })),
            "rougher_than_before": a.certainty,
            "caveats": a.proposal.caveats.iter().map(ToString::to_string).collect::<Vec<_>>(),
        })
    };
    json!({ "unit": "sandpaper P80 = 1", "surfaces": assigned.iter().map(one).collect::<Vec<_>>() })
}

fn calibration(scale: &MaterialScale, out: &mut impl Write) -> anyhow::Result<()> {
    let columns: [Column<'_, &hwall_texton::SampleError>; 7] = [
        ("material", &|s| s.name.clone()),
        ("series", &|s| s.series.name().to_owned()),
        ("published", &|s| format!("{:.3}", s.magnitude)),
        ("rms height, um", &|s| {
            format!("{:.1}", 1e3 * s.relief.height_mm)
        }),
        ("period, mm", &|s| format!("{:.3}", s.relief.period_mm())),
        ("from the others, heights", &|s| {
            format!("{:.3}", s.left_out)
        }),
        ("from the others, shaded pictures", &|s| {
            let [low, high] = s.shaded;
            format!("{low:.3} to {high:.3}")
        }),
    ];
    writeln!(out, "{}", table_of(scale.samples(), &columns))?;
    let [p, q] = scale.exponents();
    writeln!(
        out,
        "roughness rises as (rms height)^{p:.2} (rms slope)^{q:.2}; all surfaces are synthesized, none was photographed"
    )?;
    for kind in [PictureKind::Height, PictureKind::Albedo] {
        let error = scale.error(kind);
        writeln!(
            out,
            "{}: a material left out is off by a factor of {:.2} (rms), the sandpapers from the gratings alone by {:.2}",
            kind_name(kind),
            error.material_ln.exp(),
            error.study_ln.exp()
        )?;
    }
    Ok(writeln!(out)?)
}

//! A roughness for each surface of a scene, proposed from pictures of its materials.

use crate::report::ends;
use anyhow::{Context, ensure};
use hwall::texture::TextureLevels;
use hwall_stage::input::file_plan::FilePlan;
use hwall_testkit::{Column, MarkdownTable, table_of};
use hwall_texton::{
    Encoding, HeightField, HeightSource, Level, MaterialPicture, MaterialSample, MaterialScale,
    PictureKind, PngSource, RoughnessProposal,
};
use serde_json::{Value, json};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use toml::Table;

/// Flags of the proposal.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct AssignArgs {
    /// Pictures of materials: FILE, SURFACE=FILE or SURFACE=FILE@WIDTH_M. PNG: colour or, with --height-map, heights; EXR: heights.
    /// Without SURFACE the name of the file without its ending names the surface
    #[arg(value_name = "IMAGE", required_unless_present = "calibration")]
    pub images: Vec<String>,
    /// Width of the area that a picture shows, m (for pictures without @WIDTH_M; EXR files may state it)
    #[arg(long, allow_negative_numbers = true)]
    pub width_m: Option<f64>,
    /// The PNG files contain heights
    #[arg(long, requires = "relief_mm")]
    pub height_map: bool,
    /// Height of white above black in a PNG height map, or of one unit in an EXR file without a scale, mm
    #[arg(long, allow_negative_numbers = true)]
    pub relief_mm: Option<f64>,
    /// Write the proposals as JSON
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write each proposed roughness into this sidecar of a scene; nothing else in it changes
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
    /// Orientation and speed of the released patch in a session with these surfaces; `None` if there are more surfaces than levels.
    pub level: Option<Level>,
    /// Probability that it is rougher than the surface before; `None` for the smoothest, and outside the calibration.
    pub certainty: Option<f64>,
}

impl Assigned {
    /// The roughness to two digits: more would pretend an accuracy that a picture does not have.
    #[must_use]
    pub fn roughness(&self) -> f64 {
        let exact = self.proposal.roughness;
        format!("{exact:.1e}").parse().unwrap_or(exact)
    }
}

/// Prints proposals, smoothest first, and writes their files.
///
/// # Errors
/// A picture that cannot be read or carries no information; a file that cannot be written.
pub fn run(args: &AssignArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let images: Vec<Image> = args.images.iter().map(|text| Image::of(text)).collect();
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
    let mut proposals = Vec::with_capacity(images.len());
    for image in images {
        let name = || image.path.display().to_string();
        let picture = image.read(args).with_context(name)?;
        let proposal = scale.propose(&picture).with_context(name)?;
        proposals.push((image.surface, image.path, proposal));
    }
    let assigned = assigned(proposals)?;
    describe(&assigned, out)?;
    if let Some(path) = &args.json {
        let text = serde_json::to_string_pretty(&to_json(&assigned))? + "\n";
        hwall_files::write(path, text).with_context(|| path.display().to_string())?;
    }
    let entries = assigned.iter().map(|a| (a.surface.as_str(), a.roughness()));
    if let Some(path) = &args.sidecar
        && write_roughness(path, entries)?
    {
        writeln!(out, "created {}", path.display())?;
    }
    Ok(())
}

/// A picture as named on the command line.
struct Image {
    surface: String,
    path: PathBuf,
    width_m: Option<f64>,
}

impl Image {
    fn of(text: &str) -> Self {
        let (surface, file) = text.split_once('=').unwrap_or(("", text));
        let own = |(file, width): (_, &str)| Some((file, Some(width.parse().ok()?)));
        let own = file.rsplit_once('@').and_then(own);
        let (file, width_m) = own.unwrap_or((file, None));
        let path = PathBuf::from(file);
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        Self {
            surface: if surface.is_empty() { &stem } else { surface }.to_owned(),
            width_m,
            path,
        }
    }

    fn read(&self, args: &AssignArgs) -> anyhow::Result<MaterialPicture> {
        let width_mm = self.width_m.or(args.width_m).map(|m| 1e3 * m);
        let ending = self.path.extension().unwrap_or_default();
        if !ending.eq_ignore_ascii_case("exr") {
            let relief_mm = args.relief_mm;
            ensure!(
                args.height_map == relief_mm.is_some(),
                "--relief-mm of a PNG needs --height-map: {} is a colour picture otherwise",
                self.path.display()
            );
            let source = PngSource {
                width_mm,
                relief_mm,
            };
            return Ok(MaterialPicture::read_png(&self.path, &source)?);
        }
        let source = HeightSource {
            channel: None,
            // Replaced below, once the number of columns is known.
            pitch_mm: width_mm.map(|_| 1.0),
            unit_mm: args.relief_mm,
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

/// Surfaces with their pictures and proposals, smoothest first, with the levels of a session that has only these surfaces.
///
/// # Errors
/// Two pictures for one surface.
pub fn assigned(
    proposals: impl IntoIterator<Item = (String, PathBuf, RoughnessProposal)>,
) -> anyhow::Result<Vec<Assigned>> {
    let mut all: Vec<Assigned> = Vec::new();
    for (surface, picture, proposal) in proposals {
        let known = all.iter().any(|one| one.surface == surface);
        ensure!(!known, "two pictures for the surface {surface}");
        all.push(Assigned {
            surface,
            picture,
            proposal,
            level: None,
            certainty: None,
        });
    }
    all.sort_by(|a, b| a.proposal.roughness.total_cmp(&b.proposal.roughness));
    let mut roughness: Vec<f64> = all.iter().map(Assigned::roughness).collect();
    roughness.dedup();
    // More surfaces than levels are not an error here: the proposals remain valid.
    if let Ok(encoding) = Encoding::new(&roughness, &TextureLevels::available()?) {
        for one in &mut all {
            one.level = encoding.level_for(one.roughness()).copied();
        }
    }
    for i in 1..all.len() {
        all[i].certainty = all[i].proposal.order_certainty(&all[i - 1].proposal);
    }
    Ok(all)
}

const fn name(kind: PictureKind) -> &'static str {
    match kind {
        PictureKind::Height => "heights",
        PictureKind::Albedo => "colour",
    }
}

fn range([low, high]: [f64; 2]) -> String {
    format!("{low:.3} to {high:.3}")
}

fn caveats(assigned: &Assigned) -> Vec<String> {
    let caveats = assigned.proposal.caveats.iter();
    caveats.map(ToString::to_string).collect()
}

/// The table of proposals.
pub fn table(assigned: &[Assigned]) -> MarkdownTable {
    let level = |l: &Level| format!("{:.0} deg, {} mm/s", l.scan.deg(), l.speed_mm_per_s);
    let certainty = |p: f64| format!("probability {p:.2}");
    let columns: [Column<'_, &Assigned>; 7] = [
        ("surface", &|a| a.surface.clone()),
        ("picture", &|a| name(a.proposal.kind).to_owned()),
        ("band, mm", &|a| range(a.proposal.relief.band_mm)),
        ("roughness, P80 = 1", &|a| a.roughness().to_string()),
        ("90 % interval", &|a| {
            let interval = a.proposal.interval();
            interval.map_or("unknown".into(), range)
        }),
        ("level", &|a| a.level.as_ref().map_or("none".into(), level)),
        ("rougher than before", &|a| {
            a.certainty.map_or(String::new(), certainty)
        }),
    ];
    table_of(assigned, &columns)
}

fn describe(assigned: &[Assigned], out: &mut impl Write) -> anyhow::Result<()> {
    writeln!(out, "{}", table(assigned))?;
    for one in assigned {
        writeln!(out, "{}: {}", one.surface, caveats(one).join("; "))?;
    }
    Ok(())
}

fn to_json(assigned: &[Assigned]) -> Value {
    let one = |a: &Assigned| {
        let (relief, level) = (&a.proposal.relief, a.level.as_ref());
        json!({
            "surface": a.surface,
            "picture": a.picture.display().to_string(),
            "kind": name(a.proposal.kind),
            "band_mm": relief.band_mm,
            "rms_height_mm": relief.height_mm,
            "rms_slope": relief.slope,
            "period_mm": relief.period_mm(),
            "roughness": a.proposal.roughness,
            "interval_90": a.proposal.interval(),
            "ln_sd": a.proposal.ln_sd,
            "level": level.map(|l| json!({ "angle_deg": l.scan.deg(), "speed_mm_per_s": l.speed_mm_per_s })),
            "rougher_than_before": a.certainty,
            "caveats": caveats(a),
        })
    };
    json!({ "unit": "sandpaper P80 = 1", "surfaces": assigned.iter().map(one).collect::<Vec<_>>() })
}

fn calibration(scale: &MaterialScale, out: &mut impl Write) -> anyhow::Result<()> {
    let predicted = |kind: PictureKind| {
        move |s: &&MaterialSample| {
            let (low, high) = ends(s.left_out[kind as usize].iter().copied());
            range([low, high])
        }
    };
    let [heights, shaded] = PictureKind::ALL.map(predicted);
    let columns: [Column<'_, &MaterialSample>; 5] = [
        ("material", &|s| s.name.clone()),
        ("series", &|s| s.series.name().to_owned()),
        ("published", &|s| format!("{:.3}", s.magnitude)),
        ("from the others, heights", &heights),
        ("from the others, shaded", &shaded),
    ];
    let [p, q] = scale.exponents();
    let table = table_of(scale.samples(), &columns);
    writeln!(
        out,
        "{table}\nroughness rises as (rms height)^{p:.2} (rms slope)^{q:.2}; all surfaces are synthesized, none was photographed"
    )?;
    for kind in PictureKind::ALL {
        let error = scale.error(kind);
        let [material, study] = [error.material_ln, error.study_ln].map(f64::exp);
        writeln!(
            out,
            "{}: a material left out is off by a factor of {material:.2} (rms), the sandpapers from the gratings alone by {study:.2}",
            name(kind)
        )?;
    }
    Ok(writeln!(out)?)
}

/// Sets the key `roughness` of surfaces in a sidecar, and creates a missing file. All other lines are unchanged. Returns whether the file is new.
///
/// # Errors
/// A file that is not TOML; a surface whose entry is not a table `[surface.NAME]` of its own; a file that cannot be written.
fn write_roughness<'a>(
    path: &Path,
    entries: impl IntoIterator<Item = (&'a str, f64)>,
) -> anyhow::Result<bool> {
    let name = || path.display().to_string();
    let (mut text, is_new) = match std::fs::read_to_string(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => (String::new(), true),
        read => (read.with_context(name)?, false),
    };
    for (surface, roughness) in entries {
        text = with_roughness(&text, surface, roughness).with_context(name)?;
    }
    hwall_files::write(path, text).with_context(name)?;
    Ok(is_new)
}

fn with_roughness(text: &str, surface: &str, roughness: f64) -> anyhow::Result<String> {
    let before: Table = text.parse()?;
    let line = format!("roughness = {roughness:?}");
    let mut lines: Vec<&str> = text.lines().collect();
    let header = format!("[surface.{}]", key(surface));
    match lines.iter().position(|l| l.trim().starts_with(&header)) {
        Some(start) => {
            let own = lines[start + 1..]
                .iter()
                .take_while(|l| !l.trim().starts_with('['));
            let place = own.clone().position(|l| {
                let name = l.split_once('=').map(|(name, _)| name.trim());
                name == Some("roughness")
            });
            match place {
                Some(place) => lines[start + 1 + place] = &line,
                None => lines.insert(start + 1, &line),
            }
        }
        None => lines.extend(["", &header, &line]),
    }
    let end = if text.contains("\r\n") { "\r\n" } else { "\n" };
    let after = lines.join(end) + end;
    // The lines were found without a parser, so check the result with one.
    let mut wanted = before;
    let surfaces = wanted
        .entry("surface")
        .or_insert_with(|| toml::Value::Table(Table::new()));
    let table = surfaces.as_table_mut().context("surface is no table")?;
    let entry = table
        .entry(surface)
        .or_insert_with(|| toml::Value::Table(Table::new()));
    let entry = entry
        .as_table_mut()
        .with_context(|| format!("surface.{surface} is no table"))?;
    entry.insert("roughness".to_owned(), toml::Value::Float(roughness));
    ensure!(
        after.parse::<Table>().ok() == Some(wanted),
        "surface {surface} is not a table {header} of its own: write {line} there by hand"
    );
    Ok(after)
}

/// A name as a TOML key: bare if possible, else a basic string.
fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    if !name.is_empty() && name.chars().all(bare) {
        return name.to_owned();
    }
    // Strings of JSON are basic strings of TOML.
    serde_json::Value::from(name).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_is_changed_made_or_refused_and_all_else_stays() {
        let text = "# A room.\n\n[surface.door] # wood\nkind = \"static\"\nroughness = 0.4 # by hand\n\n[surface.floor]\nkind = \"untouchable\"\n";
        let changed = with_roughness(text, "door", 1.5).unwrap();
        assert_eq!(changed, text.replace("0.4 # by hand", "1.5"));
        let windows = text.replace('\n', "\r\n");
        let changed = with_roughness(&windows, "door", 1.5).unwrap();
        assert_eq!(changed, windows.replace("0.4 # by hand", "1.5"));
        let added = with_roughness(text, "floor", 2.0).unwrap();
        let entry = "[surface.floor]\nroughness = 2.0\nkind";
        assert!(added.contains(entry), "{added}");
        let made = with_roughness(text, "the \"wall\"", 0.021).unwrap();
        let entry = "[surface.\"the \\\"wall\\\"\"]\nroughness = 0.021\n";
        assert!(made.starts_with(text) && made.ends_with(entry), "{made}");
        let alone = with_roughness("", "a", 1.0).unwrap();
        assert_eq!(alone, "\n[surface.a]\nroughness = 1.0\n");
        for inline in [
            "surface = { door = { roughness = 1 } }\n",
            "[surface]\ndoor.kind = \"static\"\n",
        ] {
            let refused = with_roughness(inline, "door", 1.0).unwrap_err().to_string();
            assert!(refused.contains("by hand"), "{refused}");
        }
        assert!(with_roughness("[", "a", 1.0).is_err());
    }
}

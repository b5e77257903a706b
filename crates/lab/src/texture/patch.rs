//! From command-line flags to a patch, its files and its tables.

use crate::texture::wanted::{PrinterKind, WantedArgs};
use crate::texture::{fineness, patch_figures, strokes};
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use hwall_stage::arms::parse_list;
use hwall_stage::input::file_plan::FilePlan;
use hwall_stage::numbers::{count_within, counted};
use hwall_testkit::format_ns;
use hwall_texton::{
    ChordSide, Finding, Layout, MountingHole, Patch, PatchSpec, Printer, Radii, StlFormat,
    Tessellation, Texton, Texture, Tile, glam::DVec2,
};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Profile of a bump.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Shape {
    /// The upper half of an ellipsoid
    Ellipsoid,
    /// A truncated elliptic cone, sides of 45 degrees
    Cone,
}

/// Arrangement of the bumps on the plate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Grid {
    /// In straight rows and columns
    Rectangular,
    /// Every second row shifted by half the long pitch
    Staggered,
}

/// Which patch, and which files, as flags of a command line.
#[derive(Debug, Clone, clap::Args)]
pub struct Request {
    /// The roughnesses for which the texture is designed.
    #[command(flatten)]
    pub wanted: WantedArgs,
    /// released, study-1.5, study-2, study-2.5, study-3, spaced-3 (text of the dissertation), or long radius, short radius,
    /// height, long pitch, short pitch in mm: RX,RY,H,PX,PY
    #[arg(long, default_value = "released", conflicts_with = "wished")]
    pub preset: String,
    /// Size in mm, one number or X,Y [default: 200 for the released patch, else 50]
    #[arg(long, value_delimiter = ',', num_args = 1..=2, allow_negative_numbers = true)]
    pub size_mm: Vec<f64>,
    /// Largest distance of the mesh from the true surface, micrometres, 1 to 1000
    #[arg(long, default_value_t = 10.0, allow_negative_numbers = true)]
    pub accuracy_um: f64,
    /// Allow triangles on both sides of the surface within the accuracy: half as many (ellipsoids)
    #[arg(long)]
    pub both_sides: bool,
    /// Shape of the bumps
    #[arg(long, value_enum, default_value_t = Shape::Ellipsoid)]
    pub texton: Shape,
    /// Arrangement of the bumps; staggered shifts every second row by half the long pitch
    #[arg(long, value_enum, default_value_t = Grid::Rectangular)]
    pub layout: Grid,
    /// Thickness of the plate, mm
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub plate_mm: f64,
    /// Mounting hole X,Y,DIAMETER in mm; may be repeated
    #[arg(long)]
    pub hole: Vec<String>,
    /// Size of the tiles in mm, one number or X,Y; no bump crosses their borders
    #[arg(long, value_delimiter = ',', num_args = 1..=2, default_value = "100", allow_negative_numbers = true)]
    pub tile_mm: Vec<f64>,
    /// Continue the grid across tiles instead of restarting it on each
    #[arg(long)]
    pub continuous: bool,
    /// Write meshes and pictures of each tile (NAME-1.stl, ...) instead of the whole
    #[arg(long)]
    pub tiles: bool,
    /// Write the mesh as STL
    #[arg(long)]
    pub stl: Option<PathBuf>,
    /// STL as text
    #[arg(long, requires = "stl")]
    pub ascii: bool,
    /// Write the mesh as OBJ
    #[arg(long)]
    pub obj: Option<PathBuf>,
    /// Write the heights as EXR, and the normals as NAME-normals.exr in the same folder
    #[arg(long)]
    pub exr: Option<PathBuf>,
    /// Distance between pixels, micrometres
    #[arg(long, default_value_t = 100.0, allow_negative_numbers = true)]
    pub pixel_um: f64,
    /// Instead of making a patch, simulate this many strokes of each kind, straight and curved, over the released patch on a simulated arm
    #[arg(long, value_name = "N", exclusive = true, value_parser = count_within::<1, 10_000>, allow_negative_numbers = true)]
    pub strokes: Option<usize>,
    /// Instead, compare the finest bumps of printers with the resolution of the skin
    #[arg(long, exclusive = true)]
    pub finest: bool,
    /// Folder for figures: the patch from above and from the side, spacing and width over orientation
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Seed of the strokes.
const SEED: u64 = 1;
/// Names of the figures: views from above and from the side; spacing and width over orientation.
const FIGURES: [&str; 2] = ["texture_patch.svg", "texture_spacing.svg"];

/// Creates the patch, prints its description and writes the requested files.
///
/// # Errors
/// Invalid dimensions, files that cannot be written.
pub fn run(request: &Request, out: &mut impl Write) -> anyhow::Result<()> {
    if let Some(count) = request.strokes {
        let felt = strokes::run(SEED, count)?;
        return Ok(writeln!(out, "{}", strokes::table(&felt))?);
    }
    if request.finest {
        return Ok(writeln!(out, "{}", fineness::table()?)?);
    }
    FilePlan::default()
        .write("--stl", request.stl.as_deref())
        .write("--obj", request.obj.as_deref())
        .write("--exr", request.exr.as_deref())
        .write_into("--out", request.out.as_deref(), &FIGURES)
        .check()?;
    let texture = match request.wanted.texture(out)? {
        Some(texture) => texture,
        None => texture(request)?,
    };
    let patch = patch(request, texture)?;
    let ask = tessellation(request)?;
    describe(&patch, out)?;
    let whole = || Tile {
        corner_mm: DVec2::ZERO,
        patch: patch.clone(),
    };
    let tiles = match request.tiles {
        true => patch.tiles(),
        false => vec![whole()],
    };
    if let Some(folder) = &request.out {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    for (k, Tile { corner_mm, patch }) in tiles.iter().enumerate() {
        if request.tiles {
            let DVec2 { x, y } = corner_mm;
            writeln!(out, "\ntile {} at {x}, {y} mm", k + 1)?;
        }
        let name = |path: &Path| match request.tiles {
            true => numbered(path, &format!("-{}", k + 1)),
            false => path.to_owned(),
        };
        mesh(request, patch, &ask, &name, out)?;
        if let Some(path) = request.exr.as_deref().map(&name) {
            let field = patch.height_field(1e-3 * request.pixel_um)?;
            field.write_exr(&path)?;
            let normals = numbered(&path, "-normals");
            field.write_normal_exr(&normals)?;
            writeln!(out, "wrote {} and {}", path.display(), normals.display())?;
        }
    }
    let check = print_check(&patch, &texture, request.wanted.printer);
    writeln!(out, "\n{check}\n{}", patch_figures::encounters(&texture)?)?;
    if let Some(folder) = &request.out {
        let (plan, spacing) = (folder.join(FIGURES[0]), folder.join(FIGURES[1]));
        patch_figures::plan(&plan, &patch)?;
        patch_figures::spacing(&spacing, &texture)?;
        writeln!(out, "wrote {} and {}", plan.display(), spacing.display())?;
    }
    Ok(())
}

fn tessellation(request: &Request) -> anyhow::Result<Tessellation> {
    let accuracy_um = request.accuracy_um;
    ensure!(
        (1.0..=1000.0).contains(&accuracy_um),
        "--accuracy-um is {accuracy_um}, it must lie in 1 to 1000"
    );
    Ok(Tessellation {
        accuracy_mm: 1e-3 * accuracy_um,
        side: match request.both_sides {
            true => ChordSide::Both,
            false => ChordSide::Inside,
        },
        ..Tessellation::default()
    })
}

/// A file name with `more` before its extension.
fn numbered(path: &Path, more: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut name = format!("{stem}{more}");
    if let Some(extension) = path.extension() {
        name = format!("{name}.{}", extension.to_string_lossy());
    }
    path.with_file_name(name)
}

fn texture(request: &Request) -> anyhow::Result<Texture> {
    let preset = match request.preset.as_str() {
        "released" => Some(Texture::released()),
        "study-1.5" => Some(Texture::study_1_5()),
        "study-2" => Some(Texture::study_2()),
        "study-2.5" => Some(Texture::study_2_5()),
        "study-3" => Some(Texture::study_3()),
        "spaced-3" => Some(Texture::spaced_3_mm()),
        _ => None,
    };
    let [long, short, height_mm, long_mm, short_mm] = match preset {
        Some(preset) => {
            let [long, short] = preset.texton().radii().to_array();
            let [long_mm, short_mm] = preset.layout().pitch_mm();
            [long, short, preset.texton().height_mm(), long_mm, short_mm]
        }
        None => parse_list(&request.preset).with_context(|| {
            format!(
                "--preset {}: neither released, study-1.5, study-2, study-2.5, study-3, \
                 spaced-3 nor RX,RY,H,PX,PY in mm",
                request.preset
            )
        })?,
    };
    let radii = Radii {
        long_mm: long,
        short_mm: short,
    };
    let texton = match request.texton {
        Shape::Ellipsoid => Texton::hemiellipsoid(radii, height_mm)?,
        Shape::Cone => Texton::truncated_cone(radii, height_mm)?,
    };
    let layout = match request.layout {
        Grid::Rectangular => Layout::Rectangular { long_mm, short_mm },
        Grid::Staggered => Layout::Staggered { long_mm, short_mm },
    };
    Ok(Texture::new(texton, layout)?)
}

/// One number for both axes, or one for each.
fn pair(numbers: &[f64]) -> anyhow::Result<[f64; 2]> {
    match *numbers {
        [one] => Ok([one, one]),
        [x, y] => Ok([x, y]),
        _ => bail!("{} numbers, wanted one or two", numbers.len()),
    }
}

fn patch(request: &Request, texture: Texture) -> anyhow::Result<Patch> {
    let size_mm = match (&request.size_mm[..], request.preset.as_str()) {
        ([], "released") if !request.wanted.is_given() => [200.0; 2],
        ([], _) => [50.0; 2],
        (numbers, _) => pair(numbers).context("--size-mm")?,
    };
    let holes = request.hole.iter().map(|text| {
        let [x, y, diameter_mm] = parse_list(text).context("--hole")?;
        Ok(MountingHole {
            centre_mm: DVec2::new(x, y),
            diameter_mm,
        })
    });
    let spec = PatchSpec {
        size_mm,
        plate_mm: request.plate_mm,
        tile_mm: Some(pair(&request.tile_mm).context("--tile-mm")?),
        restart: !request.continuous,
        holes: holes.collect::<anyhow::Result<_>>()?,
        ..PatchSpec::default()
    };
    Ok(Patch::new(texture, spec)?)
}

fn describe(patch: &Patch, out: &mut impl Write) -> anyhow::Result<()> {
    let texture = patch.texture();
    let [a, b] = texture.texton().radii().to_array();
    // Round the many digits of a design's pitches.
    let [long, short] = texture.layout().pitch_mm().map(|p| (1e4 * p).round() / 1e4);
    let [x, y] = patch.spec().size_mm;
    writeln!(
        out,
        "patch {x} x {y} mm on a plate of {} mm: {} bumps of {a} x {b} mm radius, {} mm high, pitch {long} x \
         {short} mm, gap {:.3} mm, {:.1} % covered",
        patch.spec().plate_mm,
        patch.counts().placed,
        texture.texton().height_mm(),
        texture.gap_mm(),
        100.0 * patch.coverage()
    )?;
    Ok(())
}

/// Can the patch be printed as designed? One verdict, and every reason.
fn print_check(patch: &Patch, texture: &Texture, kind: Option<PrinterKind>) -> String {
    let printer = Printer::default();
    let findings = patch.print_check(&printer);
    let (faults, notes): (Vec<Finding>, Vec<Finding>) =
        findings.into_iter().partition(Finding::is_fault);
    let is_sound = faults.is_empty();
    let has_tile = faults
        .iter()
        .chain(&notes)
        .any(|f| matches!(f, Finding::Tile { .. }));
    let mut faults: Vec<String> = faults.iter().map(Finding::to_string).collect();
    let named = kind.map_or(PrinterKind::value_variants().to_vec(), |kind| vec![kind]);
    let names: Vec<&str> = named.iter().map(|kind| kind.name()).collect();
    let mut able = Vec::new();
    for (kind, name) in named.iter().zip(&names) {
        let lacks = kind.lacks(texture);
        if lacks.is_empty() {
            able.push(*name);
        }
        faults.extend(lacks.iter().map(|lack| format!("{name}: {lack}")));
    }
    let by = kind.map_or("no printer chosen", PrinterKind::name);
    let count = counted(faults.len(), "fault", "faults");
    let verdict = match (is_sound && !able.is_empty(), kind) {
        (true, Some(_)) => "can be printed as designed".to_owned(),
        (true, None) => format!("can be printed as designed by {}", able.join(", ")),
        (false, _) => format!("cannot be printed as designed, {count}"),
    };
    let mut text = format!("print check, {by}: {verdict}\n");
    for fault in &faults {
        text += &format!("  fault: {fault}\n");
    }
    if is_sound && able.is_empty() {
        text += &format!(
            "  by the usual limits of {}; a printer of {} mm details could\n",
            names.join(", "),
            printer.least_feature_mm
        );
    }
    for note in notes {
        text += &format!("  note: {note}\n");
    }
    if has_tile {
        text += "  --tile-mm cuts the patch into smaller tiles\n";
    }
    text
}

fn mesh(
    request: &Request,
    patch: &Patch,
    ask: &Tessellation,
    name: &dyn Fn(&Path) -> PathBuf,
    out: &mut impl Write,
) -> anyhow::Result<()> {
    let start = Instant::now();
    let mesh = patch.mesh(ask)?;
    let took = start.elapsed();
    let check = mesh.check();
    let error_mm = patch.chord_error_mm(&mesh);
    let off = check.volume_mm3 - patch.volume_mm3();
    writeln!(
        out,
        "mesh: {} triangles, {} points, in {}\n\
         watertight: {} (open edges {}, doubled edges {}, pinched points {}, empty triangles {}; Euler \
         characteristic {})\n\
         chord error: {:.3} um measured, {:.3} um asked\n\
         volume: {:.3} mm3, exact {:.3} mm3 ({off:+.3} mm3, {:+.3} %)",
        check.triangles,
        check.points,
        format_ns(took.as_nanos() as f64),
        if check.is_solid() { "yes" } else { "NO" },
        check.open_edges,
        check.doubled_edges,
        check.pinched_points,
        check.degenerate,
        check.euler,
        1e3 * error_mm,
        1e3 * ask.accuracy_mm,
        check.volume_mm3,
        patch.volume_mm3(),
        100.0 * off / patch.volume_mm3(),
    )?;
    if let Some(path) = request.stl.as_deref().map(name) {
        let format = match request.ascii {
            true => StlFormat::Ascii,
            false => StlFormat::Binary,
        };
        mesh.write_stl(&path, format)?;
        writeln!(out, "wrote {}", path.display())?;
    }
    if let Some(path) = request.obj.as_deref().map(name) {
        mesh.write_obj(&path)?;
        writeln!(out, "wrote {}", path.display())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, Command, FromArgMatches};

    fn request(preset: &str) -> Request {
        let line = [
            "",
            "--size-mm=20,10",
            "--accuracy-um=50",
            "--preset",
            preset,
        ];
        let command = Request::augment_args(Command::new(""));
        Request::from_arg_matches(&command.get_matches_from(line)).unwrap()
    }

    fn said(request: &Request) -> String {
        let mut text = Vec::new();
        run(request, &mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn every_preset_prints_its_table() {
        let named = "released study-1.5 study-2 study-2.5 study-3 spaced-3".split(' ');
        for preset in named.chain(["3,1,0.7,6.2,2.2"]) {
            let text = said(&request(preset));
            let is_whole = text.contains("watertight: yes") && text.contains("63.43");
            assert!(is_whole, "{text}");
        }
    }

    /// Regression: it reported "0 faults" and then that the printer cannot print it.
    #[test]
    fn there_is_one_verdict_about_printing() {
        let by = |preset: &str, printer: Option<PrinterKind>| {
            let mut asked = request(preset);
            asked.wanted.printer = printer;
            let text = said(&asked);
            assert_eq!(text.matches("be printed as designed").count(), 1, "{text}");
            text
        };
        let coarse = by("released", Some(PrinterKind::Fdm));
        assert!(coarse.contains("print check, fdm: cannot"), "{coarse}");
        assert!(coarse.contains("2 faults"), "{coarse}");
        assert_eq!(coarse.matches("  fault: ").count(), 2);
        // Regression: without a chosen printer it was reported as printable, although every printer refuses it.
        let any = by("released", None);
        assert!(any.contains("no printer chosen: cannot"), "{any}");
        let mut can: Vec<PrinterKind> = Vec::new();
        for kind in PrinterKind::value_variants() {
            let alone = by("released", Some(*kind));
            can.extend((!alone.contains("cannot")).then_some(*kind));
            for fault in alone.lines().filter(|line| line.contains("fault: ")) {
                assert!(any.contains(fault), "{any}");
            }
        }
        assert!(can.is_empty(), "{can:?}");
        let wide = by("3,1,0.9,8,4", None);
        let can = "no printer chosen: can be printed as designed by fdm, sla, polyjet";
        assert!(wide.contains(can), "{wide}");
    }

    #[test]
    fn malformed_flags_are_refused() {
        // The first of them is empty.
        for preset in " study-4 3,1,0.7,6.2 3,1,0.7,6.2,x 3,1,0.7,5,2.2".split(' ') {
            assert!(run(&request(preset), &mut Vec::new()).is_err(), "{preset}");
        }
        let hole = Request {
            hole: vec!["1,2".to_owned()],
            ..request("released")
        };
        assert!(run(&hole, &mut Vec::new()).is_err());
        for accuracy_um in [0.0, -1.0, 2000.0, f64::NAN] {
            let fine = Request {
                accuracy_um,
                ..request("released")
            };
            let said = run(&fine, &mut Vec::new()).unwrap_err().to_string();
            assert!(said.contains("--accuracy-um"), "{said}");
        }
    }

    #[test]
    fn names_are_numbered_before_their_extension() {
        assert_eq!(numbered(Path::new("a/b.stl"), "-1"), Path::new("a/b-1.stl"));
        assert_eq!(numbered(Path::new("b"), "-1"), Path::new("b-1"));
    }
}

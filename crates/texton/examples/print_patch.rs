//! A bumpy board to print: is its mesh closed, how exact is it, and can a printer make it?
//!
//! `cargo run --release -p hwall-texton --example print_patch` (or `-- patch.stl` to keep it)

use hwall_texton::{
    Patch, PatchSpec, Printer, ScanAngle, StlFormat, Tessellation, TextonError, Texture,
};

fn main() -> Result<(), TextonError> {
    let spec = PatchSpec {
        size_mm: [50.0, 50.0],
        ..PatchSpec::default()
    };
    let patch = Patch::new(Texture::released(), spec)?;
    let counts = patch.counts();
    println!(
        "{} bumps, {} left out at the border",
        counts.placed, counts.at_border
    );
    for finding in patch.print_check(&Printer::default()) {
        let weight = if finding.is_fault() { "fault" } else { "note" };
        println!("{weight}: {finding}");
    }

    let mesh = patch.mesh(&Tessellation::with_accuracy_mm(0.01))?;
    println!(
        "{} triangles, solid: {}, {:.1} µm off the true surface, {:.0} mm³",
        mesh.triangles().len(),
        mesh.check().is_solid(),
        1e3 * patch.chord_error_mm(&mesh),
        patch.volume_mm3()
    );

    // The bumps a finger meets depend on its direction.
    println!("angle  spacing  bumps a second at 40 mm/s");
    for deg in [0.0, 45.0, 63.43, 90.0] {
        let scan = ScanAngle::from_deg(deg)?;
        let spacing = patch.texture().spacing_mm(scan);
        let spacing = spacing.map_or("-".to_owned(), |mm| format!("{mm:.2} mm"));
        let per_s = patch.texture().encounter_frequency_hz(scan, 40.0);
        println!("{deg:5}  {spacing:>7}  {per_s:.1}");
    }
    if let Some(path) = std::env::args().nth(1) {
        mesh.write_stl(&path, StlFormat::Binary)?;
        println!("wrote {path}");
    }
    Ok(())
}

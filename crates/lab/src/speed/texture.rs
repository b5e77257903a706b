//! Triangles and time against chord error of the released patch.

use crate::speed::section::{Section, quoted};
use hwall_testkit::{format_ns, time_each, titled};
use hwall_texton::{Patch, PatchSpec, Tessellation, Texture};

/// Requested chord errors, mm.
const ACCURACIES_MM: [f64; 6] = [0.001, 0.003, 0.01, 0.03, 0.1, 1.0];

/// The released patch of 2,880 bumps at every accuracy.
///
/// # Errors
/// Errors of meshing.
pub fn tessellation() -> anyhow::Result<Section> {
    let patch = Patch::released();
    let mut table = titled(
        "asked | triangles | time | chord error measured | volume off | one watertight solid",
    );
    let mut summary = Vec::new();
    for accuracy_mm in ACCURACIES_MM {
        let ask = Tessellation {
            accuracy_mm,
            ..Tessellation::default()
        };
        let timing = time_each(5, |_| patch.mesh(&ask));
        let check = patch.mesh(&ask)?.check();
        let error_um = 1e3 * measured_mm(&ask)?;
        let volume_off = check.volume_mm3 / patch.volume_mm3() - 1.0;
        table.row([
            format!("{} µm", 1e3 * accuracy_mm),
            check.triangles.to_string(),
            format_ns(timing.median_ns),
            format!("{error_um:.2} µm"),
            format!("{:+.3} %", 100.0 * volume_off),
            if check.is_solid() { "yes" } else { "NO" }.to_owned(),
        ]);
        if accuracy_mm == 0.01 {
            let error = format!("{error_um:.1} µm chord error");
            summary.push(quoted("texton", "mesh of 2,880 bumps", &timing, error));
        }
    }
    Section::of(include_str!("text/texture.md"), summary).filled(&[("table", &table)])
}

/// All bumps are equal: measured on a patch of few.
fn measured_mm(ask: &Tessellation) -> anyhow::Result<f64> {
    let few = PatchSpec {
        size_mm: [19.0, 9.0],
        ..PatchSpec::default()
    };
    let few = Patch::new(Texture::released(), few)?;
    Ok(few.chord_error_mm(&few.mesh(ask)?))
}

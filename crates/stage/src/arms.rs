//! Arms by name or URDF file, for the command line.

use anyhow::{Context, bail};
use hwall_kinematics::{Chain, SrsArm};
use std::path::Path;

/// `iiwa7`, `iiwa14` or the path of a URDF file, as a general chain with its inertials.
///
/// # Errors
/// An unknown name, or a file that cannot be read as URDF.
pub fn chain(name: &str) -> anyhow::Result<Chain> {
    match name {
        "iiwa7" => Ok(Chain::iiwa7()),
        "iiwa14" => Ok(Chain::iiwa14()),
        path if path.to_ascii_lowercase().ends_with(".urdf") => {
            Ok(Chain::from_urdf_file(Path::new(path), None, None)?)
        }
        other => bail!("--arm {other}: expected iiwa7, iiwa14 or a path that ends in .urdf"),
    }
}

/// `iiwa7` or `iiwa14`, in closed form.
///
/// # Errors
/// An unknown name.
pub fn closed_form(name: &str) -> anyhow::Result<SrsArm> {
    match name {
        "iiwa7" => Ok(SrsArm::iiwa7()),
        "iiwa14" => Ok(SrsArm::iiwa14()),
        other => bail!("--arm {other}: expected iiwa7 or iiwa14"),
    }
}

/// `x,y,...` as exactly `N` finite numbers.
///
/// # Errors
/// Another count, or a value that is no finite number.
pub fn parse_list<const N: usize>(text: &str) -> anyhow::Result<[f64; N]> {
    let values: Vec<f64> = text
        .split(',')
        .map(|part| {
            let value: f64 = part
                .trim()
                .parse()
                .with_context(|| format!("{part:?} is no number"))?;
            anyhow::ensure!(value.is_finite(), "{part:?} is not finite");
            Ok(value)
        })
        .collect::<anyhow::Result<_>>()?;
    let count = values.len();
    values
        .try_into()
        .map_err(|_| anyhow::anyhow!("expected {N} numbers, got {count}"))
}

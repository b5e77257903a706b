//! Rows of joint torques that hold until the next row.

use crate::input::numbers::{list, numbered};
use anyhow::{Context, ensure};
use hwall_kinematics::Chain;
use hwall_sim::HeldTorques;
use std::io::BufRead;

/// Reads `t,tau1..tauN` (s, N m) to the end, with or without that header; no rows are no torques. `saturate` limits them to what the
/// joints allow.
///
/// # Errors
/// Another header, a row that is not as many finite numbers, or a time that does not rise; names the line.
pub fn read(
    source: impl BufRead,
    name: &str,
    chain: &Chain,
    saturate: bool,
) -> anyhow::Result<HeldTorques> {
    let n = chain.joint_count();
    let mut header = vec!["t".to_owned()];
    header.extend(numbered("tau", n));
    let mut held = HeldTorques::new(n);
    let mut first = true;
    for (index, line) in source.lines().enumerate() {
        let place = || format!("{name} line {}", index + 1);
        let line = line.with_context(place)?;
        let text = line.trim_start_matches('\u{feff}').trim();
        if text.is_empty() {
            continue;
        }
        let cells = text.split(',').map(str::trim);
        if std::mem::take(&mut first) && text.starts_with(char::is_alphabetic) {
            let named = cells.eq(header.iter());
            ensure!(
                named,
                "{}: the header must be {}",
                place(),
                header.join(",")
            );
            continue;
        }
        let mut row = list(text, n + 1).with_context(place)?;
        if saturate {
            for (torque, joint) in row[1..].iter_mut().zip(chain.joints()) {
                let most = joint.max_effort.unwrap_or(f64::INFINITY);
                *torque = torque.clamp(-most, most);
            }
        }
        held.push(row[0], &row[1..]).with_context(place)?;
    }
    Ok(held)
}

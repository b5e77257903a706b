//! Rows of joint torques that hold until the next row.

use crate::input::numbers::{NumberReader, numbered, refused};
use anyhow::Context;
use hwall_files::{Table, TableError};
use hwall_kinematics::Chain;
use hwall_sim::HeldTorques;
use std::io::BufRead;

/// Reads `t,tau1..tauN` (s, N m) to the end, with or without that header; no rows mean no torques. `saturate` limits them to the
/// joints' limits.
///
/// # Errors
/// A missing column, a row without exactly that many finite numbers, or a time that does not increase; names the line.
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
    let names: Vec<&str> = header.iter().map(String::as_str).collect();
    let table = match Table::with_names(source, &names) {
        Err(TableError::Empty) => return Ok(held),
        table => table.map_err(|error| refused(name, error))?,
    };
    let mut reader = NumberReader::of(name.to_owned(), table);
    let places = reader.columns(&header)?;
    while let Some(row) = reader.next_row()? {
        let mut values = reader.values(&row, &places)?;
        if saturate {
            for (torque, joint) in values[1..].iter_mut().zip(chain.joints()) {
                let most = joint.max_effort.unwrap_or(f64::INFINITY);
                *torque = torque.clamp(-most, most);
            }
        }
        let place = || reader.place(&row);
        held.push(values[0], &values[1..]).with_context(place)?;
    }
    Ok(held)
}

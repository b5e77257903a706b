//! The matrix as a figure.

use super::fault::Phase;
use super::outcome::{Bounds, Outcome, Reached};
use hwall_stage::report::figure::{Draw, figure};
use hwall_stage::run::simulated_arm::ArmLevel;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::path::Path;

const ROW: i32 = 17;
const COLUMN: i32 = 92;
const LEFT: i32 = 230;
const TOP: i32 = 96;

/// Colours distinguishable without red and green, from no reaction to stopped.
const fn colour(reached: Reached) -> RGBColor {
    match reached {
        Reached::WentOn => RGBColor(238, 238, 238),
        Reached::Slowed => RGBColor(255, 237, 160),
        Reached::Holding => RGBColor(158, 202, 225),
        Reached::Retreating => RGBColor(253, 174, 97),
        Reached::Compliant => RGBColor(194, 165, 207),
        Reached::Stopped => RGBColor(49, 110, 176),
    }
}

/// Faults in rows, phases in columns; in each cell the time to the first safe state in ms, framed if something is wrong.
///
/// # Errors
/// A file that cannot be written.
pub fn matrix(
    path: &Path,
    outcomes: &[Outcome],
    level: ArmLevel,
    bounds: &Bounds,
) -> anyhow::Result<()> {
    let own: Vec<&Outcome> = outcomes.iter().filter(|o| o.level == level).collect();
    let mut faults: Vec<String> = own.iter().map(|o| o.fault.name()).collect();
    faults.dedup();
    let width = LEFT + COLUMN * Phase::ALL.len() as i32 + 16;
    let height = TOP + ROW * faults.len() as i32 + 16;
    figure(path, (width as u32, height as u32), |root| {
        let write = |text: &str, at: (i32, i32), size: i32, colour: RGBColor, h: HPos| {
            let style = ("sans-serif", size).into_font().color(&colour);
            let style = style.pos(Pos::new(h, VPos::Center));
            root.put(&Text::new(text.to_owned(), at, style))
        };
        let name = format!("{level:?}").to_lowercase();
        let title = format!("Safe states, {name} level: ms from the fault to the first of them");
        write(&title, (16, 18), 16, BLACK, HPos::Left)?;
        for (index, reached) in Reached::ALL.into_iter().enumerate() {
            let x = 16 + 108 * index as i32;
            let filled = colour(reached).filled();
            root.put(&Rectangle::new([(x, 36), (x + 14, 50)], filled))?;
            write(reached.name(), (x + 20, 43), 13, BLACK, HPos::Left)?;
        }
        let x = 16 + 108 * Reached::ALL.len() as i32;
        let frame = RED.stroke_width(2);
        root.put(&Rectangle::new([(x, 36), (x + 14, 50)], frame))?;
        write("not as asked for", (x + 20, 43), 13, BLACK, HPos::Left)?;
        for (column, phase) in Phase::ALL.into_iter().enumerate() {
            let x = LEFT + COLUMN * column as i32 + COLUMN / 2;
            let short = phase.name().split(',').next().unwrap_or_default();
            write(short, (x, TOP - 14), 12, BLACK, HPos::Center)?;
        }
        for (row, fault) in faults.iter().enumerate() {
            let y = TOP + ROW * row as i32;
            write(fault, (LEFT - 8, y + ROW / 2), 12, BLACK, HPos::Right)?;
            for outcome in own.iter().filter(|o| o.fault.name() == *fault) {
                let Some(column) = Phase::ALL.iter().position(|phase| *phase == outcome.phase)
                else {
                    continue;
                };
                let x = LEFT + COLUMN * column as i32;
                let corners = [(x + 1, y + 1), (x + COLUMN - 1, y + ROW - 1)];
                let filled = colour(outcome.reached).filled();
                root.put(&Rectangle::new(corners, filled))?;
                let wrong = outcome.is_unsafe(bounds)
                    || outcome.is_stuck()
                    || outcome.exceeds(bounds).is_some();
                if wrong {
                    root.put(&Rectangle::new(corners, frame))?;
                }
                let ink = if outcome.reached == Reached::Stopped {
                    WHITE
                } else {
                    BLACK
                };
                if let Some(after_s) = outcome.after_s {
                    let text = format!("{:.0}", 1e3 * after_s);
                    write(&text, (x + COLUMN / 2, y + ROW / 2), 11, ink, HPos::Center)?;
                }
            }
        }
        Ok(())
    })
}

//! Demonstrations as files: all hands in one recording, and one motion a file for `bip_filter`.

use crate::bip::trajectories::{Trajectory, TrajectorySet};
use crate::demonstrations::generate::{
    ArmAtFrame, DemonstrationConfig, Part, SimulatedReach, generate,
};
use anyhow::{Context, ensure};
use glam::DVec3;
use hwall_hand::{HandPoint, LabelledReach, Recording, write_recordings};
use hwall_stage::numbers::{self, counted};
use std::path::Path;

/// All hands, in the format of recordings: `person,trial,t,palm_x,...,target_x,...,contact`.
pub const HANDS: &str = "hands.csv";
/// Folder of the motions, `train-001.csv` and so on and `test-001.csv` and so on.
pub const MOTIONS: &str = "demonstrations";

/// Makes demonstrations and writes them; returns a line that says what was made.
///
/// # Errors
/// As [`generate`] and [`write()`].
pub fn generate_into(folder: &Path, config: &DemonstrationConfig) -> anyhow::Result<String> {
    let made = generate(config)?;
    write(folder, &made)?;
    let count = |part| made.iter().filter(|d| d.part == part).count();
    Ok(format!(
        "{} of {} to learn from, {} of {} to be judged by: {HANDS} and {MOTIONS}/ in {}",
        counted(count(Part::Train), "reach", "reaches"),
        counted(config.train.people, "person", "people"),
        count(Part::Test),
        counted(config.test.people, "other", "others"),
        folder.display()
    ))
}

/// Writes [`HANDS`] and the folder [`MOTIONS`]; the latter is for `bip_filter`, given twice:
/// `--train DIR/demonstrations --test DIR/demonstrations --observed 0-17` with all six points.
///
/// # Errors
/// A folder of motions that cannot be written or is not empty; no point of the hand that all reaches have.
pub fn write(folder: &Path, made: &[SimulatedReach]) -> anyhow::Result<()> {
    let motions = folder.join(MOTIONS);
    std::fs::create_dir_all(&motions).with_context(|| motions.display().to_string())?;
    // Otherwise the motions of an earlier run would be learnt from as well.
    let mut held = std::fs::read_dir(&motions).with_context(|| motions.display().to_string())?;
    ensure!(held.next().is_none(), "{}: not empty", motions.display());
    let recordings: Vec<Recording> = made.iter().map(|d| d.recording.clone()).collect();
    let hands = folder.join(HANDS);
    let mut file = numbers::output(Some(&hands))?;
    write_recordings(&mut file, &recordings).with_context(|| hands.display().to_string())?;
    file.finish()?;
    let points = common_points(made.iter().map(|d| &d.labelled));
    for part in Part::ALL {
        let of_part = made.iter().filter(|d| d.part == part);
        let reaches: Vec<_> = of_part
            .map(|d| MotionSource {
                reach: &d.labelled,
                response: d.response.as_deref(),
            })
            .collect();
        let set = motions_of(&reaches, &points, part)?;
        write_motions(&motions, &set, part)?;
    }
    Ok(())
}

/// The points of the hand that were tracked in two frames or more of every reach.
pub fn common_points<'a>(
    reaches: impl Iterator<Item = &'a LabelledReach> + Clone,
) -> Vec<HandPoint> {
    let seen = |reach: &LabelledReach, point: HandPoint| {
        let frames = reach.frames.iter();
        frames.filter(|f| f.point(point).is_some()).count() > 1
    };
    HandPoint::ALL
        .into_iter()
        .filter(|&point| reaches.clone().all(|reach| seen(reach, point)))
        .collect()
}

/// A reach, recorded or simulated, and the arm where there is one.
#[derive(Debug, Clone, Copy)]
pub struct MotionSource<'a> {
    /// The hand.
    pub reach: &'a LabelledReach,
    /// The arm at the frames of the reach.
    pub response: Option<&'a [ArmAtFrame]>,
}

/// Reaches as motions: time from the start of the reach, these points of
/// the hand, and the joints of the arm, rad, where every reach has them.
///
/// Motions to learn from must be complete: a missing point is put on the straight line between its neighbours
/// in time, before the first one and after the last one at their place. In test motions it stays missing.
///
/// # Errors
/// No points, or a response without one entry a frame.
pub fn motions_of(
    reaches: &[MotionSource<'_>],
    points: &[HandPoint],
    part: Part,
) -> anyhow::Result<TrajectorySet> {
    ensure!(
        !points.is_empty(),
        "no point of the hand that all reaches have"
    );
    let axes = |point: &HandPoint| ["x", "y", "z"].map(|axis| format!("{}_{axis}", point.name()));
    let mut columns: Vec<String> = points.iter().flat_map(axes).collect();
    let with_arm = !reaches.is_empty() && reaches.iter().all(|r| r.response.is_some());
    if with_arm {
        columns.extend(numbers::numbered("q", 7));
    }
    let motion = |(i, &MotionSource { reach, response }): (usize, &MotionSource<'_>)| {
        let name = |part: &Option<String>| part.clone().unwrap_or_else(|| "?".to_owned());
        let name = format!("{}/{}", name(&reach.person), name(&reach.trial));
        let mut rows = hand_rows(reach, points, part);
        if let Some(response) = response.filter(|_| with_arm) {
            let entries = response.len();
            ensure!(
                entries == rows.len(),
                "{name}: {entries} entries of the arm beside {} frames",
                rows.len()
            );
            for (row, arm) in rows.iter_mut().zip(response) {
                row.extend(arm.joints_rad.0.map(Some));
            }
        }
        let from_s = reach.frames.first().map_or(0.0, |f| f.t_s);
        Ok(Trajectory {
            name,
            id: i as u64 + 1,
            kind: None,
            times_s: Some(reach.frames.iter().map(|f| f.t_s - from_s).collect()),
            rows,
        })
    };
    let motions = reaches.iter().enumerate().map(motion);
    Ok(TrajectorySet {
        columns,
        trajectories: motions.collect::<anyhow::Result<_>>()?,
    })
}

/// Writes motions as `train-001.csv` or `test-001.csv` and so on.
///
/// # Errors
/// A file that cannot be written.
pub fn write_motions(folder: &Path, set: &TrajectorySet, part: Part) -> anyhow::Result<()> {
    for motion in &set.trajectories {
        let path = folder.join(format!("{}-{:03}.csv", part.name(), motion.id));
        let mut csv = numbers::writer(Some(&path))?;
        let time = motion.times_s.as_ref().map(|_| "t".to_owned());
        csv.write_record(time.iter().chain(&set.columns))?;
        for (i, row) in motion.rows.iter().enumerate() {
            let t_s = motion.times_s.as_ref().map(|times| Some(times[i]));
            let cells = t_s.into_iter().chain(row.iter().copied());
            csv.write_record(cells.map(|cell| cell.map_or(String::new(), |v| v.to_string())))?;
        }
        csv.flush()?;
    }
    Ok(())
}

/// One row a frame, three cells a point.
fn hand_rows(reach: &LabelledReach, points: &[HandPoint], part: Part) -> Vec<Vec<Option<f64>>> {
    let mut rows = vec![Vec::with_capacity(3 * points.len() + 7); reach.frames.len()];
    for &point in points {
        let frames = reach.frames.iter();
        let seen = frames.filter_map(|f| Some((f.t_s, f.point(point)?)));
        let seen: Vec<(f64, DVec3)> = seen.collect();
        for (row, frame) in rows.iter_mut().zip(&reach.frames) {
            let value = match part {
                Part::Test => frame.point(point),
                Part::Train => between(&seen, frame.t_s),
            };
            row.extend(value.map_or([None; 3], |point_m| point_m.to_array().map(Some)));
        }
    }
    rows
}

/// On the straight line between the neighbours in time, at the ends the nearest one.
fn between(seen: &[(f64, DVec3)], t_s: f64) -> Option<DVec3> {
    let next = seen.partition_point(|&(at_s, _)| at_s < t_s);
    match (next.checked_sub(1).map(|i| seen[i]), seen.get(next)) {
        (_, Some(&(at_s, point_m))) if at_s == t_s => Some(point_m),
        (Some((before_s, a)), Some(&(after_s, b))) => {
            Some(a.lerp(b, (t_s - before_s) / (after_s - before_s)))
        }
        (Some((_, only)), None) => Some(only),
        (None, only) => only.map(|&(_, point_m)| point_m),
    }
}

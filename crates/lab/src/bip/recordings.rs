//! Reaches of recorded hands as demonstrations: three sources, cut by the speed of the hand.

use anyhow::{Context, ensure};
use glam::DVec3;
use hwall_bip::Demonstration;
use hwall_hand::{HandPoint, Reach, ReachEnd, Recording, SegmentConfig, reaches};
use std::path::{Path, PathBuf};

/// Reaches of one source, all with the same points of the hand, in the frame of their tracker.
#[derive(Debug, Clone)]
pub struct Reaches {
    /// Name for tables, also of files.
    pub name: &'static str,
    /// What was recorded and how it was cut.
    pub source: String,
    /// Points of the hand, three degrees of freedom each, in this order.
    pub points: Vec<HandPoint>,
    /// The point whose end is predicted, a place in `points`.
    pub scored: usize,
    /// One a reach; seconds from its start, metres.
    pub demonstrations: Vec<Demonstration>,
    /// Reaches that were left out, with the reason.
    pub left_out: Vec<String>,
}

impl Reaches {
    /// Degrees of freedom of the point whose end is predicted.
    #[must_use]
    pub fn scored_dofs(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| 3 * self.scored + axis)
    }

    /// The same reaches seen from where the scored point starts, m: prediction of a displacement.
    ///
    /// # Errors
    /// None in practice: differences of finite numbers of a room are finite.
    pub fn from_start(&self) -> anyhow::Result<Self> {
        let demonstrations = self
            .demonstrations
            .iter()
            .map(|d| {
                let origin = self.scored_dofs().map(|dof| d.sample(0)[dof]);
                let values = (0..d.len()).flat_map(|k| {
                    let sample = d.sample(k).iter().enumerate();
                    sample.map(move |(dof, x)| x - origin[dof % 3])
                });
                Demonstration::from_timestamps(d.times().to_vec(), d.dofs(), values.collect())
            })
            .collect::<Result<_, _>>()?;
        Ok(Self {
            demonstrations,
            ..self.clone()
        })
    }

    /// Length and duration of the median reach, m and s.
    #[must_use]
    pub fn size(&self) -> (f64, f64) {
        let median = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            hwall_testkit::quantile(&values, 0.5)
        };
        let length = |d: &Demonstration| {
            point(d, d.len() - 1, self.scored).distance(point(d, 0, self.scored))
        };
        (
            median(self.demonstrations.iter().map(length).collect()),
            median(
                self.demonstrations
                    .iter()
                    .map(Demonstration::duration)
                    .collect(),
            ),
        )
    }
}

/// A point of the hand in a sample, m.
#[must_use]
pub fn point(d: &Demonstration, sample: usize, point: usize) -> DVec3 {
    DVec3::from_slice(&d.sample(sample)[3 * point..3 * point + 3])
}

/// All sources under a folder; those that are absent are left out.
///
/// # Errors
/// None of them there; a file that cannot be read or is no recording.
pub fn read(dir: &Path) -> anyhow::Result<Vec<Reaches>> {
    let mut all = Vec::new();
    let kinesis = dir.join("kinesis_rtg");
    if kinesis.is_dir() {
        all.push(reach_to_grasp(&kinesis)?);
    }
    let embodiment = dir.join("hand_embodiment/recording.csv");
    if embodiment.is_file() {
        all.push(strokes(&embodiment)?);
    }
    let leap = dir.join("author_leap/finger18.csv");
    if leap.is_file() {
        all.push(leap_reaches(&leap)?);
    }
    ensure!(
        !all.is_empty(),
        "{}: none of kinesis_rtg/, hand_embodiment/recording.csv, author_leap/finger18.csv",
        dir.display()
    );
    Ok(all)
}

/// The way out of every trial: the first reach. The way back follows in the same file.
fn reach_to_grasp(dir: &Path) -> anyhow::Result<Reaches> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(dir)
        .with_context(|| dir.display().to_string())?
        .map(|entry| Ok(entry?.path()))
        .collect::<std::io::Result<_>>()?;
    files.retain(|f| f.extension().is_some_and(|e| e == "csv"));
    files.sort();
    let cut = SegmentConfig {
        point: Some(HandPoint::Index),
        freeze: None,
        ..SegmentConfig::default()
    };
    let mut set = Reaches {
        name: "reach-to-grasp",
        source: "index and thumb tip, 85 Hz; the first reach of every trial, from and to 0.1 m/s; \
                 the first sample of a trial, a remainder of the one before, is dropped"
            .to_owned(),
        points: vec![HandPoint::Index, HandPoint::Thumb],
        scored: 0,
        demonstrations: Vec::new(),
        left_out: Vec::new(),
    };
    for file in files {
        let mut recording = read_recording(&file)?;
        recording.samples.remove(0);
        let found = reaches(&recording, &cut)?;
        match found.first() {
            Some(reach) => set.take(&recording, reach)?,
            None => set.left_out.push(format!("{}: no reach", file.display())),
        }
    }
    Ok(set)
}

/// Everything but the thumb, which is missing in a twelfth of the rows.
fn strokes(file: &Path) -> anyhow::Result<Reaches> {
    let recording = read_recording(file)?;
    let cut = SegmentConfig {
        point: Some(HandPoint::Index),
        onset_m_per_s: 0.15,
        min_length_m: 0.1,
        ..SegmentConfig::default()
    };
    let mut set = Reaches {
        name: "strokes",
        source: "palm and four finger tips, optical, 100 Hz; strokes of 0.1 m and more, from and \
                 to 0.1 m/s of the index tip; the thumb is left out, 8 % of it is missing"
            .to_owned(),
        points: vec![
            HandPoint::Palm,
            HandPoint::Index,
            HandPoint::Middle,
            HandPoint::Ring,
            HandPoint::Little,
        ],
        scored: 1,
        demonstrations: Vec::new(),
        left_out: Vec::new(),
    };
    for reach in reaches(&recording, &cut)? {
        set.take(&recording, &reach)?;
    }
    Ok(set)
}

fn leap_reaches(file: &Path) -> anyhow::Result<Reaches> {
    let recording = read_recording(file)?;
    let mut set = Reaches {
        name: "headset",
        source: "palm and five finger tips, 14 to 28 ms; reaches of 0.3 m and more, from and to \
                 0.1 m/s of the palm"
            .to_owned(),
        points: HandPoint::ALL.to_vec(),
        scored: 2,
        demonstrations: Vec::new(),
        left_out: Vec::new(),
    };
    for reach in reaches(&recording, &SegmentConfig::default())? {
        set.take(&recording, &reach)?;
    }
    Ok(set)
}

fn read_recording(file: &Path) -> anyhow::Result<Recording> {
    let recording = Recording::from_csv_path(file)?;
    ensure!(recording.samples.len() > 2, "{}: too short", file.display());
    Ok(recording)
}

impl Reaches {
    /// Adds a reach, or says why not. Samples in which a point is missing are left out: time stamps
    /// may be as far apart as they like.
    fn take(&mut self, recording: &Recording, reach: &Reach) -> anyhow::Result<()> {
        let mut why = None;
        let samples = &recording.samples[reach.first..=reach.last];
        if reach.end != ReachEnd::Stopped {
            why = Some("the hand does not stop".to_owned());
        }
        let (mut times, mut values) = (Vec::new(), Vec::new());
        for sample in samples {
            let points: Option<Vec<DVec3>> =
                self.points.iter().map(|&p| sample.frame.point(p)).collect();
            if let Some(points) = points {
                times.push(sample.frame.t_s - reach.start_s);
                values.extend(points.into_iter().flat_map(|p| p.to_array()));
            }
        }
        let missing = samples.len() - times.len();
        if 10 * missing > samples.len() || times.len() < 10 {
            why = why.or(Some(format!(
                "{missing} of {} samples incomplete",
                samples.len()
            )));
        }
        match why {
            Some(why) => self.left_out.push(format!("{:.2} s: {why}", reach.start_s)),
            None => self.demonstrations.push(Demonstration::from_timestamps(
                times,
                3 * self.points.len(),
                values,
            )?),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bip::baselines::minimum_jerk_share;
    use hwall_hand::HandFrame;

    /// Rest, a reach of one second, rest; the thumb is missing in every `gaps`-th frame.
    fn recording(gaps: usize) -> Recording {
        let frames = (0..200).map(|k| {
            let mut frame = HandFrame::empty(f64::from(k) * 0.01);
            let way = 0.4 * minimum_jerk_share((frame.t_s - 0.5) / 1.0);
            frame.set_point(HandPoint::Index, Some(DVec3::new(way, 0.1, 1.0)));
            if !(k as usize).is_multiple_of(gaps) {
                frame.set_point(HandPoint::Thumb, Some(DVec3::new(way, 0.05, 1.0)));
            }
            frame
        });
        Recording::from_frames(frames).unwrap()
    }

    fn taken(gaps: usize) -> Reaches {
        let recording = recording(gaps);
        let mut set = Reaches {
            name: "made",
            source: String::new(),
            points: vec![HandPoint::Index, HandPoint::Thumb],
            scored: 0,
            demonstrations: Vec::new(),
            left_out: Vec::new(),
        };
        let cut = SegmentConfig {
            freeze: None,
            ..SegmentConfig::default()
        };
        let found = reaches(&recording, &cut).unwrap();
        assert_eq!(found.len(), 1);
        set.take(&recording, &found[0]).unwrap();
        set
    }

    #[test]
    fn incomplete_samples_are_left_out_and_the_clock_goes_on() {
        let (whole, gaps) = (taken(1000), taken(20));
        let (whole, gaps) = (&whole.demonstrations[0], &gaps.demonstrations[0]);
        assert!(gaps.len() < whole.len());
        assert!((gaps.duration() - whole.duration()).abs() < 0.021);
        let seen = taken(1000).from_start().unwrap();
        let moved = &seen.demonstrations[0];
        assert_eq!(point(moved, 0, 0), DVec3::ZERO);
        // The thumb stays where it is beside the index finger.
        let last = moved.len() - 1;
        let offset = point(moved, last, 1) - point(moved, last, 0);
        assert!(offset.distance(DVec3::new(0.0, -0.05, 0.0)) < 1e-12);
    }

    #[test]
    fn a_reach_with_too_many_gaps_is_left_out_with_the_reason() {
        let set = taken(3);
        assert!(set.demonstrations.is_empty());
        assert!(set.left_out[0].contains("incomplete"), "{:?}", set.left_out);
    }

    #[test]
    fn a_folder_without_recordings_is_an_error() {
        let error = read(Path::new("no such folder")).unwrap_err();
        assert!(error.to_string().contains("kinesis_rtg"), "{error}");
    }

    #[test]
    fn recordings_beside_the_project_give_all_their_reaches() {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
        if !dir.join("kinesis_rtg").is_dir() {
            println!("skipped: recordings are not beside the project");
            return;
        }
        let counts: Vec<(&str, usize)> = read(&dir)
            .unwrap()
            .iter()
            .map(|set| (set.name, set.demonstrations.len()))
            .collect();
        assert_eq!(
            counts,
            [("reach-to-grasp", 45), ("strokes", 41), ("headset", 6)]
        );
    }
}

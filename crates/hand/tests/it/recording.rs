//! Recordings as CSV: round trips, and every way a file can be broken.

use glam::DVec3;
use hwall_files::TableError;
use hwall_hand::{
    BodyPoint, HandError, HandFrame, HandPoint, Quantity, Recording, Sample, read_recordings,
    write_recordings,
};
use hwall_testkit::Sampler;

fn read(text: &str) -> Result<Recording, HandError> {
    Recording::from_csv(text.as_bytes())
}

/// A trial with random gaps in every quantity.
fn random_recording(sampler: &mut Sampler, person: &str, trial: &str) -> Recording {
    let mut t_s = sampler.uniform(-5.0, 5.0);
    let samples = (0..50)
        .map(|_| {
            t_s += sampler.uniform(1e-4, 0.03);
            let mut sample = Sample {
                frame: HandFrame::empty(t_s),
                ..Sample::default()
            };
            for quantity in Quantity::ALL {
                let value = if quantity == Quantity::Gaze {
                    sampler.unit_vector()
                } else {
                    sampler.unit_vector() * sampler.uniform(-6.0, 3.0).exp()
                };
                sample.set(quantity, (sampler.uniform(0.0, 1.0) < 0.7).then_some(value));
            }
            sample.contact = sampler.bool().then(|| sampler.bool());
            sample
        })
        .collect();
    let name = |s: &str| (!s.is_empty()).then(|| s.to_owned());
    Recording {
        person: name(person),
        trial: name(trial),
        samples,
        ignored_columns: [].into(),
        zero_rows: 0,
    }
}

#[test]
fn every_number_reads_back_bit_for_bit() {
    let mut sampler = Sampler::new(2);
    for names in [
        [("", ""), ("", "2")],
        [("ann", "1"), ("ann", "2")],
        [("a,b \"c\"", "1"), ("", "1")],
    ] {
        let recordings = names.map(|(person, trial)| random_recording(&mut sampler, person, trial));
        let mut text = Vec::new();
        write_recordings(&mut text, &recordings).unwrap();
        assert_eq!(read_recordings(text.as_slice()).unwrap(), recordings);
    }
}

#[test]
fn columns_come_in_any_order_and_any_subset() {
    let recording =
        read("index_z, index_x ,note,index_y,t\n3,1,hello,2,0\n,,,,0.5\n6,4,\"a,b\",5,1\n")
            .unwrap();
    let index = |i: usize| recording.samples[i].frame.point(HandPoint::Index);
    assert_eq!(recording.samples.len(), 3);
    assert_eq!(index(0), Some(DVec3::new(1.0, 2.0, 3.0)));
    assert_eq!(index(1), None);
    assert_eq!(index(2), Some(DVec3::new(4.0, 5.0, 6.0)));
    assert_eq!(*recording.ignored_columns, ["note".to_owned()]);
    assert_eq!(recording.steadiest_point(), Some(HandPoint::Index));
    assert_eq!(recording.duration_s(), 1.0);
}

#[test]
fn points_are_read_by_their_names_in_openxr_and_webxr() {
    let text = "t,index-finger-tip_x,index-finger-tip_y,index-finger-tip_z,XR_HAND_JOINT_PALM_EXT_x,\
                XR_HAND_JOINT_PALM_EXT_y,XR_HAND_JOINT_PALM_EXT_z,wrist_x\n0,1,2,3,4,5,6,7\n";
    let recording = read(text).unwrap();
    let frame = recording.samples[0].frame;
    let [index_m, palm_m] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)];
    assert_eq!(frame.point(HandPoint::Index), Some(index_m));
    assert_eq!(frame.point(HandPoint::Palm), Some(palm_m));
    assert_eq!(*recording.ignored_columns, ["wrist_x".to_owned()]);
    // A point's own name comes first, and an error about a missing column uses the name in the file.
    let both = "t,index_x,index_y,index_z,index-finger-tip_x\n0,1,2,3,9\n";
    let frame = read(both).unwrap().samples[0].frame;
    assert_eq!(frame.point(HandPoint::Index), Some(index_m));
    let error = read("t,thumb-tip_x,thumb-tip_y\n0,1,2\n").unwrap_err();
    assert!(error.to_string().contains("thumb-tip_z"), "{error}");
}

/// Spreadsheets in many countries separate columns by semicolons; recorders write `NaN` for unseen points.
#[test]
fn a_recording_is_read_as_any_program_writes_it() {
    let plain = read("note,t,palm_x,palm_y,palm_z\na,0,0.5,2,-0.25\nb,1,,,\n").unwrap();
    for separator in [';', '\t', '|'] {
        let text = "note,t,palm_x,palm_y,palm_z\r\na,0,0.5,2,-0.25\r\nb,1,NaN,NA,N/A\r\n";
        let text = text.replace(',', &separator.to_string());
        assert_eq!(read(&text).unwrap(), plain);
        assert_eq!(read(&text.replace('.', ",")).unwrap(), plain);
    }
    let latin1 =
        b"note,t,palm_x,palm_y,palm_z,,\na,0,0.5,2,-0.25,,\n\xe4,1,nan,nan,nan,,\n,,,,,,\n";
    assert_eq!(Recording::from_csv(&latin1[..]).unwrap(), plain);
}

#[test]
fn trials_may_alternate_and_keep_their_own_clocks() {
    let text = "person,trial,t,palm_x,palm_y,palm_z,contact\n\
                a,1,0,1,0,0,0\nb,1,0,2,0,0,\na,1,1,3,0,0,1\na,2,0,4,0,0,0\n";
    let all = read_recordings(text.as_bytes()).unwrap();
    assert_eq!(all.len(), 3);
    assert_eq!(all[0].person.as_deref(), Some("a"));
    assert_eq!(all[0].trial.as_deref(), Some("1"));
    assert_eq!(all[0].samples.len(), 2);
    assert_eq!(all[0].samples[1].contact, Some(true));
    assert_eq!(all[1].samples[0].contact, None);
    assert_eq!(read(text), Err(HandError::SeveralTrials { count: 3 }));
}

#[test]
fn gaze_becomes_a_unit_vector() {
    let gaze = |cells: &str| {
        let header = "t,palm_x,palm_y,palm_z,gaze_x,gaze_y,gaze_z";
        read(&format!("{header}\n0,,,,{cells}\n")).map(|r| r.samples[0].frame.gaze)
    };
    let unit = gaze("0.600001,0.8,0").unwrap().unwrap();
    assert!((unit.length() - 1.0).abs() < 1e-15);
    let (line, length) = (2, 1e-9);
    assert_eq!(gaze("1e-9,0,0"), Err(HandError::ZeroGaze { line, length }));
    // Headsets write zeros for unseen eyes.
    assert_eq!(gaze("0,0,0"), Ok(None));
}

#[test]
fn broken_files_are_named_by_line_and_column() {
    use HandError as E;
    let no_column = |column: &str| E::MissingColumn {
        column: column.into(),
    };
    let no_cell = |column: &str| E::MissingCell {
        line: 2,
        column: column.into(),
    };
    let backward = |t_s| E::TimeNotIncreasing {
        line: 3,
        t_s,
        previous_s: 0.5,
    };
    let not_finite = E::NonFiniteCell {
        line: 2,
        column: "palm_y".into(),
        value: f64::INFINITY,
    };
    let not_a_number = E::NotANumber {
        line: 2,
        column: "palm_y".into(),
        text: "fast".into(),
    };
    let twice = E::DuplicateColumn { column: "t".into() };
    for (text, expected) in [
        ("", E::Table(TableError::Empty)),
        ("palm_x,palm_y,palm_z\n1,2,3\n", no_column("t")),
        ("t,palm_x,palm_z\n0,1,2\n", no_column("palm_y")),
        ("t,object_x,object_y,object_z\n0,1,2,3\n", E::NoHandColumns),
        ("t,t,palm_x,palm_y,palm_z\n", twice),
    ] {
        assert_eq!(read(text), Err(expected), "{text:?}");
    }
    for (rows, expected) in [
        ("", E::NoSamples),
        ("0,1,fast,3\n", not_a_number),
        ("0,1,,3\n", no_cell("palm_y")),
        (",1,2,3\n", no_cell("t")),
        ("NaN,1,2,3\n", no_cell("t")),
        ("0,1,inf,3\n", not_finite.clone()),
        // Overflows to infinity.
        ("0,1,1e999,3\n", not_finite),
        ("0.5,1,2,3\n0.5,1,2,3\n", backward(0.5)),
        ("0.5,1,2,3\n0.25,1,2,3\n", backward(0.25)),
    ] {
        let text = format!("t,palm_x,palm_y,palm_z\n{rows}");
        assert_eq!(read(&text), Err(expected), "{rows:?}");
    }
    let missing = Recording::from_csv_path("no/such/file.csv");
    assert!(matches!(missing, Err(E::Io { path, .. }) if path == "no/such/file.csv"));
}

#[test]
fn a_recording_that_would_not_read_back_is_not_written() {
    let frame = |t_s: f64, x: f64| HandFrame {
        palm_m: Some(DVec3::splat(x)),
        ..HandFrame::empty(t_s)
    };
    let write = |frames: &[HandFrame]| {
        let sample = |&frame: &HandFrame| Sample {
            frame,
            ..Sample::default()
        };
        let recording = Recording {
            samples: frames.iter().map(sample).collect(),
            ..Recording::default()
        };
        recording.to_csv(std::io::sink())
    };
    let backward = HandError::TimeNotIncreasing {
        line: 2,
        t_s: 0.0,
        previous_s: 0.0,
    };
    assert_eq!(write(&[]), Err(HandError::NoSamples));
    assert_eq!(write(&[frame(0.0, 1.0), frame(0.0, 2.0)]), Err(backward));
    let empty = HandFrame::empty(0.0);
    assert_eq!(write(&[empty]), Err(HandError::NoHandColumns));
    for (t_s, x) in [(0.0, f64::NAN), (f64::NAN, 1.0)] {
        let refused = write(&[frame(t_s, x)]).unwrap_err();
        assert!(matches!(refused, HandError::NonFiniteCell { line: 1, .. }));
    }
    assert_eq!(write(&[frame(0.0, 1.0)]), Ok(()));
    // A full disk.
    let recording = Recording::from_frames([frame(0.0, 1.0)]).unwrap();
    let full = recording.to_csv(&mut [0_u8; 4][..]);
    assert!(matches!(full, Err(HandError::Io { .. })));
}

#[test]
fn points_of_the_arm_and_of_a_controller_are_read_by_any_name_and_written_by_one() {
    let text = "t,XR_HAND_JOINT_INDEX_TIP_EXT_x,XR_HAND_JOINT_INDEX_TIP_EXT_y,XR_HAND_JOINT_INDEX_TIP_EXT_z,\
                forearm_x,forearm_y,forearm_z,right-shoulder_x,right-shoulder_y,right-shoulder_z,\
                gripSpace_x,gripSpace_y,gripSpace_z\n\
                0,1,2,3,4,5,6,7,8,9,10,11,12\n0.1,1,2,3,,,,7,8,9,,,\n";
    let recording = read(text).unwrap();
    assert!(recording.ignored_columns.is_empty());
    let at = |k: usize, p: BodyPoint| recording.samples[k].frame.body(p);
    assert_eq!(at(0, BodyPoint::Forearm), Some(DVec3::new(4.0, 5.0, 6.0)));
    assert_eq!(at(1, BodyPoint::Forearm), None);
    assert_eq!(at(1, BodyPoint::Shoulder), Some(DVec3::new(7.0, 8.0, 9.0)));
    assert_eq!(at(0, BodyPoint::Grip), Some(DVec3::new(10.0, 11.0, 12.0)));
    assert_eq!(at(0, BodyPoint::Aim), None);
    let mut written = Vec::new();
    recording.to_csv(&mut written).unwrap();
    let header = "t,index_x,index_y,index_z,forearm_x,forearm_y,forearm_z,shoulder_x,shoulder_y,shoulder_z,grip_x,";
    assert!(written.starts_with(header.as_bytes()));
    assert_eq!(Recording::from_csv(&written[..]).unwrap(), recording);
    // An arm without a hand is rejected, and an incomplete point of it is ignored.
    let arm = "t,elbow_x,elbow_y,elbow_z\n0,1,2,3\n";
    assert_eq!(read(arm), Err(HandError::NoHandColumns));
    let half = read("t,palm_x,palm_y,palm_z,elbow_x,elbow_y\n0,1,2,3,4,5\n").unwrap();
    assert_eq!(*half.ignored_columns, ["elbow_x", "elbow_y"]);
}

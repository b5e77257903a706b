//! Files that are truncated, changed, or not recordings.

use crate::common::{self, again, file, recorded, recorder, run, taken};
use hwall_record::{Ending, RecordError, Recorder, RecorderConfig, Recording};
use hwall_testkit::Sampler;

/// Offsets at which the records outside chunks begin, and at which the last one ends.
fn boundaries(bytes: &[u8]) -> Vec<usize> {
    let mut at = 8;
    let mut all = vec![at];
    while at + 9 <= bytes.len() - 8 {
        let length: [u8; 8] = bytes[at + 1..at + 9].try_into().unwrap();
        at += 9 + u64::from_le_bytes(length) as usize;
        all.push(at);
    }
    all
}

/// A recording, the bytes of its file, and how many messages of the session it has.
fn whole(name: &str) -> (Vec<u8>, usize) {
    let path = file(name);
    recorded(&path, 3.0);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    let inputs = Recording::from_bytes(bytes.clone()).unwrap();
    let count = inputs.inputs().count();
    (bytes, count)
}

/// Number of session messages left in a file that is truncated at this offset.
fn cut(bytes: &[u8], at: usize) -> Option<usize> {
    match Recording::from_bytes(bytes[..at].to_vec()) {
        Ok(recording) => {
            let inputs: Result<Vec<_>, _> = recording.inputs().collect();
            Some(inputs.expect("what is there is sound").len())
        }
        Err(RecordError::NoSetup | RecordError::NotMcap) => None,
        Err(error) => panic!("cut at {at}: {error}"),
    }
}

#[test]
fn a_file_cut_anywhere_gives_what_is_there() {
    let (bytes, all) = whole("cut.mcap");
    let boundaries = boundaries(&bytes);
    assert!(boundaries.len() > 30);
    let mut sampler = Sampler::new(5);
    let mut places: Vec<usize> = (0..150).map(|_| sampler.index(bytes.len())).collect();
    places.extend(boundaries.iter().flat_map(|&at| [at - 1, at, at + 1]));
    places.retain(|at| *at <= bytes.len());
    places.sort_unstable();
    let mut least = 0;
    for at in places {
        let Some(count) = cut(&bytes, at) else {
            assert!(at < 2 * 64 * 1024, "no setup in {at} bytes");
            continue;
        };
        assert!((least..=all).contains(&count), "{at}: {count}");
        least = count;
    }
    assert_eq!(least, all);
}

/// Regression: a file truncated in its summary was reported as complete.
#[test]
fn a_file_that_is_cut_says_so() {
    let (bytes, all) = whole("says.mcap");
    let ending = |at: usize| {
        let recording = Recording::from_bytes(bytes[..at].to_vec()).unwrap();
        (recording.ending(), recording.inputs().count())
    };
    assert_eq!(ending(bytes.len()).0, Ending::Finished);
    let mut behind = 0;
    for missing in 1..4000 {
        match ending(bytes.len() - missing) {
            (Ending::CutBehind { offset }, count) => {
                assert!(offset as usize <= bytes.len() - missing);
                assert_eq!(count, all);
                behind += 1;
            }
            (Ending::Cut { .. }, count) => assert!(count <= all),
            (other, _) => panic!("{missing} bytes missing: {other:?}"),
        }
    }
    // At least the footer and the magic.
    assert!(behind > 37, "{behind}");
}

#[test]
fn a_cut_recording_runs_again_as_far_as_it_goes() {
    let (bytes, _) = whole("short.mcap");
    let half = Recording::from_bytes(bytes[..bytes.len() / 2].to_vec()).unwrap();
    assert!(matches!(half.ending(), Ending::Cut { .. }));
    let replayed = again(&half);
    assert_eq!((replayed.difference, replayed.missing), (None, 0));
    let cycles = replayed.cycles;
    assert!((1000..2900).contains(&cycles), "{cycles}");
}

/// The file that a killed program leaves is complete, except for the end of the recording.
#[test]
fn an_unfinished_file_is_whole_after_every_flush() {
    let path = file("unfinished.mcap");
    let config = RecorderConfig {
        flush_s: 0.0,
        ..RecorderConfig::simulated()
    };
    let mut to = recorder(&path, &config);
    run(&mut to, 0, 0.5);
    // The writing thread needs a moment; the test does not depend on how long.
    let mut bytes = Vec::new();
    let mut count = 0;
    for _ in 0..1000 {
        std::thread::sleep(std::time::Duration::from_millis(10));
        bytes = std::fs::read(&path).unwrap();
        let Ok(recording) = Recording::from_bytes(bytes.clone()) else {
            continue;
        };
        // A file that is read during a write may be truncated.
        count = recording.inputs().count();
        if count >= 500 && recording.ending() == Ending::Unfinished {
            break;
        }
    }
    assert!(count >= 500, "{count}");
    // Every MCAP reader requires this ending.
    assert!(bytes.ends_with(b"\x89MCAP0\r\n"));
    to.finish().unwrap();
    assert_eq!(taken(&path).ending(), Ending::Finished);
}

/// Corrupt messages in a chunk without a checksum.
#[test]
fn nonsense_in_messages_names_channel_and_place() {
    let (bytes, _) = whole("nonsense.mcap");
    let mut sampler = Sampler::new(3);
    let (mut wrong, mut sound) = (0, 0);
    let boundaries = boundaries(&bytes);
    let chunks: Vec<_> = boundaries.iter().filter(|at| bytes[**at] == 6).collect();
    for _ in 0..300 {
        let mut changed = bytes.clone();
        let chunk = *chunks[1 + sampler.index(chunks.len() - 1)];
        // Header: framing, two times, size; then the checksum, where zero means none.
        changed[chunk + 33..chunk + 37].fill(0);
        for _ in 0..20 {
            let at = chunk + 60 + sampler.index(5000);
            changed[at] = sampler.index(256) as u8;
        }
        let Ok(recording) = Recording::from_bytes(changed) else {
            continue;
        };
        match recording.inputs().find_map(Result::err) {
            Some(error) => {
                let text = error.to_string();
                assert!(text.contains("/session/"), "{text}");
                assert!(text.contains("byte"), "{text}");
                wrong += 1;
            }
            None => sound += 1,
        }
    }
    assert!(wrong > 10 && sound > 0, "{wrong} wrong, {sound} sound");
}

#[test]
fn what_is_no_recording_is_said() {
    let refused = |bytes: &[u8]| Recording::from_bytes(bytes.to_vec()).unwrap_err();
    assert!(matches!(refused(b""), RecordError::NotMcap));
    assert!(matches!(refused(b"PK\x03\x04 a zip"), RecordError::NotMcap));
    assert!(matches!(refused(b"\x89MCAP0\r\n"), RecordError::NoSetup));
    let (mut bytes, _) = whole("checksum.mcap");
    let all = boundaries(&bytes);
    let chunk = *all.iter().find(|at| bytes[**at] == 6).unwrap();
    bytes[chunk + 100] ^= 1;
    let error = refused(&bytes);
    let RecordError::Checksum { offset, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(offset, chunk as u64);
    let missing = Recording::open(&file("missing.mcap")).unwrap_err();
    assert!(matches!(missing, RecordError::Io { .. }));
}

/// With two recorders on one file, one would overwrite the other's data.
#[test]
fn a_file_has_one_recorder_at_a_time() {
    let path = file("one_at_a_time.mcap");
    let mut first = recorder(&path, &RecorderConfig::simulated());
    run(&mut first, 0, 0.2);
    let setup = common::setup();
    let create = || {
        let scene = common::scene_of(&setup);
        let config = RecorderConfig::simulated();
        Recorder::create(&path, &setup, common::skeleton(), &scene, &config)
    };
    let refused = create().unwrap_err();
    let said = refused.to_string();
    assert!(said.contains("one_at_a_time.mcap"), "{said}");
    assert!(matches!(&refused, RecordError::InUse { path: named } if *named == path));
    // The first recording is unharmed, and afterwards the file is free.
    let summary = first.finish().unwrap();
    let kept = Recording::open(&path).unwrap();
    assert_eq!(kept.ending(), Ending::Finished);
    assert_eq!(kept.inputs().count() as u64, summary.messages + 1);
    create().unwrap().finish().unwrap();
    std::fs::remove_file(&path).unwrap();
}

/// The file left by a second writer with a longer recording.
#[test]
fn bytes_behind_the_end_are_noticed() {
    let (bytes, all) = whole("behind.mcap");
    let end = bytes.len() as u64;
    let mut longer = bytes.clone();
    longer.push(0);
    let recording = Recording::from_bytes(longer.clone()).unwrap();
    assert_eq!(recording.ending(), Ending::Followed { offset: end });
    assert_eq!(recording.inputs().count(), all);
    longer.extend_from_slice(&bytes);
    let recording = Recording::from_bytes(longer).unwrap();
    assert_eq!(recording.ending(), Ending::Followed { offset: end });
    assert_eq!(again(&recording).ending, Ending::Followed { offset: end });
}

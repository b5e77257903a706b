//! Recordings of sessions. Checksums of chunks are removed, because they protect only against accidents.

use super::binary::scratch;
use super::{Inputs, judged, promise};
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::hand::{Bystanders, HandFrame};
use hwall::haptics::{ArmCommand, ArmState, Board};
use hwall::{Cycle, WorldPose};
use hwall_kinematics::{Chain, JointPositions, JointVelocities, SrsArm};
use hwall_record::{
    ArmSource, RecordError, Recorder, RecorderConfig, Recording, Request, Run, Setup, Skeleton,
};
use hwall_scene::Scene;
use hwall_testkit::Verdict;

const SCENE: &str = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 2\nf 1 2 3\n";
/// Bytes at the beginning of a file; kind and length before a record.
const MAGIC: usize = 8;
const HEAD: usize = 9;
/// The kind of a chunk, and the offset of its checksum after three numbers of 8 bytes; zero means none.
const CHUNK: u8 = 6;
const SUM_AT: usize = 24;

/// One run of a few cycles, with everything that a recording may hold.
pub(super) fn recordings() -> Inputs {
    let board = Board::default();
    let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let skeleton = Skeleton::new(&Chain::iiwa7(), &arm, &board)?;
    let (scene, _) = Scene::from_obj_str(SCENE, None)?;
    let setup = Setup {
        program: "an attack".to_owned(),
        scene_obj: SCENE.to_owned(),
        scene_sidecar: None,
        arm: ArmSource::Named("iiwa7".to_owned()),
        board,
        options: vec![("base".to_owned(), "0.0 0.0 0.0 0.0".to_owned())],
    };
    let config = RecorderConfig {
        chunk_bytes: 1 << 12,
        ..RecorderConfig::simulated()
    };
    let path = scratch("a.mcap")?;
    let mut recorder = Recorder::create(&path, &setup, skeleton, &scene, &config)?;
    recorder.begin(Run {
        number: 0,
        options: vec![("hand_filter".to_owned(), "usual".to_owned())],
    });
    for k in 0..20 {
        let t_s = 1e-3 * f64::from(k);
        let mut frame = HandFrame::empty(t_s);
        frame.palm_m = Some(DVec3::new(1.0 - t_s, 0.2, 0.4));
        frame.bystanders = Some(Bystanders::new(&[frame.palm_m, None])?);
        recorder.frame(&frame);
        let q = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0]);
        recorder.cycle(&Cycle {
            t_s,
            state: ArmState {
                t_s,
                q,
                qd: JointVelocities([0.0; 7]),
                external_torque: None,
            },
            command: ArmCommand::Position(q),
        });
    }
    recorder.world(&WorldPose {
        t_s: 0.02,
        base_from_world: Pose::from_yaw(0.1, DVec3::X)?,
    });
    recorder.request(Request::Stop);
    recorder.finish()?;
    Ok(vec![std::fs::read(&path)?])
}

/// Removes the checksums of chunks, as far as the records can be parsed.
fn unsealed(bytes: &[u8]) -> Vec<u8> {
    let mut unsealed = bytes.to_vec();
    let mut at = MAGIC;
    while let Some(&[kind, ref length @ ..]) = bytes.get(at..at + HEAD)
        && let Ok(length) = <[u8; 8]>::try_from(length)
    {
        let sum = at + HEAD + SUM_AT;
        if kind == CHUNK
            && let Some(sum) = unsealed.get_mut(sum..sum + 4)
        {
            sum.fill(0);
        }
        let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        at = at.saturating_add(HEAD).saturating_add(length);
        if at > bytes.len() {
            break;
        }
    }
    unsealed
}

pub(super) fn read(bytes: &[u8]) -> Verdict {
    let whole = |bytes| {
        let recording = Recording::from_bytes(bytes)?;
        let inputs = recording.inputs().collect::<Result<Vec<_>, _>>()?;
        Ok::<_, RecordError>((recording, inputs))
    };
    judged(whole(unsealed(bytes)), |(recording, inputs)| {
        promise(inputs.len() <= bytes.len(), "more inputs than bytes")?;
        // Other readers parse the setup; each must accept it or return an error.
        let setup = recording.setup();
        let _ = Scene::from_obj_str(&setup.scene_obj, setup.scene_sidecar.as_deref());
        let _ = setup.board.flange_from_board_face();
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_checksum_that_is_taken_away_is_not_asked_for() {
        let mut bytes = recordings().unwrap().remove(0);
        let ending = |bytes: &[u8]| Recording::from_bytes(bytes.to_vec()).map(|r| r.ending());
        assert!(ending(&bytes).is_ok() && ending(&unsealed(&bytes)).is_ok());
        // Within the scene's text.
        let text = b"o wall";
        let at = bytes.windows(text.len()).position(|w| w == text).unwrap();
        bytes[at + 2] = b'W';
        assert!(matches!(ending(&bytes), Err(RecordError::Checksum { .. })));
        assert!(ending(&unsealed(&bytes)).is_ok());
        assert!(unsealed(&bytes[..bytes.len() / 2]).len() == bytes.len() / 2);
    }
}

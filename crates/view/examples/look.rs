//! A made-up touch of a few seconds: writes `replay.html`, `touch.svg` and `run.glb` to a folder.
//!
//! `cargo run --release -p hwall-view --example look -- /tmp/look`
//! A number after the folder is the number of triangles of the wall: `-- /tmp/look 100000`.

use glam::DVec3;
use hwall::haptics::{Board, board_pose};
use hwall::kinematics::{ArmKinematics, JointPositions, NearestConfig, SrsArm};
use hwall::scene::{Scene, Surface, SurfaceMesh};
use hwall_view::{
    ViewFrame, ViewHand, ViewMarker, ViewMarkerKind, ViewPrediction, ViewScene, ViewState,
    film_strip, glb, replay_page,
};
use std::path::PathBuf;

/// Where the wall is touched, m.
const PLACE: DVec3 = DVec3::new(0.66, 0.0, 0.6);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let folder = PathBuf::from(args.next().unwrap_or_else(|| "out/look".to_owned()));
    let triangles: usize = args.next().map_or(Ok(2), |n| n.parse())?;
    std::fs::create_dir_all(&folder)?;

    let board = Board::default();
    let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
    let scene = ViewScene::new("A made-up touch", &wall(triangles)?, &arm, &board)?;
    let waiting = JointPositions::from_deg([0.0, 20.0, 0.0, -110.0, 0.0, -40.0, 0.0]);
    let pose = board_pose(PLACE, DVec3::X, 0.0)?;
    let config = NearestConfig::default();
    let presenting = ArmKinematics::nearest(&arm, &pose, &waiting, &config, &mut arm.scratch())?.q;
    let postures = [waiting, presenting];
    let frames: Vec<ViewFrame> = (0..150)
        .map(|i| frame(f64::from(i) / 30.0, &postures))
        .collect();
    let markers = [ViewMarker {
        t_s: 2.0,
        kind: ViewMarkerKind::Touched,
        text: "touched".to_owned(),
    }];
    std::fs::write(
        folder.join("replay.html"),
        replay_page(&scene, &frames, &markers),
    )?;
    std::fs::write(folder.join("run.glb"), glb(&scene, &frames))?;
    let stills = [30, 39, 45, 52, 60, 70].map(|i| frames[i]);
    std::fs::write(folder.join("touch.svg"), film_strip(&scene, &stills, 2.0)?)?;
    println!(
        "wrote replay.html, run.glb and touch.svg to {}",
        folder.display()
    );
    Ok(())
}

/// The arm moves to the wall while a fingertip does, presses for two seconds, and leaves.
fn frame(t_s: f64, [waiting, presenting]: &[JointPositions; 2]) -> ViewFrame {
    let ease = |from_s: f64, long_s: f64| {
        let s = ((t_s - from_s) / long_s).clamp(0.0, 1.0);
        s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    };
    let (there, gone) = (ease(0.8, 0.9), ease(4.0, 0.8));
    let q = JointPositions(std::array::from_fn(|i| {
        waiting[i] + (presenting[i] - waiting[i]) * (there - gone)
    }));
    let mut hand = ViewHand::LOST;
    let tip_m = PLACE + DVec3::new(0.5, 0.25, -0.25) * (1.0 - ease(1.1, 0.9) + gone);
    hand.joints_m[10] = Some(tip_m);
    hand.joints_m[0] = Some(tip_m + DVec3::new(0.12, 0.02, -0.01));
    let touched = (2.0..4.0).contains(&t_s);
    ViewFrame {
        hand,
        head_m: Some(DVec3::new(1.3, 0.1, 1.0)),
        predicted: Some(ViewPrediction {
            point_m: PLACE,
            normal: DVec3::X,
            surface: Some(0),
            region_m: Some([DVec3::Y * 0.05, DVec3::Z * 0.03]),
            contact_s: Some((2.0 - t_s).max(0.0)),
        }),
        force_n: touched.then_some(DVec3::NEG_X * 6.0),
        state: if touched {
            ViewState::Touched
        } else {
            ViewState::Approaching
        },
        ..ViewFrame::new(t_s, q)
    }
}

/// A wall 0.66 m in front of the arm, of at least two triangles.
fn wall(triangles: usize) -> Result<Scene, hwall::scene::SceneError> {
    let strips = ((triangles as f64 / 2.0).sqrt().ceil() as usize).max(1);
    let at = |i: usize, j: usize| {
        let [y, z] = [i, j].map(|k| k as f64 / strips as f64);
        DVec3::new(
            PLACE.x + 0.02 * (9.0 * (y - 0.5)).sin() * (7.0 * (z - 0.3)).sin(),
            2.4 * y - 1.2,
            2.0 * z,
        )
    };
    let cells = (0..strips).flat_map(|i| (0..strips).map(move |j| (i, j)));
    let triangles_m = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    let surface = Surface {
        name: "wall".to_owned(),
        ..Surface::default()
    };
    let mesh = SurfaceMesh {
        surface,
        triangles_m: triangles_m.collect(),
    };
    Ok(Scene::from_meshes(vec![mesh])?.0)
}

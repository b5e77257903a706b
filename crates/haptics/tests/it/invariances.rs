//! The board's motion to a hand and its hold depend on neither the clock nor the handedness of the world.

use crate::support::{DT_S, at_rest, home, pressed, rates};
use glam::DVec3;
use hwall_haptics::{ArmCommand, Board, BoardTarget, Phase, Renderer, RendererConfig};
use hwall_kinematics::{JointPositions, SrsArm};
use std::mem::discriminant;
use std::sync::LazyLock;

/// In a mirror, joints about vertical axes (at zero) turn the other way, those about y the same way.
fn mirrored(q: JointPositions) -> JointPositions {
    JointPositions(std::array::from_fn(
        |i| if i % 2 == 0 { -q[i] } else { q[i] },
    ))
}

/// A perfect arm that is sent to two places and touched at both, in a given clock and world: joints and phases.
fn run(clock_s: f64, mirror: bool) -> Vec<(JointPositions, Phase, f64)> {
    let side = if mirror { -1.0 } else { 1.0 };
    let config = RendererConfig::default();
    let mut renderer = Renderer::new(&SrsArm::iiwa7(), &Board::default(), config).unwrap();
    // No configuration is its own mirror image: rounding would then decide.
    let mut start = home();
    (start[0], start[2], start[4]) = (0.1, -0.05, 0.2);
    let start = if mirror { mirrored(start) } else { start };
    let mut state = at_rest(clock_s, start);
    let mut seen = Vec::new();
    for k in 1..6000 {
        let t = f64::from(k) * DT_S;
        let [y, z] = if t < 3.0 { [0.12, 0.6] } else { [-0.2, 0.45] };
        let normal = DVec3::new(1.0, side * y, 0.0);
        let target = BoardTarget::new(DVec3::new(0.55, side * y, z), normal, clock_s + t);
        let press_n = if (2.0..2.5).contains(&t) || t > 5.2 {
            8.0
        } else {
            0.0
        };
        state.t_s = clock_s + t;
        state.external_torque = Some(pressed(&**renderer.arm(), &state.q, press_n));
        let step = renderer.step(clock_s + t, &state, Some(&target));
        renderer.plan();
        let q = match step.command {
            ArmCommand::Position(q) => q,
            _ => state.q,
        };
        state.qd = rates(&state.q, &q);
        state.q = q;
        seen.push((q, step.phase, step.normal_force_n.unwrap_or(f64::NAN)));
    }
    seen
}

static NOMINAL: LazyLock<Vec<(JointPositions, Phase, f64)>> = LazyLock::new(|| run(0.0, false));

fn compare(
    name: &str,
    other: &[(JointPositions, Phase, f64)],
    joints: fn(JointPositions) -> JointPositions,
    close_rad: f64,
) {
    let nominal = &*NOMINAL;
    let touched = nominal
        .iter()
        .filter(|step| matches!(step.1, Phase::Contact { .. }));
    assert!(touched.count() > 1000);
    let mut worst: f64 = 0.0;
    for (k, (a, b)) in nominal.iter().zip(other).enumerate() {
        let ((q_a, phase_a, force_a), (q_b, phase_b, force_b)) = (a, b);
        let same = discriminant(phase_a) == discriminant(phase_b);
        assert!(same, "{name}, step {k}: {phase_a:?} {phase_b:?}");
        worst = worst.max(joints(*q_a).max_abs_difference(q_b));
        let off_n = (force_a - force_b).abs();
        assert!(off_n < 1e-3, "{name}, step {k}: {force_a} {force_b} N");
    }
    println!("{name}: {worst:.1e} rad");
    assert!(worst < close_rad, "{name}: {worst} rad");
    let ends = nominal.last().zip(other.last());
    let ends = ends.map(|(a, b)| joints(a.0).max_abs_difference(&b.0));
    assert!(ends.is_some_and(|off| off < 1e-6), "{name}: {ends:?}");
}

#[test]
fn the_clock_may_start_at_any_time() {
    // The last is Unix time, whose steps are rounded to 0.2 us.
    for (clock_s, close_rad) in [(1.0, 1e-9), (1e6, 1e-8), (1.7e9, 1e-5)] {
        let name = format!("clock at {clock_s} s");
        compare(&name, &run(clock_s, false), |q| q, close_rad);
    }
}

#[test]
fn the_world_may_be_mirrored() {
    compare("mirror", &run(0.0, true), mirrored, 1e-9);
}

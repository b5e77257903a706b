//! Speed and error of the closed form: `cargo bench -p hwall-kinematics --bench srs`.

use hwall_kinematics::{JointPositions, NearestConfig, Pose, SrsArm};
use hwall_testkit::{
    ErrorStats, Machine, MarkdownTable, Sampler, Timing, format_error, format_ns, time_batches,
};

const SEED: u64 = 1;
const TARGETS: usize = 10_000;

fn main() {
    let arm = SrsArm::iiwa7();
    let mut sampler = Sampler::new(SEED);
    let ranges = arm.limits().map(|l| (l.min_rad, l.max_rad));
    let configurations: Vec<_> = (0..TARGETS)
        .map(|_| JointPositions(sampler.array_within(ranges)))
        .collect();
    let reachable: Vec<Pose> = configurations.iter().map(|q| arm.forward(q)).collect();
    let unreachable = unreachable_poses(&arm, &mut sampler);
    println!("{}\n", Machine::detect(SEED));
    let mut table = MarkdownTable::new(["what", "median", "p99", "max pose error"]);
    let mut row = |what: &str, timing: Timing, error: &str| {
        table.row([
            what.to_owned(),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
            error.to_owned(),
        ]);
    };
    let n = TARGETS;
    row("forward", time(|i| arm.forward(&configurations[i % n])), "");
    row(
        "forward and Jacobian",
        time(|i| arm.forward_and_jacobian(&configurations[i % n])),
        "",
    );
    row(
        "verdict, reachable",
        time(|i| arm.is_reachable(&reachable[i % n])),
        "",
    );
    let m = unreachable.len();
    row(
        "verdict, unreachable (not too far)",
        time(|i| arm.is_reachable(&unreachable[i % m])),
        "",
    );
    let errors = ErrorStats::from_errors(reachable.iter().map(|pose| {
        let witness = *arm.verdict(pose).witness().expect("reachable");
        let error = arm.forward(&witness.q).distance(pose);
        error.position_m.max(error.angle_rad)
    }));
    row(
        "verdict with witness",
        time(|i| arm.verdict(&reachable[i % n])),
        &format_error(errors.max, "m, rad"),
    );
    row(
        "eight branches at an arm angle",
        time(|i| arm.solutions(&reachable[i % n], 0.3)),
        "",
    );
    row(
        "feasible arm angles",
        time(|i| arm.feasible_arm_angles(&reachable[i % n]).is_ok()),
        "",
    );
    let config = NearestConfig::default();
    row(
        "nearest, near",
        time(|i| {
            let q = JointPositions(configurations[i % n].0.map(|x| x + 0.01));
            arm.nearest_solution(&reachable[i % n], &q, &config)
        }),
        "",
    );
    row(
        "nearest, anywhere",
        time(|i| arm.nearest_solution(&reachable[i % n], &configurations[(i + 1) % n], &config)),
        "",
    );
    println!("{table}");
}

fn time<T>(f: impl FnMut(usize) -> T) -> Timing {
    time_batches(1_000, 100, f)
}

/// Poses within the arm's length that its limits forbid.
fn unreachable_poses(arm: &SrsArm, sampler: &mut Sampler) -> Vec<Pose> {
    let mut poses = Vec::new();
    while poses.len() < 2_000 {
        let direction = sampler.unit_vector();
        let rotation = sampler.rotation();
        let wrist = glam::DVec3::new(0.0, 0.0, 0.34) + direction * sampler.uniform(0.4, 0.8);
        let pose = Pose::new(rotation, wrist + rotation.z_axis * 0.126).expect("a pose");
        if !arm.is_reachable(&pose) {
            poses.push(pose);
        }
    }
    poses
}

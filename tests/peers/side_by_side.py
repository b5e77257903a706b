"""From Python on one iiwa 7: hwall beside pytracik, optik, ssik and EAIK; hwall.bip beside IntPrim.

Usage: side_by_side.py [--count 500] [--seed 20180601] [--intprim FOLDER [--workload FOLDER]]

Poses, `--count` of each kind:
- reachable: forward kinematics (products of elementary rotations, below) of random joints;
- impossible: the wrist centre lies beyond the stretched arm, or nearer to the shoulder than the
  elbow's limit allows, by 0.1 mm or more: no triangle has these sides;
- inside, outside: on a random ray out of a reachable pose, 1 um before and after the place where
  hwall's verdict changes. Inside is proven by the configuration that comes with the verdict. Outside
  is hwall's word; an answer of any contestant that meets such a pose would refute it.

An answer is right if it meets a reachable pose within 1 mm, 1 mrad and 1e-6 rad of the limits (hwall:
1e-9 m, 1e-9 rad, 1e-12 rad), and if it is "no" for the others. The program ends with an error if hwall
is wrong or refuted. A contestant that is not installed is named as skipped. `--intprim`: see intprim_steps.py.
`hwall.bip` runs twice: as published, to be compared number by number, and with its own hypotheses and noise.
"""

import argparse
import os
import subprocess
import sys
from functools import partial
from importlib.metadata import distributions
from pathlib import Path
from time import perf_counter_ns

from intprim_steps import HAND, Contestant, motions, polynomials  # first: one thread for numpy

import hwall
import numpy as np
from hwall import bip

HERE = Path(__file__).resolve().parent
URDF = str(HERE / "iiwa7.urdf")
LIMITS = np.radians([170, 120, 170, 120, 170, 120, 175])
PEERS = ["hwall", "numpy", "pytracik", "optik-py", "ssik", "eaik"]
KINDS = ["reachable", "impossible", "inside", "outside"]
EDGE_M = 1e-6
# Rise along z before each joint, and the plane in which it turns.
JOINTS = [(0.34, 0, 1), (0, 2, 0), (0.4, 0, 1), (0, 0, 2), (0.4, 0, 1), (0, 2, 0), (0, 0, 1)]
FLANGE_M = 0.126


def forward(q):
    poses = np.tile(np.eye(4), (len(q), 1, 1))
    for angle, (rise, a, b) in zip(q.T, JOINTS):
        step = np.tile(np.eye(4), (len(q), 1, 1))
        step[:, 2, 3] = rise
        step[:, a, a] = step[:, b, b] = np.cos(angle)
        step[:, b, a] = np.sin(angle)
        step[:, a, b] = -np.sin(angle)
        poses = poses @ step
    poses[:, :3, 3] += FLANGE_M * poses[:, :3, 2]
    return poses


def errors(q, poses):
    """Position, m; rotation, rad; excess over the limits, rad. NaN where there is no answer."""
    off = forward(q) - poses
    turn = np.linalg.norm(off[:, :3, :3], axis=(1, 2)) / np.sqrt(8)
    return np.linalg.norm(off[:, :3, 3], axis=1), 2 * np.arcsin(turn.clip(max=1)), (abs(q) - LIMITS).max(1)


def meets(q, poses, tolerance, excess):
    metres, radians, beyond = errors(q, poses)
    return (metres <= tolerance) & (radians <= tolerance) & (beyond <= excess)


def targets(arm, count, rng):
    reachable, impossible = (forward(rng.uniform(-LIMITS, LIMITS, (count, 7))) for _ in range(2))
    ray = rng.normal(size=(count, 3))
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    # Two sides of 0.4 m, an angle of at least 60 degrees between them: the third is 0.4 to 0.8 m.
    far = rng.uniform(0.8001, 1.2, count)
    length = np.where(np.arange(count) % 2, far, rng.uniform(0.0, 0.3999, count))[:, None]
    impossible[:, :3, 3] = [0, 0, 0.34] + length * ray + FLANGE_M * impossible[:, :3, 2]

    def along(distance):
        poses = reachable.copy()
        poses[:, :3, 3] += distance[:, None] * ray
        return poses

    low, high = np.zeros(count), np.full(count, 3.0)
    for _ in range(50):
        middle = 0.5 * (low + high)
        held = arm.is_reachable(along(middle))
        low, high = np.where(held, middle, low), np.where(held, high, middle)
    inside, outside = along(low - EDGE_M), along(low + EDGE_M)
    edge = arm.is_reachable(inside) & ~arm.is_reachable(outside)
    return reachable, impossible, inside[edge], outside[edge]


def or_none(call, *args):
    try:
        return call(*args).q
    except hwall.Error:
        return None


def pytracik():
    from trac_ik import TracIK

    solver = TracIK("base", "flange", URDF)
    return lambda pose, start: solver.ik(pose[:3, 3], pose[:3, :3], start), None


def optik(**setting):
    import optik

    robot = optik.Robot.from_urdf_file(URDF, "base", "flange")
    robot.set_parallelism(1)
    config = optik.SolverConfig(max_time=0.1, **setting)
    return lambda pose, start: (robot.ik(config, pose, start) or [None])[0], None


def ssik():
    from ssik.prebuilt.kuka import iiwa7_ik

    return lambda pose, start: next((s.q for s in iiwa7_ik.solve(pose, max_solutions=1)), None), None


def eaik():
    from eaik.IK_HP import HPRobot

    axes = np.zeros((7, 3))
    places = np.zeros((8, 3))
    places[7, 2] = FLANGE_M
    for joint, (rise, a, b) in enumerate(JOINTS):
        axes[joint] = np.cross(np.eye(3)[a], np.eye(3)[b])
        places[joint, 2] = rise
    locked = np.radians(sorted(range(-170, 171), key=abs))
    robots = [HPRobot(axes, places, [(2, angle)]) for angle in locked]

    def held(found):
        q = np.reshape(found.Q, (-1, 7))
        exact = q[~np.array(found.is_LS, bool) & (abs(q) <= LIMITS).all(1)]
        return exact[0] if len(exact) else None

    def one(pose, _):
        return next((q for robot in robots if (q := held(robot.IK(pose))) is not None), None)

    def many(poses, _):
        answers, left = np.full((len(poses), 7), np.nan), np.arange(len(poses))
        for robot in robots:
            for place, found in zip(left, robot.IK_batched(poses[left], 1)):
                if (q := held(found)) is not None:
                    answers[place] = q
            left = left[np.isnan(answers[left, 0])]
        return answers

    return one, many


def contestants(arm):
    verdict = (lambda pose, _: arm.verdict(pose).q, lambda poses, _: arm.verdict(poses).q)
    nearest = (partial(or_none, arm.nearest), lambda poses, q: arm.nearest(poses, q).q)
    return [
        ("hwall `verdict`", "exact", lambda: verdict),
        ("hwall `nearest`", "exact, nearest to the start", lambda: nearest),
        ("pytracik", "its defaults: 5 ms, 1e-5, 2 threads", pytracik),
        ("optik-py", "its defaults: 100 ms, tol_f 1e-6; 1 thread", optik),
        ("optik-py, tight", "100 ms, tol_f 1e-12; 1 thread", partial(optik, tol_f=1e-12)),
        ("ssik", "its prebuilt `iiwa7_ik`, one solution", ssik),
        ("EAIK", "q3 locked at 341 angles, 1 degree apart, until one holds", eaik),
    ]


def timed(call, *args):
    begin = perf_counter_ns()
    answer = call(*args)
    return answer, 1e-3 * (perf_counter_ns() - begin)


def ask(solve, poses, starts):
    """Answers, NaN for none, and times in us."""
    q, us = np.full((len(poses), 7), np.nan), np.empty(len(poses))
    for i, (pose, start) in enumerate(zip(poses, starts)):
        found, us[i] = timed(solve, pose, start)
        if found is not None:
            q[i] = found
    return q, us


def spread(us):
    return " / ".join(f"{x:.3g}" if x < 100 else f"{x:.0f}" for x in np.percentile(us, [50, 99]))


def table(titles, rows):
    print("\n" + "\n".join(f"| {' | '.join(row)} |" for row in [titles, ["---"] * len(titles), *rows]) + "\n")


def inverse(arm, count, rng):
    kinds = targets(arm, count, rng)
    poses, sizes = np.concatenate(kinds), [len(kind) for kind in kinds]
    kind = np.repeat(range(4), sizes)
    can = kind % 2 == 0
    starts = rng.uniform(-0.999 * LIMITS, 0.999 * LIMITS, (len(poses), 7))
    faults, refuted, verdicts, times = 0, 0, [], []
    for name, setting, make in contestants(arm):
        try:
            solve, solve_all = make()
        except ImportError as error:
            print(f"skipped: {name}, {setting}: {error}")
            continue
        q, us = ask(solve, poses, starts)
        ours = name.startswith("hwall")
        met = meets(q, poses, *((1e-9, 1e-12) if ours else (1e-3, 1e-6)))
        right = np.where(can, met, np.isnan(q[:, 0]))
        faults += ours * np.sum(~right)
        refuted += np.sum(~can & meets(q, poses, 1e-9, 1e-12))
        metres, radians, _ = (error[can & right] for error in errors(q, poses))
        shares = [f"{100 * right[kind == k].mean():.4g} %" for k in range(4)]
        worst = [f"{np.median(x):.1e} / {x.max():.1e}" for x in (metres, radians)]
        verdicts.append([name, setting, *shares, *worst])
        batched = [timed(solve_all, poses, starts) for _ in range(3 if solve_all else 0)]
        if ours:
            faults += sum(np.sum(np.isnan(answers) != np.isnan(q)) for answers, _ in batched)
        mean = f"{np.median([us for _, us in batched]) / len(poses):.4g}" if batched else "none"
        times.append([name, *(spread(us[kind == k]) for k in range(4)), mean])
    table(["contestant", "setting", *KINDS, "position error, m", "rotation error, rad"], verdicts)
    print("Right answers; errors, median / max, of those to poses that can be held.")
    table(["contestant", *KINDS, "batched"], times)
    print("us per call, median / p99; batched: us per pose, mean over the poses of all kinds, median of three.\n")
    print(f"{', '.join(f'{n} {name}' for n, name in zip(sizes, KINDS))}.", end=" ")
    print(f"Answers that refute hwall (meet a pose that it denies, within 1e-9): {refuted}.")
    return faults + refuted


def follow(filter, motion, update, end):
    """Expected end of the arm after half of the samples and after all; times of both calls, us."""
    ends, us = [], []
    for sample in motion.T:
        _, updating = timed(update, filter, sample)
        mean, predicting = timed(end, filter)
        ends.append(mean[HAND:])
        us.append((updating, updating + predicting))
    return [ends[len(ends) // 2 - 1], ends[-1]], us


def primitives(intprim, workload):
    sys.path.insert(0, str(intprim))
    import intprim

    train, test = motions(workload, "train"), motions(workload, "test")
    published = Contestant(intprim, [polynomials(intprim)], train)

    def new_filter():
        published.start()
        return published

    fit = partial(bip.fit, [m.T for m in train], range(HAND), basis="polynomial", functions=8)
    hidden = np.r_[np.ones(HAND), np.zeros(7)]
    runs = [("IntPrim", new_filter, lambda f, x: f.step("filter", (hidden * x)[:, None]), lambda f: f.end())]
    same, tuned = fit(tune=False, published=True), fit()
    for name, make in (("hwall.bip as published", partial(same.filter, published=True)), ("hwall.bip", tuned.filter)):
        runs.append((name, make, lambda f, x: f.update(x[:HAND]), lambda f: f.predict().mean))
    prior = published.primitive.get_mean_trajectory(101).T
    off_before = abs(same.mean(np.linspace(0, 1, 101)) - prior).max()
    truth, reference, rows = np.array([m[HAND:, -1] for m in test]), None, []
    for name, make, update, end in runs:
        followed = [follow(make(), m, update, end) for m in test]
        ends = np.array([ends for ends, _ in followed])
        us = np.concatenate([us for _, us in followed])
        reference = ends if reference is None else reference
        off = [np.sqrt(np.mean((ends - x) ** 2, axis=(0, 2))) for x in (truth[:, None], reference)]
        rows.append([name, *(f"{a:.3g} / {b:.3g}" for a, b in off), spread(us[:, 0]), spread(us[:, 1])])
    table(["filter", "error, rad", "difference from IntPrim, rad", "update, us", "update and end, us"], rows)
    print("The arm's end, expected after half / all of the samples: root mean square. Times of a call: median / p99.\n")
    print(f"{len(train)} demonstrations, {len(test)} motions, 25 columns of which 18 are seen, 8 polynomials.", end=" ")
    print(f"Means before any sample, hwall against IntPrim: {off_before:.1e} m or rad at most.")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=20180601)
    parser.add_argument("--intprim", type=Path)
    parser.add_argument("--workload", type=Path, default=HERE / "../../../shared/reference/bip/workload")
    args = parser.parse_args()
    cpu = next(line.split(": ")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name"))
    git = subprocess.run(["git", "-C", HERE, "rev-parse", "--short", "HEAD"], capture_output=True, text=True)
    versions = sorted(f"{d.name} {d.version}" for d in distributions() if d.name.lower() in PEERS)
    print(f"CPU: {cpu}, {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f} at the start ·", end=" ")
    print(f"commit {git.stdout.strip()} · seed {args.seed} · Python {sys.version.split()[0]}, {', '.join(versions)}\n")
    faults = inverse(hwall.Arm.iiwa7(), args.count, np.random.default_rng(args.seed))
    if args.intprim and args.workload.is_dir():
        primitives(args.intprim, args.workload)
    else:
        print("\nskipped: hwall.bip against IntPrim: needs --intprim and --workload")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()

"""Solves the targets of a task file with optik-py, one thread, and writes the answers with their times.

Usage: optik_solve.py TASK.json ANSWERS.json
"""

import json
import sys
from time import perf_counter_ns

import optik


def main() -> None:
    with open(sys.argv[1], encoding="utf-8") as file:
        task = json.load(file)
    robot = optik.Robot.from_urdf_file(task["urdf"], task["base"], task["tip"])
    robot.set_parallelism(1)
    config = optik.SolverConfig(
        solution_mode="speed", tol_f=task["tol_f"], max_time=task["max_time_s"]
    )
    # A seed on the limit itself must not fail for its last digit.
    low, high = robot.joint_limits()

    empty = []
    for _ in range(2001):
        start = perf_counter_ns()
        robot.num_positions()
        empty.append(perf_counter_ns() - start)

    q, ns = [], []
    for target, seed in zip(task["targets"], task["starts"]):
        seed = [min(max(x, a), b) for x, a, b in zip(seed, low, high)]
        start = perf_counter_ns()
        found = robot.ik(config, target, seed)
        ns.append(perf_counter_ns() - start)
        q.append(None if found is None else list(found[0]))

    answers = {"q": q, "ns": ns, "empty_call_ns": sorted(empty)[len(empty) // 2]}
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        json.dump(answers, file)


main()

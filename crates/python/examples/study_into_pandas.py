"""A study as a table: is the board in place before the finger, by kind of people? `python study_into_pandas.py [table.csv]`"""

import sys

import numpy as np
import pandas as pd

import hwall
from hwall import sim

arm = hwall.Arm.iiwa7()
scene = hwall.Scene.from_obj_str("o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n")
places = hwall.places_on_wall([0.6, 0, 0], [1, 0, 0], 0.3, [0.35, 0.55], 0.2)
rows = []
for kind in ("plain", "fast", "slow"):
    for number in range(2):
        session = hwall.Session(arm, scene, simulated=True, prepared=False)
        touches = sim.Person(number, kind=kind, head=[1.4, 0, 0.9], hand=[1.15, -0.15, 0.45]).plan(places, [1, 0, 0])
        robot, cycle, board = sim.ServoArm(session.arm, np.radians([0, 30, 0, -90, 0, -30, 90])), 0, []
        while robot.t < touches.duration:
            if cycle % 14 == 0:
                session.frame(touches.frame(robot.t))
            robot.command(session.step(robot.t, robot.q, robot.qd, robot.torque))
            session.plan()
            robot.push(*sim.finger_force(robot.pose, *touches.tip(robot.t)))
            robot.advance(1e-3)
            board.append(robot.pose)
            cycle += 1
        for trial, touch in enumerate(touches.truth):
            pose = board[int(1e3 * touch["contact"])]
            beside, _, gap = pose[:3, :3].T @ (touch["target"] - pose[:3, 3])
            rows.append({"kind": kind, "person": number, "trial": trial, "reach_s": touch["contact"] - touch["start"],
                         "gap_mm": 1e3 * abs(gap), "in_place": abs(gap) < 0.005 and abs(beside) < 0.08})
table = pd.DataFrame(rows)
print(table.groupby("kind").agg(touches=("trial", "size"), reach_s=("reach_s", "mean"), in_place=("in_place", "mean")).round(2))
if len(sys.argv) > 1:
    table.to_csv(sys.argv[1], index=False)

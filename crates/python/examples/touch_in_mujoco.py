"""A wall touched in MuJoCo: a session commands MuJoCo's iiwa, a simulated person presses it. `python touch_in_mujoco.py [iiwa7.urdf]`"""

import sys
from pathlib import Path

import mujoco
import numpy as np

import hwall
from hwall import sim

urdf = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[2] / "kinematics/tests/data/iiwa7.urdf"
m = mujoco.MjModel.from_xml_path(str(urdf))
m.opt.timestep, m.opt.disableflags = 1e-3, mujoco.mjtDisableBit.mjDSBL_CONTACT
d = mujoco.MjData(m)

scene = hwall.Scene.from_obj_str("o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n")
session = hwall.Session(hwall.Arm.from_urdf(urdf), scene, simulated=True)
d.qpos[:] = session.waits_at
person = sim.Person(7, head=[1.4, 0, 0.9], hand=[1.15, -0.15, 0.45])
touches = person.plan([[0.6, 0.1, 0.5], [0.6, -0.1, 0.4]], [1, 0, 0])

told, servo, pushed, felt = d.qpos.copy(), 60.0, np.zeros(7), 0
while d.time < touches.duration:
    if round(1e3 * d.time) % 14 == 0:  # a tracker at 72 Hz
        session.frame(touches.frame(d.time))
    kind, q = session.step(d.time, d.qpos, d.qvel, pushed)
    session.plan()
    last, told = told, q if kind == "position" else told
    for event in session.events():
        felt += event["event"] == "touched"
        if event["event"] in ("arrived", "touched", "released"):
            print(f"{event['t']:.3f} s: {event['event']}")
    # The finger pushes the face of the board; the servo is a computed torque.
    force, moment = sim.finger_force(session.arm.forward(d.qpos), *touches.tip(d.time))
    pushed = session.arm.jacobian(d.qpos).T @ np.concatenate([force, moment])
    torque = np.zeros(7)
    mujoco.mj_mulM(m, d, torque, servo**2 * (told - d.qpos) + 2 * servo * ((told - last) / m.opt.timestep - d.qvel))
    d.qfrc_applied[:] = torque + d.qfrc_bias + pushed
    mujoco.mj_step(m, d)
print(f"{felt} of {len(touches.truth)} touches were felt by the board")
sys.exit(felt != len(touches.truth))

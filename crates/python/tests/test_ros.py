"""The ROS 2 node of the examples, with stand-ins for the modules of ROS: a simulated arm and a simulated person at its topics."""

import runpy
import sys
from pathlib import Path
from types import ModuleType
from types import SimpleNamespace as Message

import numpy as np

import hwall
from hwall import sim

NODE = Path(__file__).parent.parent / "examples" / "ros2_node.py"
# As a broadcaster may order them.
ORDER = np.array([3, 0, 6, 1, 5, 2, 4])


def header(t):
    sec, nanosec = divmod(round(1e9 * t), 10**9)
    return Message(stamp=Message(sec=sec, nanosec=nanosec))


class Node:
    """What `rclpy.create_node` returns, as far as the example asks."""

    def __init__(self):
        self.said, self.takes, self.sent = [], {}, None

    def create_publisher(self, kind, topic, depth):
        return Message(publish=lambda message: setattr(self, "sent", (topic, message.data)))

    def create_subscription(self, kind, topic, callback, depth):
        self.takes[topic] = callback

    def get_logger(self):
        return Message(info=self.said.append)


def spin(node):
    """A person touches the wall twice; the arm reports at 200 Hz."""
    room = hwall.Scene.from_obj_str("o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n")
    session = hwall.Session(hwall.Arm.iiwa7(), room)
    servo = sim.ServoArm(session.arm, session.waits_at, seed=3)
    person = sim.Person(7, head=[1.4, 0, 0.9], hand=[1.15, -0.15, 0.45])
    touches, cycle = person.plan([[0.6, 0.1, 0.5], [0.6, -0.1, 0.4]], [1, 0, 0]), 0
    while servo.t < touches.duration:
        if cycle % 14 == 0:
            frame, unseen = touches.frame(servo.t), np.full(3, np.nan)
            points = [frame.points.get(name, unseen) for name in ("index", "palm", "head")]
            poses = [Message(position=Message(x=x, y=y, z=z)) for x, y, z in points]
            node.takes["/hand"](Message(header=header(frame.t), poses=poses))
        if cycle % 5 == 0:
            node.sent = None
            state = {"position": servo.q, "velocity": servo.qd, "effort": servo.torque}
            values = {name: list(value[ORDER]) for name, value in state.items()}
            node.takes["/joint_states"](Message(header=header(servo.t), name=[f"A{i + 1}" for i in ORDER], **values))
            if node.sent:
                topic, wanted = node.sent
                assert topic == "/forward_position_controller/commands" and np.isfinite(wanted).all()
                servo.command(("position", np.array(wanted)))
        servo.push(*sim.finger_force(servo.pose, *touches.tip(servo.t)))
        servo.advance(1e-3)
        cycle += 1


def test_the_node_brings_the_board_and_feels_both_touches(monkeypatch):
    node = Node()
    ros = {"rclpy": {"init": lambda: None, "create_node": lambda name: node, "spin": spin}}
    kinds = {"geometry_msgs": "PoseArray", "sensor_msgs": "JointState", "std_msgs": "Float64MultiArray"}
    for package, kind in kinds.items():
        ros |= {package: {}, f"{package}.msg": {kind: Message}}
    for name, contents in ros.items():
        module = ModuleType(name)
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(sys, "argv", [str(NODE)])
    runpy.run_path(str(NODE), run_name="__main__")
    kinds = [line.split(": ")[1] for line in node.said]
    told = [kind for kind in kinds if kind in ("arrived", "touched", "released")]
    assert [kind for kind in told if kind != "arrived"] == 2 * ["touched", "released"], "\n".join(node.said)
    # A board that is still in place after a touch arrives once more.
    assert all(told[i - 1] == "arrived" for i, kind in enumerate(told) if kind == "touched"), "\n".join(node.said)

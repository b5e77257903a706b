"""A session as a ROS 2 node: /joint_states and /hand in, position commands out. `python ros2_node.py [arm.urdf scene.obj [JOINT,JOINT,...]]`

/hand is a geometry_msgs/PoseArray in the frame of the arm's base: fingertip, palm, head; a position of NaN means not seen.
"""

import sys

import numpy as np

import hwall

try:
    import rclpy
    from geometry_msgs.msg import PoseArray
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(0)


def seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


def main(urdf=None, scene=None, joint_names=None):
    arm = hwall.Arm.from_urdf(urdf) if urdf else hwall.Arm.iiwa7()
    wall = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n"
    scene = hwall.Scene.from_obj(scene) if scene else hwall.Scene.from_obj_str(wall)
    session = hwall.Session(arm, scene)
    # Of the chain and of the commands; drivers often add a prefix: names separated by commas.
    names = joint_names.split(",") if joint_names else arm.joint_names
    rclpy.init()
    node = rclpy.create_node("hwall")
    commands = node.create_publisher(Float64MultiArray, "/forward_position_controller/commands", 1)

    def hand(message):
        seen = [np.array([p.position.x, p.position.y, p.position.z]) for p in message.poses[:3]]
        index, palm, head = (p if np.isfinite(p).all() else None for p in seen)
        session.frame(hwall.Frame(seconds(message.header.stamp), index=index, palm=palm, head=head))

    def joints(message):
        now = seconds(message.header.stamp)
        if not set(names) <= set(message.name):  # of a gripper, say
            return
        order = [message.name.index(name) for name in names]
        q, qd = np.array(message.position)[order], np.array(message.velocity)[order]
        effort = np.array(message.effort)[order] if message.effort else None
        kind, wanted = session.step(now, q, qd, effort, now)
        if kind == "position":  # on "hold" the controller keeps its last positions
            commands.publish(Float64MultiArray(data=list(wanted)))
        session.plan()
        for event in session.events():
            node.get_logger().info(f"{event['t']:.3f} s: {event['event']}")

    node.create_subscription(JointState, "/joint_states", joints, 1)
    node.create_subscription(PoseArray, "/hand", hand, 1)
    rclpy.spin(node)


if __name__ == "__main__":
    main(*sys.argv[1:])

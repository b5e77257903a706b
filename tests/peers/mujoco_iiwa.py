#!/usr/bin/env python3
"""An iiwa 7 that this project did not write: MuJoCo behind an FRI 1.15 controller, and a person who touches the front wall.

    python tests/peers/mujoco_iiwa.py --bridge target/release/examples/bridge --loss 0.01

Starts `bridge --fri`, sends it hands over its WebSocket and states over UDP, and judges the board from MuJoCo's own pose.
Needs the packages mujoco, numpy and websocket-client; says `skipped` without them. Exit status 0 if enough touches are in place.
"""
import argparse, json, math, random, re, select, shutil, socket, struct, subprocess, sys, threading, time

try:
    import mujoco
    import numpy as np
    import websocket
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(0)

# Published values of the lbr_fri_ros2_stack description: joint origin, axis, mass, centre of mass, inertia xx yy zz yz.
LINKS = [
    ((0, 0, 0.1475), (0, 0, 1), 3.394011, (0, -0.034819, 0.123299), (0.021383, 0.020403, 0.007563, 0.003797)),
    ((0, -0.0105, 0.1925), (0, 1, 0), 4.031991, (0, 0.039793, 0.086944), (0.031697, 0.03008, 0.009666, 0.005889)),
    ((0, 0.0105, 0.2075), (0, 0, 1), 3.394011, (0, 0.034819, 0.123299), (0.021383, 0.020403, 0.007563, -0.003797)),
    ((0, 0.0105, 0.1925), (0, -1, 0), 4.031989, (0, -0.039793, 0.086944), (0.031695, 0.030079, 0.009665, -0.005889)),
    ((0, -0.0105, 0.2075), (0, 0, 1), 1.529239, (0, -0.029824, 0.076267), (0.008485, 0.007136, 0.003848, 0.002806)),
    ((0, -0.0707, 0.1925), (0, 1, 0), 2.403626, (0, 0.07102, 0.00495), (0.007067, 0.006804, 0.004629, 0.000311)),
    ((0, 0.0707, 0.091), (0, 0, 1), 0.259474, (3e-06, -2e-06, 0.013782), (0.000171, 0.000171, 0.000299, 0)),
]
SPEED = np.radians([98, 98, 100, 130, 140, 180, 180])
ACCELERATION = np.array([8.65, 5.44, 5.69, 11.01, 11.78, 13.76, 13.17])  # limits of the bridge, rad/s2
PAST = 0.05  # so far past its way may a change of speed take a joint, rad: the bridge refuses more
START = np.radians([0, 30, 0, -90, 0, -30, 90])
FACE = 0.035 + 0.02  # flange and board beyond the last link, m
PERIOD = 0.005
BANDWIDTH = 40.0  # of the servo, rad/s, critically damped
FINGER = 2000.0  # stiffness of the fingertip, N/m
INSET, GAP, TILT = 0.02, 0.005, 2.0  # in place: m from the edge, m from the wall, degrees
WALL = 0.62  # the front wall of the built-in room: x, m


def model():
    body = '<site name="face" pos="0 0 %g"/>' % FACE
    for origin, axis, mass, centre, (xx, yy, zz, yz) in reversed(LINKS):
        v = lambda values: " ".join(map(str, values))
        body = (f'<body pos="{v(origin)}"><joint axis="{v(axis)}"/><inertial pos="{v(centre)}" mass="{mass}" '
                f'fullinertia="{xx} {yy} {zz} 0 0 {yz}"/>{body}</body>')
    return mujoco.MjModel.from_xml_string(f'<mujoco><option timestep="0.001" integrator="RK4"/><worldbody>{body}</worldbody></mujoco>')


class Arm:
    """Rigid bodies under computed torque; commands are interpolated over a period."""

    def __init__(self):
        self.m = model()
        self.d = mujoco.MjData(self.m)
        self.d.qpos[:] = START
        self.told, self.to = START.copy(), START.copy()
        self.site = mujoco.mj_name2id(self.m, mujoco.mjtObj.mjOBJ_SITE, "face")
        self.external = np.zeros(7)
        mujoco.mj_forward(self.m, self.d)

    def face(self):
        return self.d.site_xpos[self.site].copy(), self.d.site_xmat[self.site].reshape(3, 3).copy()

    def advance(self, tip):
        start, steps = self.told.copy(), round(PERIOD / 0.001)
        torque, jacobian = np.zeros(7), np.zeros((3, 7))
        for k in range(steps):
            wanted = start + (self.to - start) * (k + 1) / steps
            speed = (self.to - start) / PERIOD
            error, rate = wanted - self.d.qpos, speed - self.d.qvel
            mujoco.mj_mulM(self.m, self.d, torque, BANDWIDTH**2 * error + 2 * BANDWIDTH * rate)
            position, rotation = self.face()
            self.external[:] = 0
            if tip is not None:
                local = rotation.T @ (tip - position)
                if -0.05 < local[2] < 0 and abs(local[0]) < 0.1 and abs(local[1]) < 0.1:
                    mujoco.mj_jacSite(self.m, self.d, jacobian, None, self.site)
                    self.external = jacobian.T @ (rotation[:, 2] * FINGER * local[2])
            self.d.qfrc_applied[:] = torque + self.d.qfrc_bias + self.external
            mujoco.mj_step(self.m, self.d)
        self.told = self.to.copy()


def varint(value):
    out = bytearray()
    while True:
        low, value = value & 127, value >> 7
        out.append(low | (128 if value else 0))
        if not value:
            return bytes(out)


def number(field, value):
    return varint(field << 3) + varint(value)


def inner(field, data):
    return varint(field << 3 | 2) + varint(len(data)) + data


def joints(field, values):
    return inner(field, b"".join(varint(1 << 3 | 1) + struct.pack("<d", v) for v in values))


def fields(data):
    at = 0

    def take():
        nonlocal at
        value = shift = 0
        while True:
            byte = data[at]
            at += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    while at < len(data):
        key = take()
        kind = key & 7
        if kind == 0:
            yield key >> 3, take()
            continue
        size = 8 if kind == 1 else 4 if kind == 5 else take()
        yield key >> 3, data[at:at + size]
        at += size


def command(data):
    """Sequence, reflected sequence and joint positions of an answer."""
    header, positions = {}, []
    for field, value in fields(data):
        if field == 1:
            header = dict(fields(value))
        if field == 2:
            for what, part in fields(value):
                if what == 1:
                    positions = [v for _, packed in fields(part) for (v,) in struct.iter_unpack("<d", packed)]
    return header.get(2, 0), header.get(3, 0), positions


class Controller:
    """Monitoring, then commanding; holds the last command when none comes."""

    def __init__(self, arm, client, args):
        self.arm, self.client, self.args = arm, client, args
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.random = random.Random(args.seed)
        self.sequence, self.reflected, self.state, self.cycle = 0, 0, 1, 0
        self.deaf = 0
        self.answers = self.lost = 0
        self.worst = self.acceleration = self.past = 0.0
        self.last, self.last_speed, self.last_cycle = START.copy(), np.zeros(7), 0
        self.since = 0

    def message(self, begun):
        args, d = self.args, self.arm.d
        stamp = 1_700_000_000 * 10**9 + int(1e9 * (self.cycle * PERIOD + 1.0))
        stamp += int(1e6 * args.stamp_jitter_ms * self.random.uniform(-1, 1))
        odd = 77 if args.unknown_enums else None
        q = d.qpos + (np.array([self.random.gauss(0, args.noise) for _ in range(7)]) if args.noise else 0)
        robot = number(1, 7) + number(2, odd or 0) + b"".join(number(5, odd or 2) for _ in range(7)) + number(6, odd or 2) + number(7, odd or 0)
        data = (joints(1, q) + joints(2, [0.0] * 7) + joints(3, self.arm.to) + joints(4, [0.0] * 7)
                + joints(5, self.arm.external) + inner(15, number(1, stamp // 10**9) + number(2, stamp % 10**9)))
        out = inner(1, number(1, 0x245142) + number(2, self.sequence) + number(3, self.reflected)) + inner(2, robot) + inner(3, data)
        out += inner(4, number(1, self.state) + number(2, 3) + number(3, round(1000 * PERIOD)) + number(4, 1))
        if self.state >= 3:
            out += inner(5, joints(1, self.hold if self.state == 3 else self.arm.to) + number(10, 1) + number(11, 1) + varint(12 << 3 | 1) + struct.pack("<d", 1.0))
        return out

    def take(self):
        newest = None
        while select.select([self.socket], [], [], 0)[0]:
            newest = self.socket.recv(2000)
            self.answers += 1
            if self.deaf > 0:
                self.lost += 1
                newest = None
        if newest is None:
            return
        sequence, _, positions = command(newest)
        self.reflected = sequence
        if self.state == 4 and len(positions) == 7:
            q = np.array(positions)
            speed = (q - self.last) / PERIOD
            self.worst = max(self.worst, float(np.max(np.abs(speed) / SPEED)))
            if self.last_cycle == self.cycle - 1:
                change = np.abs(speed - self.last_speed)
                self.acceleration = max(self.acceleration, float(np.max(change)) / PERIOD)
                beyond = np.maximum(change - ACCELERATION * PERIOD, 0.0)
                self.past = max(self.past, float(np.max(beyond**2 / (2 * ACCELERATION))))
            self.last, self.last_speed, self.last_cycle = q, speed, self.cycle
            self.arm.to = q
        if self.state == 3 and len(positions) == 7 and np.max(np.abs(np.array(positions) - self.hold)) < 0.01 and self.cycle - self.since > 50:
            self.enter(4)

    def enter(self, state):
        self.state, self.since = state, self.cycle

    def step(self, tip):
        args = self.args
        self.take()
        self.arm.advance(tip)
        self.cycle += 1
        if self.state == 1 and self.answers > 50:
            self.enter(2)
        elif self.state == 2 and self.cycle - self.since > 100:
            self.hold = self.arm.to.copy()
            self.enter(3)
        self.deaf = max(0, self.deaf - 1)
        if self.state == 4 and self.deaf == 0 and self.random.random() < args.loss:
            self.deaf = self.random.randint(1, 4)
        if self.state == 4 and self.random.random() < args.stall:
            self.deaf = max(self.deaf, math.ceil(self.random.uniform(0.02, 0.2) / PERIOD))
        self.sequence += 1
        self.socket.sendto(self.message(0), self.client)


class Person:
    """Looks at a place of the wall, reaches for it, rests and comes back; sends base axes to the bridge."""

    EYES, REST = np.array([1.4, 0.0, 0.9]), np.array([1.15, -0.15, 0.45])
    LOOK, REACH, TOUCH, BACK, PAUSE = 0.5, 0.8, 0.5, 0.8, 0.9

    def __init__(self, seed, touches):
        r = random.Random(seed)
        self.places = [np.array([WALL, r.uniform(-0.15, 0.15), r.uniform(0.3, 0.6)]) for _ in range(touches)]
        self.touch_s = self.LOOK + self.REACH + self.TOUCH + self.BACK + self.PAUSE

    def at(self, t):
        """Touch number, time in it, fingertip, place looked at."""
        k, t = divmod(max(t, 0.0), self.touch_s)
        k = int(k)
        if k >= len(self.places):
            return k, t, self.REST, None
        smooth = lambda s: (lambda s: 10 * s**3 - 15 * s**4 + 6 * s**5)(min(max(s, 0.0), 1.0))
        share = smooth((t - self.LOOK) / self.REACH) - smooth((t - self.LOOK - self.REACH - self.TOUCH) / self.BACK)
        # It presses 4 mm into the wall.
        pressed = self.places[k] - np.array([0.004, 0, 0])
        gaze = self.places[k] if t < self.LOOK + self.REACH + self.TOUCH else self.REST
        return k, t, self.REST + share * (pressed - self.REST), gaze


def send_hands(url, person, clock, stop):
    ws = websocket.create_connection(url, timeout=5, origin=url.replace("ws://", "http://").rsplit("/", 1)[0])
    ws.settimeout(0.0001)
    seq = 0
    began = time.monotonic()
    jitter = random.Random(7)
    while not stop.is_set():
        t = time.monotonic()
        _, _, tip, gaze = person.at(clock(t))
        shake = np.array([jitter.gauss(0, 2e-4) for _ in range(3)])
        tip = tip + shake
        hand = [None] * 26
        hand[0] = (tip + np.array([0.12, 0.0, 0.0])).tolist()
        hand[10] = tip.tolist()
        look = None
        if gaze is not None:
            look = gaze - person.EYES
            look = (look / np.linalg.norm(look)).tolist()
        seq += 1
        text = {"type": "hand", "seq": seq, "client_ms": 1000 * (t - began), "side": "right", "joints": hand,
                "head": [*(person.EYES + shake).tolist(), 0, 0, 0, 1], "gaze": look, "axes": "base", "source": "peer"}
        try:
            ws.send(json.dumps(text))
            if seq % 30 == 0:
                ws.send(json.dumps({"type": "ping", "id": seq, "client_ms": 1000 * (time.monotonic() - began)}))
            while True:
                ws.recv()
        except (websocket.WebSocketTimeoutException, BlockingIOError):
            pass
        except (OSError, websocket.WebSocketException):
            return
        time.sleep(max(0.0, t + 1 / 60 - time.monotonic()))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bridge", default="target/release/examples/bridge")
    parser.add_argument("--touches", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--least", type=int, help="touches in place for status 0; default all but one")
    parser.add_argument("--loss", type=float, default=0.0, help="share of the cycles that begin a burst of 1 to 4 lost answers")
    parser.add_argument("--stall", type=float, default=0.0, help="share of the cycles that begin a stall of 20 to 200 ms")
    parser.add_argument("--stamp-jitter-ms", type=float, default=0.0)
    parser.add_argument("--noise", type=float, default=0.0, help="of measured angles, rad; a simulator has none")
    parser.add_argument("--unknown-enums", action="store_true")
    parser.add_argument("--json")
    args = parser.parse_args()
    for flag in ("loss", "stall"):
        if not 0 <= getattr(args, flag) <= 1:
            parser.error(f"--{flag} {getattr(args, flag)}: not a share from 0 to 1")
    if shutil.which(args.bridge) is None:
        parser.error(f"--bridge {args.bridge}: no such program; cargo build --release --example bridge makes it")
    arm = Arm()
    free = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    free.bind(("127.0.0.1", 0))
    client = free.getsockname()
    free.close()
    bridge = subprocess.Popen([args.bridge, "--listen", "127.0.0.1:0", "--fri", f"127.0.0.1:{client[1]}"],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    said, url, ready = [], [], threading.Event()

    def listen():
        for line in bridge.stdout:
            said.append(line.rstrip())
            found = re.search(r"http://([0-9.:]+)", line)
            if found and not url:
                url.append(f"ws://{found.group(1)}/ws")
            if "waiting for" in line:
                ready.set()

    threading.Thread(target=listen, daemon=True).start()
    stop = threading.Event()
    rows = []
    try:
        if not ready.wait(120) or not url:
            print("\n".join(said))
            return 1
        controller, person = Controller(arm, client, args), Person(args.seed, args.touches)
        begun = []
        clock = lambda t: t - begun[0] - 3.0 if begun else -1.0
        threading.Thread(target=send_hands, args=(url[0], person, clock, stop), daemon=True).start()
        next_cycle, judged = time.monotonic(), -1
        while len(rows) < args.touches and bridge.poll() is None:
            now = time.monotonic()
            if controller.state == 4 and not begun:
                begun.append(now)
            if not begun and controller.cycle > 4000:
                print("commanding was not reached")
                break
            k, t, tip, _ = person.at(clock(now))
            if k != judged and k < args.touches and t >= person.LOOK and tip[0] <= WALL:
                judged = k
                position, rotation = arm.face()
                place = person.places[k]
                local = rotation.T @ (place - position)
                tilt = math.degrees(math.acos(max(-1.0, min(1.0, float(rotation[0, 2])))))
                in_place = abs(local[2]) <= GAP and tilt <= TILT and max(abs(local[0]), abs(local[1])) <= 0.1 - INSET
                rows.append({"touch": k, "in_place": bool(in_place), "gap_mm": 1e3 * abs(float(local[2])), "tilt_deg": tilt})
                print(f"touch {k + 1}: {'in place' if in_place else 'NOT in place'}, gap {rows[-1]['gap_mm']:.1f} mm, "
                      f"{tilt:.1f} deg, beside the middle {1e3 * max(abs(local[0]), abs(local[1])):.0f} mm", flush=True)
            controller.step(tip if k < args.touches else None)
            next_cycle = max(next_cycle + PERIOD, time.monotonic() - 5 * PERIOD)
            time.sleep(max(0.0, next_cycle - time.monotonic()))
    finally:
        stop.set()
        alive = bridge.poll() is None
        if alive:
            bridge.send_signal(2)
        try:
            bridge.wait(5)
        except subprocess.TimeoutExpired:
            bridge.kill()
    good = sum(row["in_place"] for row in rows)
    least = args.touches - 1 if args.least is None else args.least
    print("\n".join("bridge: " + line for line in said[-40:]))
    print(f"in place {good} of {args.touches}; {controller.lost} answers lost of {controller.answers}; fastest command "
          f"{controller.worst:.2f} of the joint's speed, {controller.acceleration:.1f} rad/s2, which takes a joint "
          f"{1e3 * controller.past:.1f} mrad past its way ({1e3 * PAST:.0f} allowed)"
          f"{'' if alive else '; the bridge ended by itself'}")
    if args.json:
        with open(args.json, "w") as file:
            json.dump({"touches": rows, "in_place": good, "speed_share": controller.worst, "rad_per_s2": controller.acceleration, "past_rad": controller.past, "bridge_lived": alive}, file)
    return 0 if good >= least and alive else 1


if __name__ == "__main__":
    sys.exit(main())

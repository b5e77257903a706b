"""Drives a session from another program: sends a hand that touches the front wall, prints where the board is.

    cargo run --release --example bridge            # prints its address
    pip install websocket-client
    python examples/clients/hwall_client.py --url ws://127.0.0.1:8080/ws

From another machine (`bridge --listen 0.0.0.0:8080`, or `--tls`) the address ends with the key that the bridge prints: ws://HOST:8080/ws?key=KEY.
With --tls it is wss://HOST:8443/ws?key=KEY, and --certificate names a copy of the bridge's certificate, if that is self-signed.

All messages: docs/PROTOCOL.md. Exit status 0 if the board was touched.
"""
import argparse, json, math, sys, time
import websocket

parser = argparse.ArgumentParser()
parser.add_argument("--url", default="ws://127.0.0.1:8080/ws")
parser.add_argument("--certificate", help="PEM file of a self-signed certificate to accept")
parser.add_argument("--point", default="0.62,0.0,0.55", help="the place to touch, base frame, m")
parser.add_argument("--seconds", type=float, default=8.0)
parser.add_argument("--repeat", action="store_true", help="touch again every 6 s")
parser.add_argument("--head", help="place of the head, base frame, m; default: behind the hand")
parser.add_argument("--head-to", help="from --walk-at on the head moves there, at 1.6 m/s")
parser.add_argument("--walk-at", type=float, default=2.0, help="s")
args = parser.parse_args()
place = lambda text: [float(x) for x in text.split(",")]
point = place(args.point)
stands = place(args.head) if args.head else [point[0] + 0.75, point[1] - 0.2, point[2] + 0.4]
walks_to = place(args.head_to) if args.head_to else stands

url = args.url + ("&" if "?" in args.url else "?") + "format=json"
try:
    socket = websocket.create_connection(url, timeout=60, sslopt={"ca_certs": args.certificate} if args.certificate else None)
except websocket.WebSocketBadStatusException as refused:  # 403: the key is missing or wrong
    sys.exit(f"{refused.status_code}: {(refused.resp_body or b'').decode().strip()}")
while json.loads(socket.recv())["type"] != "scene":  # the server may still prepare
    pass
socket.settimeout(0.001)
began, seq, touched, stopped_at = time.monotonic(), 0, False, None
while (t := time.monotonic() - began) < args.seconds:
    # The arm stands behind the wall and the person before it, at larger x: 2 s of rest, 1 s to reach the wall, then 15 mm into it.
    phase = t % 6.0 if args.repeat else t
    share = min(max(phase - 2.0, 0.0), 1.0)
    if args.repeat:
        share -= min(max(phase - 4.0, 0.0), 1.0)
    tip = [point[0] + 0.4 * (1 + math.cos(math.pi * share)) / 2 - 0.015 * share, point[1], point[2]]
    if stopped_at is not None:  # nothing is behind the wall there: the virtual hand stops before it
        tip[0] = max(tip[0], stopped_at + 0.02)
    joints = [None] * 26
    joints[10] = tip  # tip of the index finger
    joints[0] = [tip[0] + 0.17, tip[1], tip[2]]  # palm
    walked = min(max(t - args.walk_at, 0.0) * 1.6 / max(math.dist(stands, walks_to), 1e-9), 1.0)
    head = [a + walked * (b - a) for a, b in zip(stands, walks_to)] + [0, 0, 0, 1]
    gaze = [p - h for p, h in zip(point, head)]
    seq += 1
    socket.send(json.dumps({"type": "hand", "seq": seq, "client_ms": 1e3 * t, "side": "right", "joints": joints,
                            "head": head, "gaze": gaze, "axes": "base"}))
    until = time.monotonic() + 1 / 72
    while time.monotonic() < until:
        try:
            message = json.loads(socket.recv())
        except websocket.WebSocketTimeoutException:
            continue
        if message["type"] == "event" and message["kind"] not in ("found", "predicted"):
            print(f"{message['t']:8.3f} s  {message['kind']}: {message['text']}")
            touched |= message["kind"] == "touched"
            stopped_at = {"unreachable": point[0], "goal": None}.get(message["kind"], stopped_at)
        elif message["type"] == "view" and seq % 36 == 0:
            x, y, z = message["board"]["position"]
            print(f"{message['t']:8.3f} s  {message['state']}: board at {x:.3f}, {y:.3f}, {z:.3f} m")
raise SystemExit(0 if touched else 1)

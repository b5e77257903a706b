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
args = parser.parse_args()
point = [float(x) for x in args.point.split(",")]

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
    share = min(max(t - 2.0, 0.0), 1.0)
    tip = [point[0] + 0.4 * (1 + math.cos(math.pi * share)) / 2 - 0.015 * share, point[1], point[2]]
    if stopped_at is not None:  # nothing is behind the wall there: the virtual hand stops before it
        tip[0] = max(tip[0], stopped_at + 0.02)
    joints = [None] * 26
    joints[10] = tip  # tip of the index finger
    joints[0] = [tip[0] + 0.17, tip[1], tip[2]]  # palm
    head = [point[0] + 0.75, point[1] - 0.2, point[2] + 0.4, 0, 0, 0, 1]
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

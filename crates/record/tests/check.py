#!/usr/bin/env python3
"""Reads recordings with other people's tools.

    check.py FINISHED.mcap UNFINISHED.mcap ARM.urdf MESSAGES_FINISHED MESSAGES_UNFINISHED

Needs the packages mcap and mcap-protobuf-support; looks further with foxglove-schemas-protobuf and rerun-sdk where
they are installed. Prints a line for every check; `skipped: ...` for what could not be checked. Status 0: all that was
checked is right; 77: nothing could be checked.
"""

import importlib
import math
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as xml

SKIPPED = 77

try:
    from mcap.reader import NonSeekingReader, make_reader
    from mcap_protobuf.decoder import DecoderFactory
except ImportError as error:
    print(f"skipped: others_tools: {error}")
    sys.exit(SKIPPED)

TOPICS = {
    "/tf": "foxglove.FrameTransforms",
    "/tf_static": "foxglove.FrameTransforms",
    "/scene": "foxglove.SceneUpdate",
    "/scene/now": "foxglove.SceneUpdate",
    "/hand": "foxglove.PosesInFrame",
    "/state": "hwall.State",
    "/log": "foxglove.Log",
    "/session/setup": "hwall.Setup",
    "/session/run": "hwall.Run",
    "/session/frame": "hwall.Frame",
    "/session/world": "hwall.World",
    "/session/request": "hwall.Request",
    "/session/cycle": "hwall.Cycle",
}


def read(path, reader_of):
    """Every message, decoded by the schema in the file: topic -> list of (schema name, message)."""
    messages = {}
    with open(path, "rb") as file:
        reader = reader_of(file, decoder_factories=[DecoderFactory()])
        for schema, channel, _, message in reader.iter_decoded_messages():
            messages.setdefault(channel.topic, []).append((schema.name, message))
    return messages


def session_count(messages):
    return sum(
        len(found)
        for topic, found in messages.items()
        if topic.startswith("/session/") and topic != "/session/setup"
    )


def check_messages(messages, expected):
    for topic, schema in TOPICS.items():
        assert messages.get(topic), f"nothing on {topic}"
        names = {name for name, _ in messages[topic]}
        assert names == {schema}, (topic, names)
    assert session_count(messages) == expected, (session_count(messages), expected)
    for _, cycle in messages["/session/cycle"]:
        assert len(cycle.q_rad) == len(cycle.qd_rad_per_s) == 7
        assert len(cycle.command_values) == (7 if cycle.command else 0)
    sequences = [
        message.sequence
        for topic, found in messages.items()
        if topic.startswith("/session/") and topic != "/session/setup"
        for _, message in found
    ]
    assert sorted(sequences) == list(range(expected)), "numbers with gaps"


def check_frames(messages, urdf):
    """The transforms make one tree, and the tree is that of the URDF."""
    parents = {}
    for topic in ("/tf", "/tf_static"):
        for _, message in messages[topic]:
            for transform in message.transforms:
                child, parent = transform.child_frame_id, transform.parent_frame_id
                assert parents.setdefault(child, parent) == parent, child
                q = transform.rotation
                length = math.hypot(q.x, q.y, q.z, q.w)
                assert abs(length - 1.0) < 1e-9, (child, length)
    robot = xml.parse(urdf).getroot()
    links = {link.get("name") for link in robot.iter("link")}
    for joint in robot.iter("joint"):
        child, parent = joint.find("child").get("link"), joint.find("parent").get("link")
        assert parents.get(child) == parent, (child, parent, parents.get(child))
    known = set(parents) | {"base"}
    assert links <= known, links - known
    for topic in ("/scene", "/scene/now"):
        for _, update in messages[topic]:
            for entity in update.entities:
                assert entity.frame_id in known, entity.frame_id
    drawn = [e for _, update in messages["/scene"] for e in update.entities]
    triangles = {e.id: len(e.triangles[0].points) for e in drawn if e.triangles}
    assert triangles == {"surface/wall": 6, "surface/door": 6}, triangles
    assert any(e.spheres for _, u in messages["/scene/now"] for e in u.entities)
    arrows = [a for _, u in messages["/scene/now"] for e in u.entities for a in e.arrows]
    assert arrows, "the hand presses, and no arrow says so"
    assert max(m.openings[0] for _, m in messages["/state"]) > 0.01, "the door stays shut"


def check_schemas(messages):
    """Numbers, types and enumerations against those that Foxglove publishes."""
    compared = 0

    def compare(ours, theirs):
        nonlocal compared
        fields = lambda d: {
            (f.number, f.name, f.type, f.message_type and f.message_type.full_name) for f in d.fields
        }
        assert fields(ours) == fields(theirs), (ours.full_name, fields(ours) ^ fields(theirs))
        values = lambda d: {(e.name, v.name, v.number) for e in d.enum_types for v in e.values}
        assert values(ours) == values(theirs), ours.full_name
        compared += 1
        for field in ours.fields:
            if field.message_type:
                compare(field.message_type, theirs.fields_by_name[field.name].message_type)

    for topic, schema in TOPICS.items():
        if schema.startswith("foxglove."):
            name = schema.split(".")[1]
            module = importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2")
            _, message = messages[topic][0]
            compare(message.DESCRIPTOR, getattr(module, name).DESCRIPTOR)
    return compared


def check_with_rerun(path, *options):
    beside = os.path.join(os.path.dirname(sys.executable), "rerun")
    rerun = beside if os.path.exists(beside) else shutil.which("rerun")
    if rerun is None:
        return None
    run = subprocess.run([rerun, "mcap", "check", "--full", *options, path], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    lines = [line for line in run.stdout.splitlines() if "/" in line and "──" not in line]
    rows = [line for line in lines if line.rstrip().endswith("—")]
    assert len(rows) >= 12 and all(row.startswith("ok") for row in rows), run.stdout
    return len(rows)


def main():
    finished, unfinished, urdf, count, count_unfinished = sys.argv[1:6]
    messages = read(finished, make_reader)
    check_messages(messages, int(count))
    assert len(messages["/session/end"]) == 1
    check_frames(messages, urdf)
    total = sum(len(found) for found in messages.values())
    print(f"ok: mcap reads {total} messages of {len(messages)} channels")
    # Both ways of reading: by the summary, which an unfinished file has not, and from front to back.
    for reader in (make_reader, NonSeekingReader):
        left = read(unfinished, reader)
        assert "/session/end" not in left
        assert session_count(left) == int(count_unfinished), session_count(left)
    print(f"ok: mcap reads {count_unfinished} messages of an unfinished session")
    try:
        print(f"ok: {check_schemas(messages)} messages are as Foxglove publishes them")
    except ModuleNotFoundError as error:
        print(f"skipped: others_tools: {error}")
    # An unfinished file has no summary, which rerun wants to be told.
    for path, options in ((finished, ()), (unfinished, ("--recover",))):
        rows = check_with_rerun(path, *options)
        if rows is None:
            print("skipped: others_tools: no rerun")
            break
        print(f"ok: rerun finds nothing wrong on {rows} channels")


if __name__ == "__main__":
    main()

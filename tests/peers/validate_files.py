#!/usr/bin/env python3
"""Other people's readers beside this project's: poses of URDF files by Pinocchio, areas of OBJ files by trimesh.

    cargo build --release --locked --example arm_state
    cargo build --release --locked -p hwall-scene --example ask_a_room
    python tests/peers/validate_files.py [FILE.urdf FILE.obj ...]

Without files: those of the project. Needs the packages pin and trimesh, and says `skipped` of what is missing. Exit status 0 if all agree.
"""
import argparse, csv, io, math, pathlib, random, re, subprocess, sys

PROJECT = pathlib.Path(__file__).resolve().parents[2]
POSES = 20
POSE_ERROR = 1e-9  # m, and entries of rotations
AREA_ERROR = 1e-5  # relative; ours are printed with six decimals


class Unread(Exception):
    """Their reader cannot read a file, or reads it wrongly."""


def asked(read, *words, **settings):
    try:
        return read(*words, **settings)
    except Exception as error:  # of any kind: it is their code
        raise Unread(str(error).strip().split("\n")[-1]) from error


def run(program, *words, text=None):
    done = subprocess.run([program, *map(str, words)], input=text, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr.strip() or f"status {done.returncode}")
    return done


def chain_of(pin, model, root, tip):
    """Ids of the frames at both ends, and of the joints between them."""
    for name in (root, tip):
        if not model.existFrame(name):
            raise RuntimeError(f"Pinocchio knows no link {name}")
    ends = [model.getFrameId(name) for name in (root, tip)]
    above, below = (list(model.supports[model.frames[end].parentJoint]) for end in ends)
    return ends, [joint for joint in below if joint not in above]


def urdf_error(pin, program, path, random_of):
    """The largest difference over some postures, and what was compared."""
    model = asked(pin.buildModelFromUrdf, str(path))
    data = model.createData()
    # One posture of too many joints tells the number and the ends.
    said = subprocess.run([program, "--arm", str(path)], input="q1\n0\n", capture_output=True, text=True).stderr
    found = re.search(r"(\d+) joints? from (\S+) to (\S+)", said)
    if not found:
        raise RuntimeError(said.strip())
    count, root, tip = int(found[1]), found[2], found[3]
    (root_id, tip_id), joints = chain_of(pin, model, root, tip)
    if len(joints) != count:
        raise RuntimeError(f"{count} joints here, {len(joints)} in Pinocchio")
    rows = [[random_of.uniform(-1.5, 1.5) for _ in joints] for _ in range(POSES)]
    table = [[f"q{i + 1}" for i in range(count)]] + [[repr(q) for q in row] for row in rows]
    answer = run(program, "--arm", path, text="\n".join(map(",".join, table)) + "\n").stdout
    names = ["px", "py", "pz"] + [f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)]
    worst = 0.0
    for q, ours in zip(rows, csv.DictReader(io.StringIO(answer)), strict=True):
        posture = pin.neutral(model)
        for joint, angle in zip(joints, q):
            at = model.joints[joint].idx_q
            # Endless joints are cosine and sine there.
            values = [angle] if model.joints[joint].nq == 1 else [math.cos(angle), math.sin(angle)]
            posture[at:at + len(values)] = values
        pin.framesForwardKinematics(model, data, posture)
        pose = data.oMf[root_id].actInv(data.oMf[tip_id])
        theirs = [*pose.translation, *pose.rotation.flatten()]
        worst = max([worst] + [abs(float(ours[name]) - value) for name, value in zip(names, theirs)])
    return worst, f"{count} joints from {root} to {tip}, {POSES} poses", POSE_ERROR


def obj_error(trimesh, program, path):
    """The largest relative difference of areas, and what was compared."""
    faces = re.findall(r"^f((?:[ \t]+\S+)+)", path.read_text(errors="replace"), re.M)
    if any(len(corners.split()) > 4 for corners in faces):
        raise Unread("concave polygons are cut as fans there")
    said = run(program, path).stdout
    ours = {name: float(area) for name, area in re.findall(r"^- (.*): \w+, ([\d.]+) m²$", said, re.M)}
    scene = asked(trimesh.load, str(path), process=False, split_object=True, group_material=False, force="scene")
    theirs = sum(mesh.area for mesh in scene.geometry.values())
    return abs(sum(ours.values()) / theirs - 1.0), f"{len(ours)} surfaces, {theirs:.4f} m²", AREA_ERROR


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("files", nargs="*", type=pathlib.Path)
    arguments.add_argument("--programs", type=pathlib.Path, default=PROJECT / "target/release/examples")
    given = arguments.parse_args()
    files = given.files or [
        *sorted((PROJECT / "crates/kinematics/tests/data").glob("*.urdf")),
        PROJECT / "tests/peers/iiwa7.urdf",
        *sorted((PROJECT / "examples/assets").glob("*.obj")),
    ]
    readers = {}
    for kind, package in ((".urdf", "pinocchio"), (".obj", "trimesh")):
        try:
            readers[kind] = __import__(package)
        except ImportError as missing:
            print(f"skipped: {missing}")
    failed = False
    for path in files:
        reader = readers.get(path.suffix)
        if not reader:
            continue
        try:
            if path.suffix == ".urdf":
                error, what, most = urdf_error(reader, given.programs / "arm_state", path, random.Random(1))
            else:
                error, what, most = obj_error(reader, given.programs / "ask_a_room", path)
            agrees = error <= most
            print(f"{'agrees' if agrees else 'DIFFERS'}: {path.name}: {what}, largest difference {error:.1e}")
        except Unread as error:
            print(f"skipped: {path.name}: {reader.__name__}: {error}")
            continue
        except (RuntimeError, ValueError) as error:
            agrees = False
            print(f"DIFFERS: {path.name}: {error}")
        failed |= not agrees
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())

"""Prediction of touches, sessions, simulated people, recordings, textures."""

import numpy as np
import pytest
from conftest import START

import hwall
from hwall import contact, sim, texton


def reach(end, duration):
    """A straight reach of minimum jerk, as in crates/contact/README.md."""
    tau = np.linspace(0, 1, 61)
    share = tau**3 * (10 - 15 * tau + 6 * tau * tau)
    path = np.array([0, 0, 1.0]) + share[:, None] * (np.array(end) - [0, 0, 1.0])
    return contact.Reach(tau * duration, path)


@pytest.fixture(scope="module")
def model():
    place = lambda k: (0.6, 0.08 * (k % 5) - 0.16, 0.9 + 0.07 * (k % 7))
    return contact.LearnedModel.fit([reach(place(k), 0.7 + 0.02 * (k % 3)) for k in range(20)])


def test_the_end_of_a_reach_is_predicted_half_way(model, tmp_path):
    # Figures of crates/contact/README.md.
    new, estimator = reach((0.6, 0.1, 1.2), 0.72), model.estimator()
    estimator.begin()
    estimates = [estimator.step(frame) for frame in new.frames]
    half_way = [estimate for estimate in estimates if estimate][30]
    assert np.linalg.norm(half_way["point"] - new.contact) < 0.02
    assert abs(half_way["time_to_contact"] - 0.36) < 0.05
    assert half_way["covariance"].shape == (3, 3) and half_way["time_sd"] > 0.0
    model.save(tmp_path / "model.json")
    again = contact.LearnedModel.load(tmp_path / "model.json").estimator()
    again.begin()
    assert np.array_equal([again.step(frame) for frame in new.frames][30]["point"], estimates[30]["point"])


def test_surfaces_are_ranked(model):
    room = hwall.Scene.from_obj_str("o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 2\nv 0.6 -1 2\nf 1 4 3 2\n")
    for predictor in (contact.Predictor(room, model, simulated=True), contact.Predictor(room, simulated=True)):
        for frame in reach((0.6, 0.1, 1.2), 0.72).frames[:45]:
            ranked = predictor.step(frame)
        assert ranked[0]["surface"] == "wall" and sum(r["probability"] for r in ranked) == pytest.approx(1.0)
        assert np.abs(ranked[0]["point"] - [0.6, 0.1, 1.2]).max() < 0.1
        predictor.touched([0.6, 0.1, 1.2], 0.72)
        predictor.reset()


def session_with_a_person(arm, scene, **options):
    session = hwall.Session(arm, scene, simulated=True, prepared=False, **options)
    person = sim.Person(7, head=[1.4, 0, 0.9], hand=[1.15, -0.15, 0.45])
    touches = person.plan([[0.6, 0.1, 0.5], [0.6, -0.1, 0.4]], [1, 0, 0])
    servo, events, cycle = sim.ServoArm(session.arm, START, seed=3), [], 0
    while servo.t < touches.duration:
        if cycle % 14 == 0:
            session.frame(touches.frame(servo.t))
        servo.command(session.step(servo.t, servo.q, servo.qd, servo.torque))
        session.plan()
        servo.push(*sim.finger_force(servo.pose, *touches.tip(servo.t)))
        servo.advance(1e-3)
        events += session.events()
        cycle += 1
    return touches, events


def test_a_session_puts_the_board_in_place_and_feels_both_touches(arm, scene):
    touches, events = session_with_a_person(arm, scene)
    truth = touches.truth
    felt = [e for e in events if e["event"] == "touched"]
    assert len(felt) == 2 and len([e for e in events if e["event"] == "released"]) == 2
    for touch, event in zip(truth, felt):
        assert 0.0 < event["t"] - touch["contact"] < 0.06 and event["force"] > 2.0
        goal = [e for e in events if e["event"] == "goal_set" and e["t"] < touch["contact"]][-1]
        arrived = [e for e in events if e["event"] == "arrived" and goal["t"] < e["t"] < touch["contact"]]
        assert arrived and goal["surface"] == "wall"
        assert np.abs(goal["point"] - touch["target"]).max() < 0.05
    again = session_with_a_person(arm, scene)[1]
    assert [(e["t"], e["event"]) for e in again] == [(e["t"], e["event"]) for e in events]


@pytest.mark.parametrize("requires_torque", [True, False])
def test_without_torques_the_arm_moves_only_if_that_is_said(arm, scene, requires_torque):
    session = hwall.Session(arm, scene, simulated=True, prepared=False, requires_torque=requires_torque)
    servo, person = sim.ServoArm(arm, START), sim.Person(7, head=[1.4, 0, 0.9], hand=[1.15, -0.15, 0.45])
    touches, kinds = person.plan([[0.6, 0.1, 0.5]], [1, 0, 0]), set()
    for cycle in range(2000):
        if cycle % 14 == 0:
            session.frame(touches.frame(servo.t))
        command = session.step(servo.t, servo.q, servo.qd)
        session.plan()
        servo.command(command)
        servo.advance(1e-3)
        kinds.add(command[0])
    assert ("position" in kinds) != requires_torque
    assert not requires_torque or "torque" in session.reason


def test_a_session_holds_on_bad_input_and_says_why(arm, scene):
    session = hwall.Session(arm, scene, simulated=True, prepared=False)
    assert session.step(0.0, [np.nan] * 7, np.zeros(7)) == ("hold", None)
    assert session.state in ("holding", "safe") and session.reason
    with pytest.raises(hwall.Error, match="q has 6 values, the arm has 7 joints"):
        session.step(0.001, np.zeros(6), np.zeros(7))
    session.stop()
    session.step(0.002, START, np.zeros(7))
    assert session.state == "safe"
    session.reset()
    with pytest.raises(hwall.Error, match="half_width"):
        hwall.Session(arm, scene, board=(-0.1, 0.1, 0.02))


def test_the_arm_keeps_away_from_the_room_and_waits_for_required_parts(arm, scene):
    floor = [[0, 0, -0.6, 0, 0, 1]]
    free = session_with_a_person(arm, scene, room=hwall.Room(floor))[1]
    arrived = lambda events: [e for e in events if e["event"] == "arrived"]
    assert arrived(free)
    # A table where the arm stands.
    blocked = session_with_a_person(arm, scene, room=hwall.Room(floor, [[0.5, 0, 0.5, 0.6, 0.6, 0.6, 0]]))[1]
    assert not arrived(blocked)
    missing = session_with_a_person(arm, scene, required=["elbow"])[1]
    assert not arrived(missing)
    for bad, message in [
        (lambda: hwall.Room(), "the room is empty"),
        (lambda: hwall.Room([[0, 0, 0, 0, 0, 0]]), "row 0: .*normal"),
        (lambda: hwall.Room(None, [[0, 0, 0, 1, 1, -1, 0]]), "row 0: .*half_extent_m"),
        (lambda: hwall.Room(floor * 17), "16"),
        (lambda: hwall.Room(np.zeros((2, 5))), r"planes has the shape \(2, 5\)"),
        (lambda: hwall.Session(arm, scene, required=["foot"]), 'part "foot" is not one of'),
        (lambda: hwall.Session(arm, scene, supervised=False, room=hwall.Room(floor)), "supervised"),
    ]:
        with pytest.raises(hwall.Error, match=message):
            bad()


def test_a_prepared_session_waits_somewhere(arm, scene):
    session = hwall.Session(arm, scene)
    low, high = arm.limits.T
    assert session.waits_at.shape == (7,) and (session.waits_at > low).all() and (session.waits_at < high).all()


def test_a_simulated_arm_goes_where_it_is_sent(arm):
    servo = sim.ServoArm(arm, START, torque_noise=0.0)
    goal = START + 0.1
    servo.command(("position", goal))
    for _ in range(2000):
        servo.advance(1e-3)
    assert np.abs(servo.q - goal).max() < 1e-9 and np.abs(servo.qd).max() < 1e-9
    assert np.allclose(servo.pose, arm.forward(goal), atol=1e-9)
    servo.push([0, 0, -10.0])
    servo.advance(1e-3)
    assert np.allclose(servo.torque, arm.jacobian(servo.q).T @ [0, 0, -10, 0, 0, 0], atol=1e-9)
    with pytest.raises(hwall.Error):
        servo.push([np.nan, 0, 0])
    with pytest.raises(hwall.Error):
        sim.ServoArm(arm, START + 10)


def test_recordings_go_out_and_come_back(tmp_path):
    t = 0.01 * np.arange(50)
    index = np.column_stack([t, 0 * t, 1 + 0 * t])
    index[10] = np.nan
    given = [{"person": "P1", "trial": "1", "t": t, "index": index, "head": index + 1}]
    hwall.write_recordings(tmp_path / "hands.csv", given)
    back = hwall.read_recordings(tmp_path / "hands.csv")
    assert len(back) == 1 and back[0]["person"] == "P1" and np.allclose(back[0]["t"], t)
    assert np.array_equal(np.isnan(back[0]["index"]), np.isnan(index))
    assert np.allclose(back[0]["index"], index, equal_nan=True)
    given[0]["t"] = t[::-1].copy()
    with pytest.raises(hwall.Error, match="time 0.48 s does not follow 0.49 s"):
        hwall.write_recordings(tmp_path / "hands.csv", given)
    with pytest.raises(hwall.Error, match="No such file"):
        contact.reaches_from_csv(tmp_path / "none.csv")


def test_reaches_are_cut_from_recordings(tmp_path):
    given = []
    for k in range(8):
        new = reach((0.6, 0.05 * k, 1.2), 0.7 + 0.02 * k)
        given.append({"person": "P1", "trial": str(k), "t": new.t, "index": new.position})
    hwall.write_recordings(tmp_path / "hands.csv", given)
    reaches = contact.reaches_from_csv(tmp_path / "hands.csv")
    assert len(reaches) == 8 and reaches[3].person == "P1"
    assert np.abs(reaches[3].contact - [0.6, 0.15, 1.2]).max() < 0.01


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: hwall.Frame(np.nan), "t is NaN, not a finite number"),
        (lambda: hwall.Frame(0.0, index=[0, np.nan, 0]), "index[1] is NaN, not a finite number"),
        (lambda: hwall.Frame(0.0, nose=[0, 0, 0]), 'point "nose" is not one of palm'),
        (lambda: contact.Reach([0.0, 1.0], np.zeros((3, 3))), "2 times and 3 rows of position"),
        (lambda: contact.Reach([0.0, 0.0], np.zeros((2, 3))), "time 0 s does not follow 0 s"),
        (lambda: contact.LearnedModel.fit([]), ""),
        (lambda: sim.Person(kind="tall"), 'kind "tall" is not one of plain'),
    ],
)
def test_what_makes_no_sense_is_refused(make, words):
    with pytest.raises(hwall.Error) as refused:
        make()
    assert words in str(refused.value)


def test_a_patch_is_what_the_rust_documentation_says(tmp_path):
    # crates/texton/README.md: 36 bumps on 30 x 20 mm, a solid mesh.
    patch = texton.Patch(texton.Texture.released(), [30, 20])
    assert len(patch.centres) == 36 and not any(fault for fault, _ in patch.print_check())
    points, triangles = patch.mesh(0.01)
    a, b, c = points[triangles].transpose(1, 0, 2)
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    assert volume == pytest.approx(patch.volume, rel=2e-2)
    heights = patch.heights(0.05)
    assert heights.shape == (400, 600) and heights.max() == pytest.approx(texton.Texture.released().height, rel=1e-2)
    patch.write_mesh(tmp_path / "patch.stl")
    # Binary STL: 80 bytes, the number of triangles, 50 bytes for each.
    assert np.fromfile(tmp_path / "patch.stl", "<u4", 1, offset=80)[0] == len(triangles)
    patch.write_exr(tmp_path / "patch.exr")
    assert (tmp_path / "patch.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01"


def test_designs_have_the_ratios_that_were_asked_for():
    # crates/texton/README.md: ratios 1, 2, 4 for a stereolithographic printer.
    best = texton.design([1.0, 2.0, 4.0], "sla")[0]
    levels = best["levels"]
    assert levels[2]["magnitude"] / levels[0]["magnitude"] == pytest.approx(4.0, rel=1e-6)
    assert best["texture"].gap >= 0.5 - 1e-9 and best["given_up"]
    with pytest.raises(hwall.Error):
        texton.design([1.0, 1e6])
    with pytest.raises(hwall.Error):
        texton.Texture([-1.0, 1.0], 1.0, [3.0, 3.0])


def test_roughness_comes_with_its_source():
    for told in texton.Texture.released().roughness(90.0, 40.0):
        assert told["model"] and told["source"] and (told["value"] is None or np.isfinite(told["value"]))

"""Arms: against the references of the Rust tests, Pinocchio and scipy; invalid input gives the messages of the Rust libraries."""

import threading

import numpy as np
import pytest
from conftest import data, load, pose

import hwall

AT_NOWHERE = np.eye(4)
AT_NOWHERE[0, 3] = np.nan


def test_forward_and_jacobian_are_those_of_pinocchio(arm):
    # crates/kinematics/tests/data/README.md: made with Pinocchio 4.1.0.
    reference = load("kinematics/tests/data/kinematics_dynamics.json")
    entries = reference["random"] + reference["hard"]
    q = np.array([entry["q"] for entry in entries])
    poses = np.array([pose(entry) for entry in entries])
    jacobians = np.array([entry["Jw"] for entry in entries]).reshape(-1, 6, 7)
    assert np.abs(arm.forward(q) - poses).max() < 1e-14
    assert np.abs(arm.jacobian(q) - jacobians).max() < 1e-14
    assert np.array_equal(arm.forward(q)[3], arm.forward(q[3]))
    assert np.array_equal(arm.jacobian(q)[3], arm.jacobian(q[3]))


def test_verdicts_are_those_of_the_reference(arm):
    # crates/kinematics/tests/data/README.md: 744 poses, most of them near a limit.
    entries = load("kinematics/tests/data/reach_poses.json")["poses"]
    poses = np.array([pose(entry) for entry in entries])
    expected = np.array([entry["reachable"] for entry in entries])
    verdicts = arm.verdict(poses)
    assert np.array_equal(verdicts.reachable, expected)
    assert np.array_equal(arm.is_reachable(poses), expected)
    assert np.array_equal(verdicts.code == 0, expected)
    assert np.isnan(verdicts.q[~expected]).all()
    witnesses = verdicts.q[expected]
    assert np.abs(arm.forward(witnesses) - poses[expected]).max() < 1e-12
    low, high = arm.limits.T
    assert (witnesses >= low).all() and (witnesses <= high).all()
    for index in range(0, len(poses), 50):
        one = arm.verdict(poses[index])
        assert one.reachable == expected[index] == bool(one) == arm.is_reachable(poses[index])
        assert hwall.Verdicts.KINDS[verdicts.code[index]] == (one.kind or "")


def test_a_verdict_names_its_reason(arm):
    far = np.eye(4)
    far[:3, 3] = 2.0, 0.0, 0.34
    verdict = arm.verdict(far)
    # Reaches 0.926 m from the shoulder, flange included; the flange points up, so the wrist is 0.126 m below.
    gap = np.hypot(2.0, 0.126) - 0.8
    assert not verdict and verdict.q is None and verdict.kind == "too_far"
    assert verdict.gap == pytest.approx(gap, abs=1e-12)
    assert verdict.reason == f"too far by {gap:.4f} m"


def test_nearest_holds_the_pose_and_stays_near(arm, random_q):
    poses = arm.forward(random_q)
    nearest = arm.nearest(poses, random_q)
    assert nearest.reachable.all() and not nearest.branch_changed.any()
    assert np.abs(arm.forward(nearest.q) - poses).max() < 1e-12
    assert nearest.largest_move.max() < 1e-5
    one = arm.nearest(poses[0], random_q[1], policy="any")
    assert np.abs(arm.forward(one.q) - poses[0]).max() < 1e-12
    far = poses[:2].copy()
    far[1, 0, 3] = 3.0
    assert list(arm.nearest(far, random_q[0]).reachable) == [True, False]
    with pytest.raises(hwall.Error, match=r"^unreachable: too far by "):
        arm.nearest(far[1], random_q[0])


def test_margins_are_inside_what_is_reachable(arm, random_q):
    rng = np.random.default_rng(2)
    for at in arm.forward(random_q[:20]):
        radius = arm.position_margin(at)
        poses = np.repeat(at[None], 50, axis=0)
        poses[:, :3, 3] += 0.999 * radius * np.array([d / np.linalg.norm(d) for d in rng.normal(size=(50, 3))])
        assert arm.is_reachable(poses).all()
        assert 0.0 <= arm.joint_margin(at) and 0.0 <= arm.orientation_margin(at)
    far = np.eye(4)
    far[0, 3] = 3.0
    assert arm.position_margin(far) is None and arm.joint_margin(far) is None


def test_an_arm_from_urdf(arm, random_q):
    exact = hwall.Arm.from_urdf(data("kinematics/tests/data/iiwa7.urdf"), tip="lbr_link_ee")
    assert exact.exact and exact.joint_count == 7
    assert arm.joint_names == [f"A{i}" for i in range(1, 8)] and len(exact.with_tool(np.eye(4)).joint_names) == 7
    assert np.abs(exact.forward(random_q) - arm.forward(random_q)).max() < 1e-5
    ur5 = hwall.Arm.from_urdf(data("kinematics/tests/data/ur5.urdf"), tip="flange")
    q = np.array([0.3, -1.2, 1.4, -0.7, 0.9, 0.2])
    assert not ur5.exact and ur5.joint_count == 6 and ur5.jacobian(q).shape == (6, 6)
    verdict = ur5.verdict(ur5.forward(q))
    assert verdict and np.abs(ur5.forward(verdict.q) - ur5.forward(q)).max() < 1e-8
    with pytest.raises(hwall.Error, match="the chain"):
        ur5.is_reachable(np.eye(4))


def test_a_tool_moves_all_poses(arm, random_q):
    scipy = pytest.importorskip("scipy.spatial.transform")
    tool = np.eye(4)
    tool[:3, :3] = scipy.Rotation.from_rotvec([0.1, 0.4, -0.3]).as_matrix()
    tool[:3, 3] = 0.01, 0.02, 0.1
    with_tool = arm.with_tool(tool)
    assert np.abs(with_tool.forward(random_q) - arm.forward(random_q) @ tool).max() < 1e-14
    assert with_tool.verdict(with_tool.forward(random_q)).reachable.all()


def test_pinocchio_agrees(arm, random_q):
    pinocchio = pytest.importorskip("pinocchio")
    model = pinocchio.buildModelFromUrdf(str(data("kinematics/tests/data/iiwa7.urdf")))
    exact = hwall.Arm.from_urdf(data("kinematics/tests/data/iiwa7.urdf"), tip="lbr_link_ee")
    memory, frame = model.createData(), model.getFrameId("lbr_link_ee")
    poses, jacobians = exact.forward(random_q[:200]), exact.jacobian(random_q[:200])
    worst = 0.0
    for q, at, jacobian in zip(random_q, poses, jacobians):
        pinocchio.framesForwardKinematics(model, memory, q)
        axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        theirs = pinocchio.computeFrameJacobian(model, memory, q, frame, axes)
        worst = max(worst, np.abs(memory.oMf[frame].homogeneous - at).max(), np.abs(theirs - jacobian).max())
    # The file rounds right angles; the exact arm has exact ones.
    assert worst < 1e-5


def test_arrays_of_any_kind_are_read(arm, random_q):
    expected = arm.forward(random_q)
    assert np.array_equal(arm.forward(np.asfortranarray(random_q)), expected)
    assert np.array_equal(arm.forward(np.repeat(random_q, 2, axis=0)[::2]), expected)
    assert np.array_equal(arm.forward(random_q.tolist()), expected)
    assert np.array_equal(arm.forward(random_q.astype(">f8")), expected)
    assert np.array_equal(arm.forward(random_q.astype(object)), expected)
    assert np.array_equal(arm.forward(np.ma.array(random_q)), expected)
    locked = random_q.copy()
    locked.setflags(write=False)
    assert np.array_equal(arm.forward(locked), expected)
    single = random_q.astype(np.float32)
    assert np.array_equal(arm.forward(single), arm.forward(single.astype(float)))
    assert arm.forward(np.empty((0, 7))).shape == (0, 4, 4)
    assert len(arm.verdict(np.empty((0, 4, 4)))) == 0


def test_tables_of_pandas_are_read(arm, random_q):
    pandas = pytest.importorskip("pandas")
    assert np.array_equal(arm.forward(pandas.DataFrame(random_q)), arm.forward(random_q))
    assert np.array_equal(arm.forward(pandas.Series(random_q[0])), arm.forward(random_q[0]))
    with pytest.raises(hwall.Error, match=r"q\[1\] is NaN"):
        arm.forward(pandas.Series([0, None] * 3 + [0], dtype="Int64"))


@pytest.mark.parametrize(
    ("q", "words"),
    [
        ([np.nan] * 7, "q[0] is NaN, not a finite number"),
        ([0, 0, np.inf, 0, 0, 0, 0], "q[2] is inf, not a finite number"),
        ([0.0] * 6, "q has 6 values, the arm has 7 joints"),
        (np.zeros((2, 3, 7)), "q has the shape (2, 3, 7), it must be (7,) or (n, 7)"),
        (np.zeros((2, 7)) + [[0], [np.nan]], "row 1: q[0] is NaN, not a finite number"),
    ],
)
def test_bad_configurations_are_refused(arm, q, words):
    with pytest.raises(hwall.Error) as refused:
        arm.forward(q)
    assert str(refused.value) == words
    assert isinstance(refused.value, ValueError)


@pytest.mark.parametrize(
    ("q", "error", "words"),
    [
        (np.ma.masked_greater(np.arange(7.0), 5), hwall.Error, "an array with masked values: fill them or leave them out"),
        (np.zeros(7) + 1j, TypeError, "values of type complex128, not real numbers"),
        (["0"] * 7, TypeError, "values of type <U1, not real numbers"),
        (np.zeros(7, "m8[s]"), TypeError, "values of type timedelta64[s], not real numbers"),
    ],
)
def test_values_that_a_conversion_would_lose_are_refused(arm, q, error, words):
    with pytest.raises(error) as refused:
        arm.forward(q)
    assert str(refused.value) == words


@pytest.mark.parametrize(
    ("pose_", "words"),
    [
        (np.full((4, 4), np.nan), "the last row of the matrix is [NaN, NaN, NaN, NaN], not [0, 0, 0, 1]: is it transposed?"),
        (np.diag([1, 1, 2, 1.0]), "not a rotation: 3 away from one"),
        (np.diag([1, 1, -1, 1.0]), "not a rotation: 2 away from one"),
        (np.eye(3), "T has the shape (3, 3), it must be (4, 4) or (n, 4, 4)"),
        (AT_NOWHERE, "position[0] is NaN, not a finite number"),
    ],
)
def test_bad_poses_are_refused(arm, pose_, words):
    for ask in (arm.verdict, arm.is_reachable, arm.position_margin, lambda at: arm.nearest(at, np.zeros(7))):
        with pytest.raises(hwall.Error) as refused:
            ask(pose_)
        assert str(refused.value).startswith(words[:40])
    with pytest.raises(hwall.Error) as refused:
        arm.verdict(pose_)
    assert str(refused.value) == words


def test_wrong_files_and_names_are_refused(arm, tmp_path):
    with pytest.raises(hwall.Error, match="none.urdf: No such file"):
        hwall.Arm.from_urdf(tmp_path / "none.urdf")
    (tmp_path / "bad.urdf").write_text("<robot")
    with pytest.raises(hwall.Error):
        hwall.Arm.from_urdf(tmp_path / "bad.urdf")
    with pytest.raises(hwall.Error, match="of prefer, keep, any"):
        arm.nearest(np.eye(4), np.zeros(7), policy="best")


def test_other_threads_run_during_long_calls(arm):
    """A call on many poses releases the interpreter."""
    poses = np.repeat(arm.forward(np.full(7, 0.3))[None], 300_000, axis=0)
    ticks, done = [], threading.Event()

    def count():
        while not done.is_set():
            ticks.append(0)
            done.wait(1e-4)

    thread = threading.Thread(target=count)
    thread.start()
    before = len(ticks)
    arm.verdict(poses)
    during = len(ticks) - before
    done.set()
    thread.join()
    assert during > 3

"""Hostile values in every argument of every call: a result or a named error, never a panic and never a silent NaN."""

import itertools

import numpy as np
import pytest
from conftest import START, WALL

import hwall
from hwall import bip, contact, sim, texton

NUMBERS = [np.nan, np.inf, -np.inf, 0.0, -1.0, 1e-300, 1e300]
ARRAYS = [[], [np.nan], [0.0] * 3, [1e300] * 3, [np.inf] * 7, np.zeros((3, 3)), np.zeros((0, 3)), np.zeros((0, 4, 4)), np.zeros((2, 2, 2, 2)), np.nan]
OBJECTS = [None, "", "nan", b"x", {}, object(), 1 + 2j, [[1.0], [1.0, 2.0]]]

ARM = hwall.Arm.iiwa7()
SCENE = hwall.Scene.from_obj_str(WALL)
DOOR = hwall.Scene.from_obj_str(
    "o door\nv 1 0 0\nv 1 -1 0\nv 1 -1 2\nf 1 2 3\n", '[surface.door]\nkind = "drawer"\ndirection = [1, 0, 0]\nrange_m = [0, 0.4]\n'
)
POSE = ARM.forward(START)
MAP = hwall.reach_map(ARM, [0.0], [0.5], [0.3, 0.5])
REGION = hwall.wall_region(ARM, 0.0, 0.5, accuracy=1e-3)
MODEL = bip.fit([np.column_stack([np.linspace(0, d, 30)] * 2) for d in (0.4, 0.5, 0.6)], [0], tune=False)
TOUCHES = sim.Person(1).plan([[0.6, 0, 1.0]], [1, 0, 0])
TEXTURE = texton.Texture.released()
PATCH = texton.Patch(TEXTURE, [10, 10])
SESSION = hwall.Session(ARM, SCENE, simulated=True, prepared=False)
T = np.linspace(0, 1, 20)

CALLS = {
    "forward": (ARM.forward, [START], {}),
    "jacobian": (ARM.jacobian, [START], {}),
    "with_tool": (ARM.with_tool, [POSE], {}),
    "verdict": (ARM.verdict, [POSE], {}),
    "is_reachable": (ARM.is_reachable, [POSE], {}),
    "nearest": (ARM.nearest, [POSE, START], {"policy": "any"}),
    "position_margin": (ARM.position_margin, [POSE], {"cone": 0.1}),
    "orientation_margin": (ARM.orientation_margin, [POSE], {"radius": 0.1}),
    "joint_margin": (ARM.joint_margin, [POSE], {}),
    "reach_map": (hwall.reach_map, [ARM, [0.0], [0.5], [0.3]], {"accuracy": 1e-6, "roll": 0.0}),
    "wall_region": (hwall.wall_region, [ARM, 0.0, 0.5], {"accuracy": 1e-2, "heights": [0.2, 0.4], "roll": 0.0}),
    "look_up": (MAP.look_up, [[0.5, 0, 0.3], [1, 0, 0]], {}),
    "map.is_reachable": (MAP.is_reachable, [[0.5, 0, 0.3], [1, 0, 0]], {}),
    "mask": (MAP.mask, [T], {}),
    "contains": (REGION.contains, [[0.0, 0.4]], {}),
    "base_placement": (hwall.base_placement, [ARM, [[0.6, 0, 0.4]], [1, 0, 0], [0.0], [0.0]], {"z": 0.0, "headings": [0.0], "best": 1, "least_behind": 0.1}),
    "places_on_wall": (hwall.places_on_wall, [[0.6, 0, 0], [1, 0, 0], 1.0, [0.2, 0.8], 0.3], {}),
    "placed": (SCENE.placed, [np.eye(4)], {}),
    "opened": (DOOR.opened, ["door", 0.1], {}),
    "ray_cast": (SCENE.ray_cast, [[2, 0, 1], [-1, 0, 0]], {}),
    "closest_point": (SCENE.closest_point, [[2, 0, 1]], {"max_distance": 3.0}),
    "fit": (bip.fit, [[np.column_stack([T, T]), np.column_stack([T, 2 * T])]], {"observed": [0], "period": 0.1, "functions": 4, "tune": False}),
    "fit times": (bip.fit, [[np.column_stack([T, T])]], {"times": [T], "basis": "gaussian", "tune": False}),
    "mean": (MODEL.mean, [0.5], {}),
    "update": (lambda *a, **k: MODEL.filter().update(*a, **k), [[0.1]], {"dt": 1.0, "columns": [0]}),
    "observe_at": (lambda *a, **k: MODEL.filter().observe_at(*a, **k), [[0.1], 0.1, [0]], {"phase": 1.0}),
    "predict": (lambda *a, **k: MODEL.filter().predict(*a, **k), [1.0], {"level": 0.9}),
    "Frame": (hwall.Frame, [0.0], {"head": [0, 0, 1], "gaze": [1, 0, 0], "index": [0, 0, 1]}),
    "Reach": (contact.Reach, [T, np.column_stack([T, T, T])], {"contact": [1, 1, 1], "contact_time": 1.1, "normal": [0, 0, 1]}),
    "fit reaches": (contact.LearnedModel.fit, [[contact.Reach(T, np.column_stack([T, T, k * T])) for k in range(9)]], {}),
    "touched": (contact.Predictor(SCENE).touched, [[0.6, 0, 1], 1.0], {}),
    "step": (SESSION.step, [0.0, START, START], {"torque": START, "t": 0.0}),
    "world": (lambda *a, **k: hwall.Session(ARM, SCENE, prepared=False).world(*a, **k), [0.0, np.eye(4)], {}),
    "set_clock_offset": (SESSION.set_clock_offset, [0.1], {}),
    "Session": (lambda **k: hwall.Session(ARM, SCENE, prepared=False, **k), [], {"board": [0.1, 0.1, 0.02], "arm_minus_tracker": 0.0}),
    "ServoArm": (sim.ServoArm, [ARM, START], {"seed": 1, "delay": 0.01, "torque_noise": 0.1}),
    "command": (sim.ServoArm(ARM, START).command, [("position", START)], {}),
    "advance": (lambda dt: sim.ServoArm(ARM, START).advance(min(dt, 10.0)), [0.001], {}),
    "push": (sim.ServoArm(ARM, START).push, [[0, 0, 1]], {"moment": [0, 0, 1]}),
    "Person": (sim.Person, [1], {"head": [1.4, 0, 1], "hand": [1.1, 0, 1]}),
    "plan": (sim.Person(1).plan, [[[0.6, 0, 1]], [1, 0, 0]], {}),
    "frame": (TOUCHES.frame, [0.5], {}),
    "tip": (TOUCHES.tip, [0.5], {}),
    "finger_force": (sim.finger_force, [POSE, [0, 0, 0], [0, 0, 0]], {"stiffness": 500.0, "damping": 1.0, "half_extent": 0.1}),
    "Texture": (texton.Texture, [[3.0, 1.0], 0.7, [7.0, 3.0]], {}),
    "Patch": (texton.Patch, [TEXTURE, [20, 20]], {"plate": 1.0}),
    "frequency": (TEXTURE.frequency, [45.0, 40.0], {}),
    "roughness": (TEXTURE.roughness, [45.0, 40.0], {}),
    "heights": (PATCH.heights, [0.5], {}),
    "mesh": (PATCH.mesh, [0.1], {}),
    "design": (texton.design, [[1.0, 2.0]], {}),
}


@pytest.mark.parametrize("name", CALLS)
def test_hostile_values_give_an_answer_or_an_error(name):
    call, arguments, named = CALLS[name]
    call(*arguments, **named)
    counts = [-1, 0, 10**6, 2**63, 2**64]
    for place, bad in itertools.product([*range(len(arguments)), *named], [*NUMBERS, *ARRAYS, *OBJECTS, *counts]):
        given, options = list(arguments), dict(named)
        (given if isinstance(place, int) else options)[place] = bad
        try:
            call(*given, **options)
        except (ValueError, TypeError, OverflowError):
            pass  # hwall.Error is a ValueError; the others come from numpy and from Python itself.


def each_array(name):
    """The arrays among a call's arguments, each with a function that calls with another one in its place."""
    call, arguments, named = CALLS[name]
    for place, value in [*enumerate(arguments), *named.items()]:
        values = np.asarray(value, dtype=object)
        if values.ndim and all(isinstance(v, float) for v in values.flat):

            def call_with(other, place=place):
                given, options = list(arguments), dict(named)
                (given if isinstance(place, int) else options)[place] = other
                return call(*given, **options)

            yield values.astype(float), call_with


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", CALLS)
def test_nothing_is_lost_in_conversion(name):
    """Masked values, imaginary parts, texts and times are refused wherever an array is asked for; of a single number numpy warns."""
    for values, call_with in each_array(name):
        for bad in (np.ma.masked_all_like(values), values + 1j, values.astype(str), values.astype("m8[s]")):
            with pytest.raises((hwall.Error, TypeError, Warning)):
                call_with(bad)


@pytest.mark.parametrize("name", CALLS)
def test_arrays_of_any_layout_are_read(name):
    for values, call_with in each_array(name):
        locked = values.copy()
        locked.setflags(write=False)
        for same in (locked, values.astype(">f8"), np.repeat(values, 2, axis=0)[::2], np.asfortranarray(values), values.tolist()):
            call_with(same)

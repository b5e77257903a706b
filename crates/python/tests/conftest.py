"""Reference data of the Rust tests, which are beside the package in the repository."""

import json
from pathlib import Path

import numpy as np
import pytest

import hwall

CRATES = Path(__file__).resolve().parents[2]
WALL = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n"
START = np.radians([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0])


def data(path):
    """A file of a crate's tests; the test is skipped outside the repository."""
    path = CRATES / path
    if not path.exists():
        pytest.skip(f"{path} is not there: no repository around the package")
    return path


def pose(entry):
    """The pose of an entry with R (9) and p (3)."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.reshape(entry["R"], (3, 3))
    matrix[:3, 3] = entry["p"]
    return matrix


def load(path):
    return json.loads(data(path).read_text())


@pytest.fixture(scope="session")
def arm():
    return hwall.Arm.iiwa7()


@pytest.fixture(scope="session")
def scene():
    return hwall.Scene.from_obj_str(WALL)


@pytest.fixture(scope="session")
def random_q(arm):
    """Configurations within the limits, seed 1, (2000, 7)."""
    low, high = arm.limits.T
    return np.random.default_rng(1).uniform(low, high, (2000, 7))

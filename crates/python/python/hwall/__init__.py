"""Encountered-type haptics for Python: proven reachability of robot arms, prediction of motions and touches, textures, sessions.

Arrays are numpy arrays, in and out. Metres, radians, seconds, newtons; right-handed frames, z up; poses are (4, 4) and named
``a_from_b``. Invalid input raises `hwall.Error`, a `ValueError`, with the message of the Rust library.
"""

from . import bip, contact, sim, texton
from ._hwall import (
    Arm,
    Error,
    Frame,
    Nearest,
    Nearests,
    Placements,
    ReachMap,
    Region,
    Room,
    Scene,
    Session,
    Verdict,
    Verdicts,
    WallMaps,
    __version__,
    base_placement,
    places_on_wall,
    reach_map,
    read_recordings,
    wall_maps,
    wall_region,
    write_recordings,
)

__all__ = [
    "Arm",
    "Error",
    "Frame",
    "Nearest",
    "Nearests",
    "Placements",
    "ReachMap",
    "Region",
    "Room",
    "Scene",
    "Session",
    "Verdict",
    "Verdicts",
    "WallMaps",
    "base_placement",
    "bip",
    "contact",
    "places_on_wall",
    "reach_map",
    "read_recordings",
    "sim",
    "texton",
    "wall_maps",
    "wall_region",
    "write_recordings",
]

"""Scenes, maps, polygons, placement of the base."""

import numpy as np
import pytest

import hwall


@pytest.fixture(scope="module")
def small(arm):
    return hwall.reach_map(arm, [0.0, 0.3], [0.3, 0.4, 0.5], np.arange(0.14, 1.2, 0.2))


def held(arm, orientation, plane, s, height):
    """The verdict on the pose that a map entry stands for, built with numpy only."""
    n = np.array([np.cos(orientation), np.sin(orientation), 0.0])
    t = np.array([-np.sin(orientation), np.cos(orientation), 0.0])
    at = np.eye(4)
    at[:3, :3] = np.column_stack([t, [0, 0, 1], n])
    at[:3, 3] = plane * n + s * t + [0, 0, height]
    return arm.is_reachable(at)


def test_a_map_says_what_verdicts_say(arm, small):
    s = np.linspace(-0.9, 0.9, 37)
    mask = small.mask(s)
    assert mask.shape == (2, 3, 6, 37)
    lines = small.lines.reshape(2, 3, 6, 3)
    rng = np.random.default_rng(3)
    for _ in range(300):
        i, j, k, m = (rng.integers(n) for n in mask.shape)
        orientation, plane, height = lines[i, j, k]
        assert mask[i, j, k, m] == held(arm, orientation, plane, s[m], height)
    assert small.unknown_length < 1e-6 * small.reachable_length


def test_the_hole_in_front_of_the_shoulder(arm):
    # crates/reachability/README.md: 0.3 m in front of the base, at the height of the shoulder.
    line = hwall.reach_map(arm, [0.0], [0.3], [0.34])
    numbers, ends = line.intervals()
    assert list(numbers) == [0, 0] and ends.shape == (2, 2)
    assert ends[0, 1] < 0.0 < ends[1, 0]
    assert np.allclose(ends[0], -ends[1, ::-1], atol=1e-6)
    bands, _ = line.unknown()
    assert len(bands) == 4 and line.unknown_length < 4e-6
    assert not line.is_reachable([0.3, 0.0, 0.34], [1, 0, 0])


def test_look_ups_and_files(small, tmp_path):
    points = [[0.4, 0.5, 0.34], [0.4, 0.0, 0.34], [5.0, 0.0, 0.34]]
    found = small.look_up(points, [1, 0, 0])
    assert found.dtype == np.int8 and found[2] == -1
    assert list(found[:2] == 1) == list(small.is_reachable(points[:2], [1, 0, 0]))
    small.save(tmp_path / "map")
    again = hwall.ReachMap.load(tmp_path / "map")
    assert np.array_equal(again.intervals()[1], small.intervals()[1])
    (tmp_path / "map").write_bytes((tmp_path / "map").read_bytes()[:-7])
    with pytest.raises(hwall.Error, match="bytes"):
        hwall.ReachMap.load(tmp_path / "map")
    (tmp_path / "text").write_text("no map at all, but long enough to be read as one")
    with pytest.raises(hwall.Error, match="reachability map: the file does not begin as one of its kind"):
        hwall.ReachMap.load(tmp_path / "text")


def test_polygons_have_the_area_of_their_triangles(arm):
    region = hwall.wall_region(arm, 0.0, 0.5, heights=[0.0, 1.2])
    corners = region.vertices[region.triangles]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    assert np.abs(0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])).sum() == pytest.approx(region.area, rel=1e-9)
    middles = corners.mean(axis=1)
    assert region.contains(middles).all()
    outside = [s for s in np.random.default_rng(4).uniform([-1, 0], [1, 1.2], (200, 2)) if not region.contains(s)]
    assert outside and not any(held(arm, 0.0, 0.5, *at) for at in outside)
    # Area of the rings by the shoelace formula, minus the holes.
    rings = [ring for polygon in region.polygons for ring in polygon]
    area = lambda r: 0.5 * np.abs(np.dot(r[:, 0], np.roll(r[:, 1], 1)) - np.dot(r[:, 1], np.roll(r[:, 0], 1)))
    sizes = sorted(map(area, rings), reverse=True)
    assert sizes[0] - sum(sizes[1:]) == pytest.approx(region.area, rel=1e-9)


def test_walls_of_a_scene(arm, scene):
    maps = hwall.wall_maps(scene, arm)
    # crates/reachability, `WallMaps`: a reachable point, and the nearest point of the same wall.
    places = maps.present([[0.6, 0.3, 0.5], [0.6, 1.9, 0.5], [3.0, 0.0, 0.5]], [1, 0, 0])
    assert np.array_equal(places[0], [0.6, 0.3, 0.5])
    assert places[1, 0] == 0.6 and places[1, 1] < 0.9
    assert np.isnan(places[2]).all()
    assert maps.stretches.shape[1:] == (2, 3) and len(maps.map) > 0


def test_a_base_that_stands_well_reaches_more(arm):
    targets = hwall.places_on_wall([0.8, 0, 0], [1, 0, 0], 0.6, [0.2, 0.8], 0.2)
    placed = hwall.base_placement(arm, targets, [1, 0, 0], np.linspace(-0.4, 0.4, 5), [-0.2, 0.0, 0.2], headings=[0.0])
    assert placed.shares.shape == (3, 5)
    best = placed.best[0]
    assert best["share"] == placed.shares.max() == 1.0 and best["worst_margin"] > 0.0
    base = best["room_from_base"]
    in_base = targets - base[:3, 3]
    assert all(held(arm, 0.0, x, y, z) for x, y, z in in_base)


def test_rays_and_nearest_points(scene):
    hits = scene.ray_cast([[2, 0, 1], [2, 0, 1]], [[-1, 0, 0], [1, 0, 0]])
    assert list(hits["surface"]) == [0, -1] and hits["distance"][0] == pytest.approx(1.4)
    assert np.isnan(hits["point"][1]).all()
    nearest = scene.closest_point([1.0, 0.2, 0.7])
    assert np.allclose(nearest["point"], [0.6, 0.2, 0.7]) and np.allclose(nearest["normal"], [1, 0, 0])
    assert scene.surfaces[0]["name"] == "wall" and scene.triangles("wall").shape == (2, 3, 3)
    facet = scene.vertical_facets()[0]
    assert facet["area"] == pytest.approx(3.0) and facet["highest"] == 1.5


def test_a_door_opens():
    obj = "o door\nv 1 0 0\nv 1 -1 0\nv 1 -1 2\nv 1 0 2\nf 1 4 3 2\n"
    sidecar = '[surface.door]\nkind = "revolving_door"\nhinge_point_m = [1, 0, 0]\nhinge_axis = [0, 0, 1]\nrange_deg = [0, 90]\n'
    room = hwall.Scene.from_obj_str(obj, sidecar)
    ray = ([0, -0.5, 1.6], [1, 0, 0])
    assert room.ray_cast(*ray)["surface"] == 0
    assert room.opened("door", np.pi / 2).ray_cast(*ray)["surface"] == -1
    with pytest.raises(hwall.Error):
        room.opened("door", 3.0)
    with pytest.raises(hwall.Error, match='there is no surface "window"'):
        room.opened("window", 0.0)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda a: hwall.reach_map(a, [0.0], [0.3, 0.4, 0.6], [0.3]), "planes must be evenly spaced"),
        (lambda a: hwall.reach_map(a, [np.nan], [0.3], [0.3]), "orientations[0] is NaN, not a finite number"),
        (lambda a: hwall.reach_map(a, [0.0], [0.3], []), "no values"),
        (lambda a: hwall.reach_map(a, [0.0], [0.3], [0.3], accuracy=-1.0), "accuracy"),
        (lambda a: hwall.reach_map(a, [0.0], [0.3], [0.3], roll="any"), 'roll "any" is not one of free'),
        (lambda a: hwall.wall_region(a, np.inf, 0.3), "heading_rad is inf, not a finite number"),
        (lambda a: hwall.Scene.from_obj_str("f 1 2 3"), "OBJ line 1: face index 1, but 0 vertices are defined so far"),
        (lambda a: hwall.Scene.from_obj("none.obj"), "none.obj: No such file"),
    ],
)
def test_what_makes_no_sense_is_refused(arm, ask, words):
    with pytest.raises(hwall.Error) as refused:
        ask(arm)
    assert words in str(refused.value)

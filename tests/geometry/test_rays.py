"""Distances along rays that can be worked out by hand, and what sensors report of them."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake import geometry as rays

EXACT = 1e-12
"""Metres; a few roundings of numbers of the size of metres."""

X = np.array([1.0, 0.0, 0.0])
CUBE = """v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 1 2 3 4\nf 5/1 6/2 7/3 8/4\nf -8 -7 -3 -4\nf 3//1 4//1 8//1 7//1\nf 1 4 8 5\nf 2 3 7 6\n"""


def cast(shape, origin, directions, X_WG=None):
    scene = rays.RayScene([shape])
    scene.place(0, X_WG or RigidTransform())
    directions = np.atleast_2d(directions)
    return scene.cast(np.array(origin, float), directions)[0]


def test_a_wall_and_a_fan():
    """The distance to a plane grows as 1 / cos of the angle."""
    angles = rays.fan_angles(-1.2, 1.2, 241)
    wall = RigidTransform([2.5, 0.0, 0.0])
    found = cast(
        rays.box(np.array([1.0, 40.0, 3.0])), [0, 0, 0.7], rays.fan_directions(angles), wall
    )
    np.testing.assert_allclose(found, 2.0 / np.cos(angles), atol=EXACT)


@pytest.mark.parametrize(
    ("shape", "origin", "expected"),
    [
        (rays.box(np.array([2.0, 4.0, 6.0])), (-5, 0.3, 0.4), 4.0),
        (rays.box(np.array([2.0, 4.0, 6.0])), (0.25, 0, 0), 0.75),  # from inside
        (rays.box(np.array([2.0, 4.0, 6.0])), (5, 0, 0), np.inf),  # behind
        (rays.sphere(2.0), (-5, 1.2, 0), 5 - 1.6),
        (rays.sphere(2.0), (-5, 2.1, 0), np.inf),
        (rays.sphere(2.0), (1, 0, 0), 1.0),
        (rays.cylinder(0.5, 2.0), (-3, 0.3, 0.9), 3 - 0.4),
        (rays.cylinder(0.5, 2.0), (-3, 0.0, 1.1), np.inf),
        (rays.capsule(0.5, 2.0), (-3, 0.0, 1.3), 3 - 0.4),
        (rays.capsule(0.5, 2.0), (0, 0.3, -0.4), 0.4),
        (rays.ellipsoid(np.array([3.0, 2.0, 1.0])), (-9, 0, 0.6), 9 - 2.4),
        (rays.half_space(), (-5, 0, 1), np.inf),
        (rays.mesh(rays.obj_triangles(CUBE, "cube")), (-5, 0.3, 0.3), 4.0),
        (rays.mesh(rays.obj_triangles(CUBE, "cube")), (0.25, 0.0, 0.0), 0.75),
        (rays.mesh(rays.obj_triangles(CUBE, "cube")), (-5, 0.0, 1.1), np.inf),
    ],
)
def test_along_x(shape, origin, expected):
    np.testing.assert_allclose(cast(shape, origin, X), [expected], atol=EXACT)


def test_a_half_space_from_above_and_from_below():
    down = np.array([[0.6, 0.0, -0.8]])
    assert cast(rays.half_space(), (0, 0, 2), down)[0] == pytest.approx(2.5, abs=EXACT)
    assert cast(rays.half_space(), (0, 0, -2), -down)[0] == pytest.approx(2.5, abs=EXACT)
    assert cast(rays.half_space(), (0, 0, -2), down)[0] == np.inf


def test_a_capsule_is_met_at_its_cap_from_above():
    """And nowhere on the discs between its parts."""
    down = np.array([[0.0, 0.0, -1.0]])
    assert cast(rays.capsule(0.5, 2.0), (0.3, 0, 5), down)[0] == pytest.approx(3.6, abs=EXACT)


def test_far_away_no_digit_is_lost():
    found = cast(rays.sphere(1.0), (-1e6, 0.6, 0.0), X)[0]
    assert found == pytest.approx(1e6 - 0.8, abs=1e-9)


def test_the_first_of_many_is_met():
    scene = rays.RayScene([rays.sphere(1.0), rays.box(np.ones(3)), rays.half_space()])
    scene.place(0, RigidTransform([4.0, 0.0, 0.0]))
    scene.place(1, RigidTransform(RollPitchYaw(0.0, 0.0, np.pi / 4), [3.0, 5.0, 0.0]))
    scene.place(2, RigidTransform([0.0, 0.0, -1.0]))
    directions = np.array([X, [0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    origins = np.array([[0, 0, 0], [3, 0.5, 0], [0, 0, 0], [0, 0, 0]], float)
    ranges, hits = scene.cast(origins, directions)
    np.testing.assert_allclose(ranges, [3.0, 4.5 - np.sqrt(0.5), 1.0, np.inf], atol=EXACT)
    assert hits.tolist() == [0, 1, 2, -1]


def test_no_ray_slips_between_triangles():
    """Rays from inside through edges and corners of a cube."""
    corners = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.5], [0.2, 0.2, -1.0]])
    directions = corners / np.linalg.norm(corners, axis=1)[:, None]
    found = cast(rays.mesh(rays.obj_triangles(CUBE, "cube")), (0, 0, 0), directions)
    np.testing.assert_allclose(found, np.linalg.norm(corners, axis=1), atol=EXACT)


def test_many_triangles_are_those_of_the_shape():
    """A ball of 2 * 48 * 24 triangles lies inside the sphere, by a known sagitta at most."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 49), np.linspace(0, np.pi, 25), indexing="ij")
    p = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1)
    one = np.stack([p[:-1, :-1], p[1:, :-1], p[1:, 1:]], axis=2).reshape(-1, 3, 3)
    two = np.stack([p[:-1, :-1], p[1:, 1:], p[:-1, 1:]], axis=2).reshape(-1, 3, 3)
    ball = rays.mesh(np.concatenate([one, two]))
    directions = rays.fan_directions(rays.fan_angles(-0.3, 0.3, 61))
    fine = cast(ball, (-3.0, 0.01, 0.02), directions)
    exact = cast(rays.sphere(1.0), (-3.0, 0.01, 0.02), directions)
    assert np.all(np.isfinite(fine) == np.isfinite(exact))
    both = np.isfinite(exact) & (exact < 2.6)  # else the ray only grazes it
    assert np.all(fine[both] >= exact[both] - EXACT)
    assert np.max(fine[both] - exact[both]) < 0.03


def test_reports_are_those_of_rep_117():
    found = rays.reported_ranges(
        np.array([0.05, 1.0, 3.99, 4.01, np.inf]), np.zeros(5), (0.1, 4.0), 0.0
    )
    np.testing.assert_array_equal(found, [-np.inf, 1.0, 3.99, np.inf, np.inf])
    assert rays.reported_ranges(np.array([1.23]), np.array([0.03]), (0.1, 4.0), 0.1)[0] == (
        pytest.approx(1.2 + 0.1)
    )


def test_one_beam_looks_ahead():
    assert rays.fan_angles(-0.5, 0.5, 1).tolist() == [0.0]
    np.testing.assert_array_equal(rays.fan_directions(rays.fan_angles(0.0, 0.0, 1)), [X])

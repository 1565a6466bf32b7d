"""Distances from a line in closed form."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.geometry.pose_accuracy import distances_from_line

TOLERANCE = 1e-11  # of products of numbers up to ten, the smaller distances by cancellation

coordinate = st.floats(-3.0, 3.0)
vector = st.tuples(coordinate, coordinate, coordinate).map(np.array)
unit = vector.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))


def test_distance_from_an_axis():
    points = np.array([[5.0, 3.0, 4.0], [-7.0, 0.0, 0.0], [0.0, 0.0, 2.0]])
    found = distances_from_line(points, np.zeros(3), np.array([2.0, 0.0, 0.0]))
    np.testing.assert_allclose(found, [5.0, 0.0, 2.0], atol=TOLERANCE)


def test_distance_in_the_image_plane():
    found = distances_from_line(np.array([[0.0, 1.0]]), np.zeros(2), np.ones(2))
    np.testing.assert_allclose(found, [np.sqrt(0.5)], atol=TOLERANCE)


def test_a_line_without_length_is_its_point():
    here = np.array([1.0, 2.0, 3.0])
    points = np.array([[1.0, 2.0, 3.0], [1.0, 5.0, 7.0]])
    np.testing.assert_allclose(distances_from_line(points, here, here), [0.0, 5.0], atol=TOLERANCE)


@given(vector, unit, st.floats(0.1, 5.0), vector)
def test_three_dimensions_agree_with_the_cross_product(start, u, length, point):
    found = distances_from_line(point[np.newaxis], start, start + length * u)
    expected = np.linalg.norm(np.cross(point - start, u))
    np.testing.assert_allclose(found, [expected], atol=TOLERANCE)


@given(vector, unit, st.floats(0.1, 5.0), st.floats(-5.0, 5.0))
def test_points_on_the_line_beyond_its_ends_too_have_no_distance(start, u, length, along):
    found = distances_from_line((start + along * u)[np.newaxis], start, start + length * u)
    np.testing.assert_allclose(found, [0.0], atol=TOLERANCE)


@given(vector, unit, st.floats(0.1, 5.0), vector)
def test_the_direction_of_the_line_does_not_matter(start, u, length, point):
    end = start + length * u
    there = distances_from_line(point[np.newaxis], start, end)
    back = distances_from_line(point[np.newaxis], end, start)
    np.testing.assert_allclose(there, back, atol=TOLERANCE)

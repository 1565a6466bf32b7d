"""Poses beside a pose, and how wrongly a model has the points of its cables."""

import numpy as np
import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from cdpr_drake.analyses.studies import case_1, fusion
from cdpr_drake.analyses.studies.experiments import (
    POINT_ERROR,
    as_transform,
    between,
    pose_item,
    turned,
    wrong_points,
)
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.systems.diagrams.load import load_scenario

ROUNDING = 1e-9
"""Items carry nine digits; poses here are of the order of 1 m and 1 rad."""

angle = st.floats(-80.0, 80.0)
place = st.floats(-3.0, 3.0)
poses = st.tuples(st.tuples(place, place, place), st.tuples(angle, angle, angle))


@given(poses, st.floats(0.01, 2.0), st.floats(1.0, 60.0))
def test_a_turned_pose_is_as_far_away_as_asked(pose, distance, degrees):
    X = as_transform(pose)
    shift, axis = np.array([0.6, 0.0, 0.8]), np.array([1.0, 2.0, -2.0])
    found_distance, found_angle = pose_error(X, turned(X, distance * shift, degrees, axis))
    np.testing.assert_allclose(found_distance, distance, atol=ROUNDING)
    np.testing.assert_allclose(np.degrees(found_angle), degrees, atol=1e-6)


@given(poses, st.floats(0.01, 2.0), st.floats(1.0, 60.0))
def test_between_undoes_turned(pose, distance, degrees):
    X = as_transform(pose)
    shift, axis = np.array([0.6, 0.0, 0.8]), np.array([1.0, 2.0, -2.0]) / 3.0
    direction, turn = between(X, turned(X, distance * shift, degrees, axis))
    np.testing.assert_allclose(direction, shift, atol=1e-7)
    np.testing.assert_allclose(turn, axis, atol=1e-7)


@given(poses)
@example(((1e-5, 0.0, 2e-7), (1e-5, 0.0, 0.0)))  # YAML takes 1e-05 for a word, 1.0e-05 for a number
def test_an_item_means_the_pose(pose):
    X = as_transform(pose)
    key, _, words = pose_item("initial_pose", X).partition("=")
    value = yaml.safe_load(words)
    assert key == "initial_pose"
    again = as_transform((tuple(value["position"]), tuple(value["angles_deg"])))
    assert again.IsNearlyEqualTo(X, 10.0 * ROUNDING)


@pytest.mark.parametrize("scenario", ["acrobot_open_loop", "acrobot_mobile_robot"])
def test_scenarios_with_manufacturing_errors_have_the_same(scenario):
    wrong = load_scenario(scenario).perturbations
    assert (wrong.exit_points, wrong.anchor_points) == (POINT_ERROR, POINT_ERROR)


def test_case_1_and_fusion_have_the_same():
    assert set(case_1.POINTS) == set(wrong_points())
    assert set(wrong_points()) <= set(fusion.SLACK_CHANGES)

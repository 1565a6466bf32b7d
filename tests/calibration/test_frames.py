"""Frames that move as a whole, along the arcs of their turns."""

import numpy as np
import pytest

from cdpr_drake.calibration.identifiability import frame_motions
from cdpr_drake.calibration.parameters import (
    model_difference,
    moved_frames,
    moved_model,
    parameter_layout,
)
from cdpr_drake.calibration.stations import Point, Stations
from tests.calibration.bench import camera_program, poses, true_model

ROUNDING = 1e-10
"""Metres and radians of points a metre away."""


def measured(model):
    """Whatever no frame changes: distances between exit points, and between anchor points."""
    return [
        np.linalg.norm(p[:, :, None] - p[:, None], axis=0)
        for p in (model.cables.p_WA, model.cables.p_PB)
    ]


def test_moved_frames_move_their_points_as_bodies():
    true = true_model()
    moved = moved_frames(true, np.random.default_rng(0).uniform(-0.3, 0.3, 12))
    for before, after in zip(measured(true), measured(moved), strict=True):
        np.testing.assert_allclose(after, before, atol=ROUNDING)
    X, Y = (m.tags[0].inverse() @ m.tags[3] for m in (true, moved))
    np.testing.assert_allclose(X.GetAsMatrix4(), Y.GetAsMatrix4(), atol=ROUNDING)


def test_small_motions_of_frames_are_those_of_the_gauge():
    true, twist = true_model(), 1e-6 * np.random.default_rng(1).standard_normal(12)
    at = Point(true, Stations.at(poses(1, np.random.default_rng(0))))
    step = model_difference(moved_frames(true, twist), true)
    np.testing.assert_allclose(step, frame_motions(at) @ twist * at.layout.typical, atol=1e-11)


@pytest.fixture(scope="module")
def found():
    random, true = np.random.default_rng(2), true_model()
    program = camera_program(
        true, true, ["exit_points", "anchor_points", "camera", "tags"], count=12, random=random
    )
    program.AddPrior(["exit_points", "anchor_points"], 0.005)
    return program.Solve(outliers=False)


def test_a_turned_frame_alone_leaves_nothing_beyond_frames(found):
    twist = found.twists @ np.random.default_rng(3).standard_normal(found.twists.shape[1])
    true = moved_frames(found.model, twist)
    np.testing.assert_allclose(found.without_frames(found.errors_from(true)), 0.0, atol=ROUNDING)
    free = [name in found.names for name in parameter_layout(true).names]
    straight = found.without_frames(model_difference(found.model, true)[free])
    assert np.max(np.abs(straight)) > 1e-5  # more than the deviation of a tag's place among tags


def test_along_frames_that_hardly_move_errors_are_plain_differences(found):
    layout = parameter_layout(found.model)
    free = np.array([name in found.names for name in layout.names])
    step = np.where(free, 1e-7 * np.random.default_rng(3).standard_normal(layout.size), 0.0)
    true = moved_model(found.model, -step)
    np.testing.assert_allclose(found.errors_from(true), step[free], atol=1e-11)

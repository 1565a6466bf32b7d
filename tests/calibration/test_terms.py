from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.calibration import (
    CalibrationProgram,
    simulated_corners,
    simulated_poses,
    simulated_swivels,
)
from cdpr_drake.geometry import cable_paths
from tests.calibration.bench import (
    PINHOLE,
    TARGETS,
    nearby,
    poses,
    start_readings,
    true_model,
)

STEP = 1e-6
SLOPE_TOLERANCE = 1e-8
"""Central differences of step h are off by h^2 and by rounding over h; relative to the largest."""

TERMS = ("lengths", "swivel angles", "tracked poses", "tag corners", "equilibrium", "tensions")


@pytest.fixture(scope="module")
def everything():
    """A program with every kind of measurement, none of which fits."""
    random, true = np.random.default_rng(0), true_model()
    at = poses(3, random)
    X_WK, X_PM = (nearby(RigidTransform(), 0.5, 0.3, np.random.default_rng(k)) for k in (1, 2))
    true = replace(true, X_WK=X_WK, X_PM=X_PM)
    program = CalibrationProgram(true, at, ["*"])
    start = start_readings(true, at[0])
    program.AddLengths(
        start + random.uniform(-0.1, 0.1, (3, 8)), 1e-3, start, random.uniform(0.0, 0.01, (3, 8))
    )
    program.AddSwivels(random.uniform(-0.2, 0.2, (3, 8)), 1e-2)
    seen = simulated_poses(at, 0.3, 0.01, random, true)
    program.AddTrackedPoses(seen, 1e-3, 1e-3)
    uv = random.uniform(0.0, 400.0, (3, len(TARGETS), 4, 2))
    uv[1, 2] = np.nan
    program.AddTagCorners({k: t.points for k, t in TARGETS.items()}, uv, 0.2, PINHOLE)
    weight = np.array([1.0, 2.0, -15.0])
    program.AddRest(weight, np.array([0.01, 0.02, 0.03]), 0.01, 0.1, random.uniform(5, 20, (3, 8)))
    program.AddTensions(random.uniform(5, 20, (3, 8)), 0.1)
    return program


@pytest.mark.parametrize("number", range(len(TERMS)), ids=TERMS)
def test_derivatives_are_those_of_finite_differences(everything, number):
    term, at = everything.terms[number], everything.at()
    assert term.kind == TERMS[number]
    _, A, B = term.evaluate(at)
    n, width = at.layout.size, at.stations.width
    for j in range(n + width):
        theta, steps = np.zeros(n), np.zeros((3, width))
        slopes = []
        for sign in (STEP, -STEP):
            if j < n:
                theta[j] = sign
            else:
                steps[:, j - n] = sign
            slopes.append(term.evaluate(at.moved(theta, steps))[0])
        numeric = (slopes[0] - slopes[1]) / (2.0 * STEP)
        exact = A[:, :, j] if j < n else B[:, :, j - n]
        scale = max(1.0, np.max(np.abs(A)), np.max(np.abs(B)))
        np.testing.assert_allclose(exact, numeric, atol=SLOPE_TOLERANCE * scale)


def test_lengths_are_those_of_the_room_of_geometry():
    true, (X_WP,) = true_model(), poses(1, np.random.default_rng(1))
    np.testing.assert_allclose(
        start_readings(true, X_WP), cable_paths(X_WP, true.cables).lengths, rtol=1e-12
    )


def test_a_swivel_angle_is_that_of_the_anchor_point_about_the_axis():
    true, (X_WP,) = true_model(), poses(1, np.random.default_rng(2))
    angle = simulated_swivels(true, [X_WP], 0.0, np.random.default_rng(0))[0]
    d = X_WP @ true.cables.p_PB - true.cables.p_WA
    np.testing.assert_allclose(angle, np.arctan2(d[1], d[0]), atol=1e-12)


def test_corners_that_are_seen_fit():
    random, true = np.random.default_rng(3), true_model()
    at = poses(4, random)
    uv = simulated_corners(true, at, TARGETS, PINHOLE, 0.0, random)
    program = CalibrationProgram(true, at, ["tags"])
    term = program.AddTagCorners({k: t.points for k, t in TARGETS.items()}, uv, 0.2, PINHOLE)
    assert term.measured().any()
    np.testing.assert_allclose(term.evaluate(program.at())[0], 0.0, atol=1e-8)

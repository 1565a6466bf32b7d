"""Cables counted from zero by lengths or motors, positions of a tracker with a clock, tilts."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CalibrationError
from cdpr_drake.winches.drum import Drum
from tests.calibration.bench import nearby, poses, true_model

STEP = 1e-6
SLOPE_TOLERANCE = 2e-7
"""Central differences of step h are off by h^2 and by rounding over h; relative to the largest."""

SAME = 1e-9
COUNT = 6
SPIRAL = Drum(np.linspace(0.03, 0.05, 8), 5.0, 1.0, 0.002, np.linspace(3.0, 4.0, 8))


@pytest.fixture(scope="module")
def everything():
    """A program of terms that do not fit, of a model with everything off."""
    random, true = np.random.default_rng(0), true_model()
    at = poses(COUNT, random)
    true = replace(
        true, X_WK=nearby(RigidTransform(), 0.5, 0.3, random),
        X_PM=nearby(RigidTransform(), 0.5, 0.3, random),
        length_scale=random.uniform(0.8, 1.2, 8), length_offset=random.uniform(-0.1, 0.1, 8),
        drum_radius=random.uniform(-1e-3, 1e-3, 8), common_drum_radius=5e-4,
        tilt_zero=random.uniform(-0.3, 0.3, 3), clock=0.02,
    )  # fmt: skip
    program = CalibrationProgram(true, at, ["*"])
    strain = random.uniform(0.0, 0.01, (COUNT, 8))
    home = nearby(at[0], 0.1, 0.1, random)
    program.AddZeroedCables(random.uniform(-20, 20, (COUNT, 8)), 1e-3, home, SPIRAL, strain=strain)
    program.AddZeroedCables(
        random.uniform(-20, 20, (COUNT, 8)), 1e-3, None, SPIRAL, advantage=np.full(8, 2.0)
    )
    program.AddZeroedCables(random.uniform(-0.2, 0.2, (COUNT, 8)), 1e-3, home)
    points, times = random.uniform(-1, 1, (COUNT, 3)), np.cumsum(random.uniform(0.1, 0.2, COUNT))
    program.AddTrackedPoints(
        points, 1e-3, normal=np.array([0.6, 0.0, 0.8]), sigma_along=5e-3, times=times
    )
    points[2] = np.nan
    program.AddTrackedPoints(points, 1e-3)
    program.AddTilts(random.uniform(-0.5, 0.5, (COUNT, 3)), 1e-2, 2e-2)
    return program


@pytest.mark.parametrize("number", range(6))
def test_derivatives_are_those_of_finite_differences(everything, number):
    term, at = everything.terms[number], everything.at()
    _, A, B = term.evaluate(at)
    n, width = at.layout.size, at.stations.width
    scale = max(1.0, np.max(np.abs(A)), np.max(np.abs(B)))
    for j in range(n + width):
        theta, steps = np.zeros(n), np.zeros((COUNT, width))
        slopes = []
        for sign in (STEP, -STEP):
            if j < n:
                theta[j] = sign
            else:
                steps[:, j - n] = sign
            slopes.append(term.evaluate(at.moved(theta, steps))[0])
        numeric = (slopes[0] - slopes[1]) / (2.0 * STEP)
        exact = A[:, :, j] if j < n else B[:, :, j - n]
        np.testing.assert_allclose(exact, numeric, atol=SLOPE_TOLERANCE * scale)


@pytest.mark.parametrize("number", range(6))
def test_some_poses_of_a_term_are_the_same_there(everything, number):
    term, at, which = everything.terms[number], everything.at(), np.array([4, 0])
    there = everything.at(at.stations.only(which))
    for mine, whole in zip(term.only(which).evaluate(there), term.evaluate(at), strict=True):
        np.testing.assert_allclose(mine, whole[which], rtol=1e-12, atol=1e-9)


def test_motor_angles_are_those_of_the_drum_from_where_it_stood_at_zero(everything):
    at, term = everything.at(), everything.terms[0]
    model = at.model
    home = Point(model, Stations.at([term.zero])).numbers[0, :, 0]
    radius = SPIRAL.radius + model.drum_radius + model.common_drum_radius
    drum = replace(SPIRAL, radius=radius)
    lengths = at.numbers[:, :, 0] / (1.0 + term.strain)
    angles = drum.motor_angles((lengths - home - model.length_offset) / model.length_scale)
    fits = replace(term, readings=angles)
    np.testing.assert_allclose(fits.evaluate(at)[0] * fits.sigmas(), 0.0, atol=SAME)


def test_a_spiral_is_the_law_of_the_hangprinters_firmware():
    radius, buildup, advantage, gear = 0.075, 6.875e-5, 4.0, 12.75
    wound = 9.0
    first = np.sqrt(radius**2 - buildup * wound)
    drum = Drum(first / advantage, gear, 1.0, np.pi * buildup / advantage, wound / advantage)
    angles = np.linspace(-1500.0, 300.0, 7)
    c1 = -advantage * buildup
    k0 = 2.0 * gear * advantage / c1
    expected = ((angles / k0 + radius) ** 2 - radius**2) / c1
    np.testing.assert_allclose(drum.paid_out(angles), expected, rtol=1e-9, atol=1e-12)


def test_positions_across_a_plane_count_by_their_own_deviation(everything):
    at, term = everything.at(), everything.terms[3]
    n = term.normal
    plain = replace(term, normal=np.zeros(3))
    r, s = term.evaluate(at)[0] @ n, plain.evaluate(at)[0] @ n
    np.testing.assert_allclose(r, s * term.sigma / term.sigma_along, rtol=1e-9)


def test_a_tracker_that_is_late_tells_where_the_marker_was():
    random, true = np.random.default_rng(5), true_model()
    times = np.linspace(0.0, 4.0, 81)
    place = np.column_stack(
        [0.2 * np.sin(2 * times), 0.2 * np.cos(times), 0.3 + 0.1 * np.sin(times)]
    )
    at = [RigidTransform(p) for p in place]
    late = 0.013
    seen = np.column_stack(
        [
            0.2 * np.sin(2 * (times - late)),
            0.2 * np.cos(times - late),
            0.3 + 0.1 * np.sin(times - late),
        ]
    )
    program = CalibrationProgram(true, at, ["clock"])
    lengths = Point(true, Stations.at(at)).numbers[:, :, 0]
    program.AddLengths(lengths + 1e-4 * random.standard_normal(lengths.shape), 1e-4, np.zeros(8))
    program.AddTrackedPoints(seen, 1e-4, times=times)
    found = program.Solve(outliers=False)
    assert found.model.clock == pytest.approx(late, abs=5.0 * found.std[0])
    assert found.std[0] < 1e-3


def test_wrong_shapes_and_sigmas_are_refused():
    program = CalibrationProgram(true_model(), poses(2, np.random.default_rng(0)), ["clock"])
    with pytest.raises(CalibrationError, match=r"tracked positions: found shape \(3, 3\)"):
        program.AddTrackedPoints(np.zeros((3, 3)), 1e-3)
    with pytest.raises(CalibrationError, match="tracked positions: sigma: found 0"):
        program.AddTrackedPoints(np.zeros((2, 3)), 0.0)
    with pytest.raises(CalibrationError, match="lengths: found shape"):
        program.AddZeroedCables(np.zeros((2, 3)), 1e-3, None)

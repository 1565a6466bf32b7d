"""Terms of a calibration: their residuals by other rooms, their derivatives by differences."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.calibration import elimination
from cdpr_drake.calibration.measurements import (
    simulated_corners,
    simulated_poses,
    simulated_swivels,
)
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.winches.drum import Drum
from tests.calibration.bench import PINHOLE, TARGETS, nearby, poses, start_readings, true_model

STEP = 1e-6
SLOPES = 2e-7
"""Central differences of step h are off by h^2 and by rounding over h; relative to the largest."""

KINDS = ["lengths", "swivel angles", "tracked poses", "tag corners", "equilibrium", "tensions",
         "inclination"]  # fmt: skip
SAME = 1e-9
"""Numbers that are computed in two ways, over their sigmas."""

COUNT = 6
SPIRAL = Drum(np.linspace(0.03, 0.05, 8), 5.0, 1.0, 0.002, np.linspace(3.0, 4.0, 8))


@cache
def everything():
    """A program with every kind of measurement, none of which fits."""
    random, true = np.random.default_rng(0), true_model()
    at = poses(3, random)
    X_WK, X_PM = (nearby(RigidTransform(), 0.5, 0.3, np.random.default_rng(k)) for k in (1, 2))
    true = replace(
        true, X_WK=X_WK, X_PM=X_PM, length_scale=random.uniform(0.6, 1.5, 8),
        length_offset=random.uniform(-0.1, 0.1, 8), swivel_offset=random.uniform(-0.2, 0.2, 8),
        common_length_offset=0.03, common_length_scale=0.9,
    )  # fmt: skip
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
    angles = random.uniform(-0.5, 0.5, (3, 3))
    angles[1, 2] = np.nan
    program.AddTilts(angles, 1e-2, 2e-2)
    return program


@cache
def zeroed():
    """Cables counted from zero, positions of a tracker with a clock, tilts; a model all off."""
    random, true = np.random.default_rng(0), true_model()
    at = poses(COUNT, random)
    true = replace(
        true, X_WK=nearby(RigidTransform(), 0.5, 0.3, random),
        X_PM=nearby(RigidTransform(), 0.5, 0.3, random),
        length_scale=random.uniform(0.8, 1.2, 8), length_offset=random.uniform(-0.1, 0.1, 8),
        drum_radius=random.uniform(-1e-3, 1e-3, 8), common_drum_radius=5e-4,
        tilt_zero=random.uniform(-0.3, 0.3, 3), clock=0.02, common_length_offset=0.03,
        common_length_scale=1.1,
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


TERMS = [
    *(pytest.param(everything, k, 0.05 * SLOPES, id=kind) for k, kind in enumerate(KINDS)),
    *(pytest.param(zeroed, k, SLOPES, id=f"zeroed {k}") for k in range(6)),
]


@pytest.mark.parametrize(("program", "number", "tolerance"), TERMS)
def test_derivatives_are_those_of_finite_differences(program, number, tolerance):
    term, at = program().terms[number], program().at()
    _, A, B = term.evaluate(at)
    n, (count, width) = at.layout.size, (at.stations.count, at.stations.width)
    scale = max(1.0, np.max(np.abs(A)), np.max(np.abs(B)))
    for j in range(n + width):
        theta, steps = np.zeros(n), np.zeros((count, width))
        slopes = []
        for sign in (STEP, -STEP):
            if j < n:
                theta[j] = sign
            else:
                steps[:, j - n] = sign
            slopes.append(term.evaluate(at.moved(theta, steps))[0])
        numeric = (slopes[0] - slopes[1]) / (2.0 * STEP)
        exact = A[:, :, j] if j < n else B[:, :, j - n]
        np.testing.assert_allclose(exact, numeric, atol=tolerance * scale)


@pytest.mark.parametrize(("program", "number", "_tolerance"), TERMS)
def test_some_poses_of_a_term_are_the_same_there(program, number, _tolerance):
    term, at, which = program().terms[number], program().at(), np.array([2, 0])
    there = program().at(at.stations.only(which))
    for mine, whole in zip(term.only(which).evaluate(there), term.evaluate(at), strict=True):
        np.testing.assert_allclose(mine, whole[which], rtol=1e-12, atol=1e-9)


def test_kinds_of_terms_have_these_names():
    assert [term.kind for term in everything().terms] == KINDS


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


def told(term, at):
    """Residuals in units, shape (k, rows)."""
    return term.evaluate(at)[0] * term.sigmas()


def test_lengths_are_counted_from_the_start_by_drums_and_strain():
    at, term = everything().at(), everything().terms[0]
    model = at.model
    length = np.array([cable_paths(X, model.cables).lengths for X in at.stations.poses()])
    paid = length / (1.0 + term.strain) - term.start - model.length_offset - 0.03
    expected = (term.start + paid / model.length_scale) / 0.9 - term.readings
    np.testing.assert_allclose(told(term, at), expected, atol=SAME)
    np.testing.assert_array_equal(term.sigmas(), np.full((3, 8), 1e-3))


def test_swivels_count_from_their_zeros_and_round_the_circle():
    at, term = everything().at(), everything().terms[1]
    angle = simulated_swivels(at.model, at.stations.poses(), 0.0, np.random.default_rng(0))
    expected = angle - term.readings
    assert np.max(np.abs(expected)) < np.pi
    np.testing.assert_allclose(told(term, at), expected, atol=SAME)
    turned = replace(term, readings=term.readings + 2.0 * np.pi)
    np.testing.assert_allclose(told(turned, at), expected, atol=SAME)
    np.testing.assert_array_equal(term.sigmas(), np.full((3, 8), 1e-2))


def test_a_tracker_tells_the_marker_in_its_frame():
    at, term = everything().at(), everything().terms[2]
    model, seen = at.model, term.only(slice(0, 3))
    X_KM = [model.X_WK.inverse() @ X @ model.X_PM for X in at.stations.poses()]
    exact = replace(
        seen, R=np.array([X.rotation().matrix() for X in X_KM]),
        p=np.array([X.translation() for X in X_KM]),
    )  # fmt: skip
    np.testing.assert_allclose(told(exact, at), 0.0, atol=SAME)
    off = replace(exact, p=exact.p - [0.1, 0.2, 0.3])
    shift = model.X_WK.rotation() @ np.array([0.1, 0.2, 0.3])
    np.testing.assert_allclose(told(off, at)[:, 3:], np.tile(shift, (3, 1)), atol=SAME)
    np.testing.assert_array_equal(
        replace(term, sigma_turn=2e-3).sigmas()[0], [2e-3] * 3 + [1e-3] * 3
    )


def test_at_rest_tensions_and_weight_balance():
    at, term = everything().at(), everything().terms[4]
    for k, X_WP in enumerate(at.stations.poses()):
        J = cable_jacobian(X_WP, at.model.cables)
        lever = X_WP.rotation() @ term.p_PPcm
        weight = np.concatenate([np.cross(lever, term.weight), term.weight])
        expected = weight - J.T @ at.stations.tensions[k]
        np.testing.assert_allclose(told(term, at)[k], expected, atol=1e-9)
    np.testing.assert_array_equal(term.sigmas()[0], [0.01] * 3 + [0.1] * 3)
    np.testing.assert_array_equal(term.measured(), np.ones((3, 6), dtype=bool))


def test_tensions_are_those_of_the_stations():
    at, term = everything().at(), everything().terms[5]
    np.testing.assert_allclose(told(term, at), at.stations.tensions - term.readings, atol=SAME)
    np.testing.assert_array_equal(term.sigmas(), np.full((3, 8), 0.1))


def test_tilts_are_roll_pitch_and_yaw():
    at, term = everything().at(), everything().terms[6]
    angles = np.array([RollPitchYaw(X.rotation()).vector() for X in at.stations.poses()])
    expected = np.where(np.isfinite(term.readings), angles - term.readings, 0.0)
    np.testing.assert_allclose(told(term, at), expected, atol=SAME)
    np.testing.assert_array_equal(term.sigmas()[0], [1e-2, 1e-2, 2e-2])
    round_about = replace(term, readings=term.readings - 2.0 * np.pi)
    np.testing.assert_allclose(told(round_about, at), expected, atol=SAME)


def test_each_row_has_its_name_and_unit():
    names = everything().at().model.names
    first_and_last = [
        (("length of C1", "m"), ("length of C8", "m")),
        (("swivel angle of C1", "rad"), ("swivel angle of C8", "rad")),
        (("tracker, turn x", "rad"), ("tracker, place z", "m")),
        (("tag 0, corner 1, u", "px"), ("tag 5, corner 4, v", "px")),
        (("moment along x", "N m"), ("force along z", "N")),
        (("tension of C1", "N"), ("tension of C8", "N")),
        (("roll", "rad"), ("yaw", "rad")),
    ]
    for term, expected in zip(everything().terms, first_and_last, strict=True):
        last = term.measured().shape[1] - 1
        found = tuple((term.row_name(row, names), term.row_unit(row)) for row in (0, last))
        assert found == expected
    tracked, rest = everything().terms[2], everything().terms[4]
    assert [tracked.row_name(r, names) for r in (2, 3)] == ["tracker, turn z", "tracker, place x"]
    assert [rest.row_unit(row) for row in (2, 3)] == ["N m", "N"]


def test_terms_counted_by_many_models_are_those_of_each():
    at = everything().at()
    other = replace(at.model, length_offset=at.model.length_offset + 0.3,
                    swivel_offset=at.model.swivel_offset - 0.1)  # fmt: skip
    models = [at.model, other, at.model]
    base = replace(at.model, length_offset=np.zeros(8), swivel_offset=np.zeros(8))
    for term in everything().terms[:2]:
        one = term.counted_by(models, base).evaluate(Point(base, at.stations))[0]
        by_other = term.evaluate(Point(other, at.stations))[0]
        np.testing.assert_allclose(one[1], by_other[1], atol=1e-9)
        np.testing.assert_allclose(one[[0, 2]], term.evaluate(at)[0][[0, 2]], atol=1e-9)


def test_a_reading_that_is_missing_has_no_derivatives():
    at, lengths, tracked = everything().at(), everything().terms[0], everything().terms[2]
    readings = lengths.readings.copy()
    readings[1, 3] = np.nan
    for part in replace(lengths, readings=readings).evaluate(at):
        assert not np.any(part[1, 3])
    for part in everything().terms[6].evaluate(at):  # tilts, of which the yaw of one is missing
        assert not np.any(part[1, 2])
    assert np.any(everything().terms[6].evaluate(at)[2][0, 2])
    R = tracked.R.copy()
    R[1] = np.nan  # a place without a rotation is no pose
    assert replace(tracked, R=R).measured()[:, 0].tolist() == [True, False, True]


# Counted from zero.


def test_motor_angles_are_those_of_the_drum_from_where_it_stood_at_zero():
    at, term = zeroed().at(), zeroed().terms[0]
    model = at.model
    home = Point(model, Stations.at([term.zero])).numbers[0, :, 0]
    radius = SPIRAL.radius + model.drum_radius + model.common_drum_radius
    drum = replace(SPIRAL, radius=radius)
    lengths = at.numbers[:, :, 0] / (1.0 + term.strain)
    paid = (lengths - home - model.length_offset - 0.03) / (1.1 * model.length_scale)
    angles = drum.motor_angles(paid)
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


def test_positions_across_a_plane_count_by_their_own_deviation():
    at, term = zeroed().at(), zeroed().terms[3]
    n = term.normal
    plain = replace(term, normal=np.zeros(3))
    r, s = term.evaluate(at)[0] @ n, plain.evaluate(at)[0] @ n
    np.testing.assert_allclose(r, s * term.sigma / term.sigma_along, rtol=1e-9)


def test_a_tracker_that_is_late_tells_where_the_marker_was():
    random, true = np.random.default_rng(5), true_model()
    times, late = np.linspace(0.0, 4.0, 81), 0.013

    def place(t):
        return np.column_stack([0.2 * np.sin(2 * t), 0.2 * np.cos(t), 0.3 + 0.1 * np.sin(t)])

    at, seen = [RigidTransform(p) for p in place(times)], place(times - late)
    program = CalibrationProgram(true, at, ["clock"])
    lengths = Point(true, Stations.at(at)).numbers[:, :, 0]
    program.AddLengths(lengths + 1e-4 * random.standard_normal(lengths.shape), 1e-4, np.zeros(8))
    program.AddTrackedPoints(seen, 1e-4, times=times)
    found = program.Solve(outliers=False)
    assert found.model.clock == pytest.approx(late, abs=5.0 * found.std[0])
    assert found.std[0] < 1e-3


def test_terms_give_residuals_and_slopes_of_poses_alone():
    program = everything()
    at = program.at()
    for term in program.terms:
        for mine, other in zip(term.by_poses(at), term.evaluate(at)[::2], strict=True):
            np.testing.assert_array_equal(mine, other)


def test_blocks_of_poses_make_the_same_equations(monkeypatch):
    program = everything()
    problem, at = program.least_squares(3.0), program.at()
    whole = problem.normal_equations(at, 1e-3)
    monkeypatch.setattr(elimination, "MOST_POSES", 2)
    assert len(list(problem.blocks(at))) > 1
    parts = problem.normal_equations(at, 1e-3)
    for name in ("S", "S_data", "rhs", "back", "alone", "H"):
        one, other = getattr(parts, name), getattr(whole, name)
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * np.max(np.abs(other)))
    np.testing.assert_array_equal(problem.used(at), everything().least_squares().used(at))

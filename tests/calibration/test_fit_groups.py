"""Groups of measurements that do not agree: the projector, tests behind it, what is thrown out."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from cdpr_drake.calibration.fit_groups import group_faults, runs_test
from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.projected_residuals import ProjectedResiduals
from cdpr_drake.calibration.stations import Point
from tests.calibration.bench import poses, start_readings, true_model

SIGMA, PLACE, TURN = 5e-4, 5e-4, 1e-3
COUNT = 24
EXACT = 1e-8
"""Share by which block elimination and dense algebra differ."""


def fitted(noise=1.0, seed=0, spoil=lambda readings: None, place=1.0, count=COUNT):
    """A result and its problem: lengths of eight cables and tracked poses, with sigmas as said."""
    random, true = np.random.default_rng(seed), true_model()
    at = poses(count, random)
    zero = start_readings(true, at[0])
    program = CalibrationProgram(true, at, ["length_offsets"])
    program.AddPrior(["length_offsets"], 0.05)
    readings = simulated_lengths(true, at, zero, SIGMA, random)
    spoil(readings)
    program.AddLengths(readings, SIGMA / noise, zero)
    seen = simulated_poses(at, TURN, PLACE, random)
    program.AddTrackedPoses(seen, TURN / place, PLACE / place)
    result = program.Solve()
    return program.SolvedProblem(result), result


def residuals_of(problem, result):
    at = Point(result.model, result.stations)
    return ProjectedResiduals(problem, at, result.pose_std)


@pytest.fixture(scope="module")
def clean():
    return fitted()


def test_directions_are_projected_as_by_dense_least_squares(clean):
    """M = I - J (J'J)^-1 J' of all parameters, poses and priors at once."""
    problem, result = clean
    mine = residuals_of(problem, result)
    at = Point(result.model, result.stations)
    _, A, B = problem.evaluate(at)
    k, rows, q = B.shape
    poses_of = np.zeros((k, rows, k, q))
    poses_of[np.arange(k), :, np.arange(k)] = B
    prior = problem.prior.evaluate(at, problem.free)[1] * at.layout.typical[problem.free]
    J = np.block([
        [A.reshape(k * rows, -1), poses_of.reshape(k * rows, k * q)],
        [prior, np.zeros((len(prior), k * q))],
    ])  # fmt: skip
    Q = np.linalg.qr(J)[0]
    D = np.random.default_rng(1).standard_normal((k, rows, 3))
    whole = np.vstack([D.reshape(k * rows, 3), np.zeros((len(prior), 3))])
    expected = whole - Q @ (Q.T @ whole)
    projected, of_prior = mine.projected(D)
    np.testing.assert_allclose(projected.reshape(k * rows, 3), expected[: k * rows], atol=EXACT)
    np.testing.assert_allclose(of_prior, expected[k * rows :], atol=EXACT)
    trace = k * rows - np.sum(Q[: k * rows] ** 2)
    assert mine.degrees == pytest.approx(trace, rel=EXACT)


def test_scatter_of_each_kind_is_found_whatever_its_stated_sigma():
    """Lengths stated 1.5 times too sure, the tracker 1.5 times too unsure."""
    found = [residuals_of(*fitted(noise=1.5, seed=s, place=1.0 / 1.5)).scatter for s in range(6)]
    mean = np.sqrt(np.mean(np.square(found), axis=0))
    np.testing.assert_allclose(mean, [1.5, 1.0 / 1.5], rtol=0.1)  # of 6 x 144 degrees or more


def counting(problem, result):
    """Faults that count."""
    return [fault for fault in group_faults(problem, result) if fault.counts]


@pytest.mark.parametrize("noise", [0.25, 1.0, 2.0])
def test_noise_alone_makes_no_fault(noise):
    assert counting(*fitted(noise=noise)) == []


def test_a_factor_of_one_cable_is_estimated_with_its_deviation():
    """Small enough that nothing is thrown out; sigmas stated ten times too large."""

    def spoil(readings):
        readings[:, 2] *= 1.02

    found = group_faults(*fitted(noise=0.1, spoil=spoil, place=0.1))
    fault = next(f for f in found if f.test == "factor")
    assert fault.quantity == "length of C3"
    assert fault.std < 2e-3
    assert abs(fault.size - 1.02) < 4.0 * fault.std
    assert fault.words.startswith(f"length of C3 is {fault.size:.4g} +- ")


def test_a_reading_late_by_a_row_is_named():
    def late(readings):
        readings[1:, 4] = readings[:-1, 4].copy()

    assert any("length of C5" in fault.quantity for fault in counting(*fitted(spoil=late)))


def test_rows_that_one_factor_explains_are_named():
    rows = [3, 9, 17]

    def spoil(readings):
        readings[rows] *= 1.05

    fault = group_faults(*fitted(spoil=spoil))[0]
    assert fault.counts
    assert list(fault.rows) == rows
    assert fault.size == pytest.approx(1.05, abs=0.01)
    assert "rows 4, 10, 18" in fault.words


def test_single_outliers_are_no_group():
    def spoil(readings):
        readings[[5, 11, 20], [1, 6, 0]] += [0.05, -0.2, 0.01]

    problem, result = fitted(spoil=spoil)
    assert len(result.outliers) == 3
    assert counting(problem, result) == []


def test_a_sensor_that_loses_a_third_is_named_and_fewer_are_not():
    def spoil(share):
        def off(readings):
            count = round(share * COUNT)
            readings[1 : 1 + count, 3] += np.random.default_rng(3).choice([-1, 1], count) * 0.1

        return off

    lost = [f for f in group_faults(*fitted(spoil=spoil(0.5))) if f.test == "dropped"]
    assert [fault.words for fault in lost] == ["12 of 24 readings of length of C4 do not fit"]
    few = group_faults(*fitted(spoil=spoil(0.2)))
    assert [f for f in few if f.test == "dropped"] == []


def test_a_row_that_lost_more_than_checks_it_contradicts_itself():
    """Seven readings are left for six coordinates: one, to check against the seven others."""

    def spoil(readings):
        readings[6] += 0.05 * np.array([1, -1, 1, 1, -1, 1, -1, -1])

    fault = next(f for f in group_faults(*fitted(spoil=spoil)) if f.test == "rows")
    assert fault.rows == (6,)
    assert fault.counts
    assert "row 7 of 24 contradicts itself: 7 of 14 readings" in fault.words


@pytest.mark.parametrize("positive", [1, 3, 4])
def test_runs_are_as_rare_as_among_all_orders(positive):
    """Against the orders of seven signs, each counted."""
    signs = np.where(np.arange(7) < positive, 1.0, -1.0)
    orders = [runs_test(signs[list(order)]) for order in set(permutations(range(7)))]
    counts = np.array([runs for runs, _ in orders])
    for runs, chance in orders[:50]:
        assert chance == pytest.approx(np.mean(counts <= runs), rel=1e-12)


def test_a_reading_that_swings_slowly_has_too_few_runs():
    def spoil(readings):
        readings[:, 2] += 8.0 * SIGMA * np.sin(np.linspace(0.0, 2.0 * np.pi, 60))

    runs = [f for f in group_faults(*fitted(noise=0.25, spoil=spoil, count=60)) if f.test == "runs"]
    assert [fault.quantity for fault in runs] == ["length of C3"]


def test_the_instant_of_a_jump_is_the_likeliest_of_all(clean):
    problem, result = clean
    mine = residuals_of(problem, result)
    error = np.zeros(mine.r.shape)
    error[:, 3] = -1.0 / mine.sigma[:, 3]
    gains = {}
    for first in range(3, COUNT - 2):
        late = error * (np.arange(COUNT) >= first)[:, None]
        projected, _ = mine.projected(late[:, :, None])
        gains[first] = np.sum(mine.r * late) ** 2 / np.sum(late * projected[:, :, 0])
    assert mine.likely_instant(error)[0] == max(gains, key=gains.get)


def test_what_was_not_measured_is_in_no_group(clean):
    problem, result = clean
    lengths = problem.terms[0]
    gone = replace(lengths, readings=np.where(np.arange(8) == 7, np.nan, lengths.readings))
    other = replace(problem, terms=[gone, problem.terms[1]], dropped=None)
    assert all("C8" not in fault.quantity for fault in group_faults(other, result))

import re
from dataclasses import replace

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd, InitializeAutoDiff
from pydrake.solvers import SnoptSolver
from scipy.stats import chi2

from cdpr_drake.calibration.elimination import Minimum
from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.parameters import model_difference, moved_model
from cdpr_drake.calibration.pose_search import robust_costs
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.errors import CalibrationError
from tests.calibration.bench import camera_program, poses, start_readings, true_model, wrong_model

SURE = 1e-4
"""Probability with which a test on random numbers may fail; seeds are fixed."""


def tracker_program(start, unknown, *, count=12, sigma=1e-4, seed=0, true=None):
    random, true = np.random.default_rng(seed), true or true_model()
    at = poses(count, random)
    zero = start_readings(true, at[0])
    tracked = simulated_poses(at, 10.0 * sigma, sigma, random)
    program = CalibrationProgram(start, tracked, unknown)
    program.AddLengths(simulated_lengths(true, at, zero, sigma, random), max(sigma, 1e-5), zero)
    program.AddTrackedPoses(tracked, max(10.0 * sigma, 1e-4), max(sigma, 1e-5))
    return program


def test_without_noise_everything_comes_back():
    true = true_model()
    layout_step = np.zeros(model_difference(true, true).size)
    layout_step[:80] = 0.003 * np.random.default_rng(4).standard_normal(80)  # all of the cables
    start = moved_model(true, layout_step)
    unknown = ["exit_points", "anchor_points", "length_offsets", "length_scales", "pulley_radii"]
    result = tracker_program(start, unknown, count=30, sigma=0.0).Solve()
    assert result.status == "converged"
    assert result.gauge == ()
    found = model_difference(result.model, true)[:72]
    np.testing.assert_allclose(found, 0.0, atol=1e-6)
    assert result.chi_square < 1e-3


@pytest.mark.parametrize("seed", range(2))
def test_errors_of_the_camera_alone_are_as_large_as_their_covariance_says(seed):
    random, true = np.random.default_rng(seed), true_model()
    start = wrong_model(true, 0.004, 0.002, random)
    unknown = ["exit_points", "anchor_points", "camera", "tags"]
    program = camera_program(true, start, unknown, count=20, random=random)
    program.AddPrior(["exit_points"], 0.004)
    program.AddPrior(["anchor_points"], 0.002)
    program.AddPrior(["camera", "tags"], 1e-3)
    result = program.Solve()
    assert len(result.gauge) == 10  # pulleys stand upright, and tell which way is up
    assert result.prior_only == ()
    errors = model_difference(result.model, true)[program.free]
    squares = errors @ np.linalg.solve(result.covariance, errors)
    # The camera and the tags start where they are: their prior is a little too wide.
    low, high = chi2.ppf([SURE, 1.0 - SURE], [48, len(errors)])
    assert low < squares < high
    low, high = chi2.ppf([SURE, 1.0 - SURE], result.degrees)
    assert low < result.chi_square < high


def test_what_cannot_be_told_is_named():
    program = tracker_program(true_model(), ["C3.exit_point.z", "C3.length_offset"], count=1)
    one, other = "C3's exit point along z", "C3's length offset"
    either = f"({one} cannot be told from {other}|{other} cannot be told from {one})"
    with pytest.raises(CalibrationError, match=f"^unknown: {either}; accepted: "):
        program.Solve()


def test_a_drum_that_turned_once_cannot_be_told_from_where_counting_began():
    random, true = np.random.default_rng(0), true_model()
    at, (elsewhere, *_) = poses(2, random), poses(1, np.random.default_rng(1))
    program = CalibrationProgram(true, at[:1], ["C3.length_scale", "C3.length_offset"])
    start = start_readings(true, elsewhere)
    program.AddLengths(simulated_lengths(true, at[:1], start, 1e-4, random), 1e-4, start)
    program.AddTrackedPoses(at[:1], 1e-3, 1e-4)
    with pytest.raises(CalibrationError, match=" cannot be told from ") as problem:
        program.Solve()
    told = set(re.findall(r"C3's \w+ \w+", str(problem.value)))
    assert told >= {"C3's drum radius", "C3's length offset"}


@pytest.mark.parametrize("zeroed", [False, True])
def test_one_tape_that_starts_late_and_is_too_short_is_found(zeroed):
    true = replace(true_model(), common_length_offset=0.03, common_length_scale=1.002)
    random = np.random.default_rng(0)
    at = poses(20, random)
    zero = np.zeros(8) if zeroed else start_readings(true, at[0])
    readings = simulated_lengths(true, at, zero, 1e-4, random)
    tracked = simulated_poses(at, 1e-3, 1e-4, random)

    def solved(unknown):
        program = CalibrationProgram(true_model(), tracked, unknown)
        if zeroed:
            program.AddZeroedCables(readings, 1e-4, None)
        else:
            program.AddLengths(readings, 1e-4, zero)
        program.AddTrackedPoses(tracked, 1e-3, 1e-4)
        return program.Solve()

    both = ["common_length_offset", "common_length_scale"]
    result = solved(both)
    errors = result.values - [0.03, 0.002]
    assert errors @ np.linalg.solve(result.covariance, errors) < chi2.ppf(1.0 - SURE, 2)
    assert np.max(result.std) < 1e-3
    with pytest.raises(CalibrationError, match="offset of all lengths") as problem:
        solved([*both, "length_offsets"])
    assert " cannot be told from " in str(problem.value)


def test_a_prior_tells_what_measurements_cannot():
    program = tracker_program(true_model(), ["C3.exit_point.z", "C3.length_offset"], count=1)
    program.AddPrior(["C3.length_offset"], 0.01)
    result = program.Solve()
    assert len(result.prior_only) == 1
    assert result.std[1] == pytest.approx(0.01, rel=1e-2)


def test_a_parameter_that_nothing_depends_on_is_named():
    program = tracker_program(true_model(), ["camera"], count=4)
    with pytest.raises(CalibrationError, match=r"the camera .* cannot be told at all"):
        program.Solve()


def test_frames_without_a_tracker_are_a_gauge_and_no_error():
    random, true = np.random.default_rng(0), true_model()
    program = camera_program(true, true, ["exit_points", "tags"], count=12, random=random)
    program.AddPrior(["exit_points"], 0.005)
    result = program.Solve()
    words = "translation of the world frame along "
    assert result.gauge[1:] == (words + "x", words + "y", words + "z")
    assert result.gauge[0] == "rotation of the world frame about z"


def test_outliers_are_found_and_do_not_count():
    true = true_model()
    clean = tracker_program(true, ["exit_points"]).Solve()
    program = tracker_program(true, ["exit_points"])
    program.terms[0].readings[4, 2] += 0.02
    result = program.Solve()
    assert result.outliers[0].pose == 4
    assert result.outliers[0].what == "length of C3"
    assert result.outliers[0].residual == pytest.approx(-0.02, abs=2e-3)
    np.testing.assert_allclose(result.values, clean.values, atol=3e-4)


def far_away(program):
    """An end of a search in a minimum far away, as linear loss may lead to."""
    away = np.zeros(program.layout.size)
    away[:24] = 0.3
    return lambda *_, **__: Minimum(program.at().moved(away, np.zeros((12, 6))), 0.0, 1, True)


def test_a_search_that_ends_worse_than_it_began_goes_down_from_its_start(monkeypatch):
    program = tracker_program(true_model(), ["exit_points"])
    before = float(np.sum(robust_costs(program.terms, program.at())))
    monkeypatch.setattr(CalibrationProgram, "Approach", far_away(program))
    result = program.Solve()
    assert result.robust_cost <= before
    assert np.max(np.abs(result.values)) < 0.01


def test_an_end_worse_than_its_start_is_refused(monkeypatch):
    program = tracker_program(true_model(), ["exit_points"])
    monkeypatch.setattr("cdpr_drake.calibration.program.minimize", far_away(program))
    with pytest.raises(CalibrationError, match=r"search: found an end with cost .* after a start"):
        program.Solve()


def test_snopt_finds_no_better_parameters():
    start = wrong_model(true_model(), 0.002, 0.0, np.random.default_rng(1))
    program = tracker_program(start, ["exit_points"], count=4)
    program.AddPrior(["exit_points"], 0.01)
    result = program.Solve(outliers=False)
    prog = program.prog()
    names = [v.get_name() for v in prog.decision_variables()]
    assert names[:2] == ["C1.exit_point.x", "C1.exit_point.y"]
    found = SnoptSolver().Solve(prog, np.zeros(prog.num_vars()))
    cost = found.get_optimal_cost()
    assert 0.5 * result.chi_square <= cost * (1.0 + 1e-9)
    assert cost == pytest.approx(0.5 * result.chi_square, rel=1e-5)
    steps = found.GetSolution(prog.decision_variables())[:24] * 0.01
    np.testing.assert_allclose(steps, result.values, atol=0.05 * np.min(result.std))


def test_gradients_of_the_program_are_exact():
    random, true = np.random.default_rng(5), true_model()
    program = camera_program(true, true, ["exit_points", "camera", "tags"], count=2, random=random)
    program.AddPrior(["camera"], 0.01)
    prog = program.prog()
    x = random.uniform(-1.0, 1.0, prog.num_vars())
    for binding in prog.GetAllCosts():
        places = prog.FindDecisionVariableIndices(binding.variables())
        mine = x[places]
        (value,) = binding.evaluator().Eval(InitializeAutoDiff(mine))
        assert isinstance(value, AutoDiffXd)
        for j in range(0, len(mine), 5):
            step = 1e-6 * np.eye(len(mine))[j]
            ahead, behind = (binding.evaluator().Eval(mine + s) for s in (step, -step))
            numeric = (ahead - behind) / 2e-6
            scale = np.max(np.abs(value.derivatives()))
            assert value.derivatives()[j] == pytest.approx(numeric[0], abs=1e-7 * scale)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p.AddLengths(np.zeros((2, 8)), 1e-3), "found shape"),
        (lambda p: p.AddLengths(np.zeros((1, 8)), 0.0), "sigma: found 0"),
        (lambda p: p.AddLengths(np.full((1, 8), np.nan), 1e-3), "measurements: found none"),
        (lambda p: p.AddTensions(np.zeros((1, 8)), 1.0), "AddRest first"),
        (lambda p: p.AddPrior(["exit_point"], 1.0), "accepted: exit_points"),
        (lambda p: p.AddPrior(["exit_points"], -1.0), "found -1"),
        (lambda p: p.AddSwivels(np.full((1, 8), np.nan), 1e-3), "measurements: found none"),
        (
            lambda p: p.AddTrackedPoints(np.zeros((3, 3)), 1e-3),
            r"tracked positions: found shape \(3, 3\)",
        ),
        (lambda p: p.AddTrackedPoints(np.zeros((1, 3)), 0.0), "tracked positions: sigma: found 0"),
        (lambda p: p.AddZeroedCables(np.zeros((1, 3)), 1e-3, None), "lengths: found shape"),
    ],
)
def test_bad_input_is_named(change, words):
    program = CalibrationProgram(true_model(), poses(1, np.random.default_rng(0)), ["exit_points"])

    with pytest.raises(CalibrationError, match=words):
        (change(program), program.Solve())


def test_a_pose_that_nothing_determines_is_named():
    program = tracker_program(true_model(), ["exit_points"], count=5)
    program.terms[0].readings[3] = np.nan
    program.terms[1].p[3] = np.nan
    with pytest.raises(CalibrationError, match="pose 4"):
        program.Solve()

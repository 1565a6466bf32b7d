"""Calibrations of point masses and of bodies in planes: deviations that hold, gauges by name."""

import numpy as np
import pytest

from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.motion_type import MotionType
from tests.calibration.motion_logs import MOTIONS, chi_square, program_of

LOGS = 40
"""Logs of a test; the module counts a thousand when it is run as a script."""

SPREAD = 0.15
"""Chi-square of forty logs of a dozen parameters is off by 0.065 rms: this is 2.3 times as much;
the seeds are fixed."""

SAME = 1e-6
"""Costs of two solvers, relative."""


@pytest.mark.parametrize("name", MOTIONS)
def test_deviations_hold_for_every_motion_type(name):
    assert chi_square(MOTIONS[name], LOGS) == pytest.approx(1.0, abs=SPREAD)


@pytest.mark.parametrize("name", MOTIONS)
def test_poses_stay_where_the_platform_can_be(name):
    motion = MOTIONS[name]
    program, _ = program_of(motion, np.random.default_rng(3))
    found = program.Solve(outliers=False).stations
    B, steps = motion.basis(np.eye(3)), found.p - found.p[0]
    moves = B[3:, motion.num_turns :]
    np.testing.assert_allclose(steps, steps @ moves @ moves.T, atol=1e-12)
    if motion.is_point:
        np.testing.assert_allclose(found.R, np.broadcast_to(np.eye(3), found.R.shape), atol=1e-15)
    else:
        np.testing.assert_allclose(found.R @ np.asarray(motion.axis), [motion.axis] * 14, atol=1e-9)


def test_a_point_mass_that_nothing_tracks_leaves_the_world_free():
    program, _ = program_of(MOTIONS["point in space"], np.random.default_rng(0), tracked=False)
    told = program.FindIdentifiability()
    assert len(told.gauge) == 6
    assert all("world frame" in words for words in told.gauge)
    assert told.untold == ()
    assert program.Solve(outliers=False).gauge == told.gauge


def test_an_upright_plane_that_nothing_tracks_leaves_its_three_motions_free():
    motion = MOTIONS["body in an upright plane"]
    program, _ = program_of(motion, np.random.default_rng(0), tracked=False)
    told = program.FindIdentifiability()
    assert {words.split(" of")[0] + words[-1] for words in told.gauge} == {
        "rotationy", "translationx", "translationz",
    }  # fmt: skip


def test_coordinates_across_a_plane_are_refused_by_name():
    motion = MOTIONS["body in an upright plane"]
    program, _ = program_of(motion, np.random.default_rng(0), tracked=False)
    program.free = program.layout.select(["exit_points"])
    with pytest.raises(CalibrationError, match="exit point along y cannot be told"):
        program.Solve()


@pytest.mark.parametrize("name", MOTIONS)
def test_the_program_for_other_solvers_has_the_same_unknowns_and_gradient(name):
    motion = MOTIONS[name]
    program, _ = program_of(motion, np.random.default_rng(1))
    prog = program.prog()
    assert prog.num_vars() == int(np.sum(program.free)) + 14 * motion.freedom
    x = 1e-2 * np.random.default_rng(2).standard_normal(prog.num_vars())
    costs = prog.GetAllCosts()
    total = sum(prog.EvalBinding(cost, x).item() for cost in costs)
    problem, start = program.least_squares(), program.at()
    step = np.zeros(start.layout.size)
    count = int(np.sum(program.free))
    step[program.free] = x[:count] * start.layout.typical[program.free]
    own = x[count:].reshape(14, motion.freedom) * problem.station_scale(start)
    wide = problem.freedom.widen(own, start.stations.R, start.stations.width)
    assert total == pytest.approx(problem.cost(start.moved(step, wide)), rel=SAME)


def test_a_beam_is_solved_and_refused_by_prog():
    program, _ = program_of(MOTIONS["point in space"], np.random.default_rng(0))
    beam = type(program)(
        program.model, program.stations.poses(), ["length_offsets"], motion=MotionType("2R3T")
    )
    beam.terms = program.terms
    with pytest.raises(CalibrationError, match="2R3T"):
        beam.prog()


def test_a_bound_holds_a_parameter_and_lets_it_go_where_it_is_wide():
    program, _ = program_of(MOTIONS["point in space"], np.random.default_rng(4))
    free = program.Solve(outliers=False)
    k = int(np.argmax(np.abs(free.values[:12])))
    name, size = free.names[k], abs(float(free.values[k]))
    program.AddBound([name], 2.0 * size)
    assert program.Solve(outliers=False).at_bounds == {}
    program.AddBound([name], 0.5 * size)
    held = program.Solve(outliers=False)
    assert held.at_bounds == {name: pytest.approx(0.5 * size * np.sign(free.values[k]))}
    assert held.chi_square > free.chi_square
    assert name not in held.names
    with pytest.raises(CalibrationError, match="bound: sigma: found -1"):
        program.AddBound([name], -1.0)


def test_a_point_mass_at_rest_balances_along_its_plane_alone():
    motion = MOTIONS["point in an oblique plane"]
    program, _ = program_of(motion, np.random.default_rng(0))
    weight = np.array([1.0, 2.0, -15.0])
    tensions = np.random.default_rng(1).uniform(5.0, 20.0, (14, 4))
    term = program.AddRest(weight, np.zeros(3), 0.1, 0.5, tensions)
    at = program.at()
    r, _, B = term.evaluate(at)
    u = at.vector(0)
    force = weight - np.einsum("kma,km->ka", u, tensions)
    inside = motion.basis(np.eye(3))[3:]
    np.testing.assert_allclose(r * term.sigmas(), force @ inside, atol=1e-9)
    assert B.shape == (14, 2, 10)
    assert term.row_unit(0) == "N"
    assert term.row_name(0, ("a",)).startswith("force along (")
    assert term.only(np.array([3])).measured().shape[1] == 2

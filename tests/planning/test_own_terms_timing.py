"""Own costs and constraints of a law of time: closed forms, the passes, and scipy."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import minimize

from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    make_path,
    path_task,
)
from cdpr_drake.analyses.studies.planning.convex_timing import difference_asks
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.planning.path_timing_program import PathTimingProgram, task_asks

STATIONS = 40
CONE = 1e-6  # of the time; Clarabel stops at 1e-8, scaled
GREEDY = 1e-4  # of the time; passes choose station by station, so a program may be faster by a hair
NEAR = 1e-4  # of squared speeds; the time is flat about its least
LOCAL = 1e-3  # of squared speeds; SNOPT stops at 1e-6 of the slopes, and the cost is flat
SLOW = 0.05  # of the squared speeds of the fastest motion: no limit binds there


def pose(*numbers):
    return pose_from_angles(np.array(numbers[:3]), np.radians(numbers[3:] or (0.0, 0.0, 0.0)))


@cache
def case(corners="smooth", name="acrobot_large"):
    robot = load_robot(name)
    task = path_task(robot, LimitSettings(tensions=(1.0, 60.0), reserve=RESERVE))
    places = [pose(0, 0, 0.2), pose(0.15, -0.1, 0.4, 4, -3, 6), pose(-0.1, 0.1, 0.3)]
    if corners == "line":
        places, corners = [pose(-0.1, 0, 0.3), pose(0.1, 0.05, 0.35)], "smooth"
    return robot, task, make_path(robot, places, corners)


def time_of(x, ways):
    root = np.sqrt(x)
    return np.sum(2.0 * ways / (root[1:] + root[:-1]))


def least_by_scipy(program, extra, start):
    """The least of time and a cost over squared speeds alone, where no limit binds."""
    ways = np.diff(program.places)

    def whole(y):
        x = np.concatenate([[0.0], np.exp(y), [0.0]])
        return time_of(x, ways) + extra(x)

    found = minimize(whole, np.log(start[1:-1]), method="L-BFGS-B",
                     options={"ftol": 1e-15, "gtol": 1e-10, "maxfun": 10**6})  # fmt: skip
    return np.concatenate([[0.0], np.exp(found.x), [0.0]])


@pytest.mark.parametrize("corners", ["smooth", "rest"])
def test_with_nothing_added_the_passes_answer(corners):
    _, task, path = case(corners)
    found, plan = PathTimingProgram(task, path, STATIONS).Solve(), plan_along_path(
        task, path, STATIONS
    )  # fmt: skip
    assert found.program is None
    assert found.trajectory.squared_speeds.tobytes() == plan.trajectory.squared_speeds.tobytes()


@pytest.mark.parametrize("corners", ["smooth", "rest"])
def test_a_cost_of_nothing_gives_the_time_of_the_passes(corners):
    """They share what points ask, not how the best speeds are found; also with rests at corners."""
    _, task, path = case(corners)
    program = PathTimingProgram(task, path, STATIONS)
    program.AddQuadraticCost(0.0, 0.0, name="nothing")
    found, plan = program.Solve(), plan_along_path(task, path, STATIONS)
    assert (1.0 - GREEDY) * plan.duration <= found.duration <= (1.0 + CONE) * plan.duration
    assert found.program.cost == pytest.approx(found.duration, rel=1e-4)
    assert found.program.solver == "Clarabel"
    assert found.program.own_costs == {"nothing": 0.0}


def test_own_terms_and_a_damped_platform_are_refused():
    _, task, path = case()
    damped = replace(task, dynamics=replace(task.dynamics, damping=(20.0, 0.5)))
    program = PathTimingProgram(damped, path, STATIONS)
    plan = plan_along_path(damped, path, STATIONS)
    assert program.Solve().duration == plan.duration
    program.AddQuadraticCost(0.0, 0.0, name="nothing")
    with pytest.raises(PlanningError, match=r"a platform with damping \(20.0, 0.5\).*accepted"):
        program.Solve()


def test_a_quadratic_preference_is_what_scipy_finds():
    _, task, path = case()
    fastest = plan_along_path(task, path, STATIONS).trajectory.squared_speeds
    wanted, weight = SLOW * fastest, 1e3
    program = PathTimingProgram(task, path, STATIONS)
    program.AddQuadraticCost(wanted, weight, name="slow")
    found = program.Solve().trajectory.squared_speeds
    other = least_by_scipy(program, lambda x: weight * np.sum((x - wanted) ** 2), wanted)
    np.testing.assert_allclose(found, other, rtol=0.0, atol=NEAR * np.max(other))


def test_a_linear_bound_of_accelerations_is_the_closed_form():
    """From rest to rest over L with |d2s/dt2| <= a: T = 2 sqrt(L / a)."""
    _, task, path = case("line")
    program = PathTimingProgram(task, path, even=STATIONS)
    most = 0.2
    program.AddLinearConstraint(np.eye(STATIONS), -most, most, of="accelerations", name="gentle")
    found = program.Solve()
    assert found.duration == pytest.approx(2.0 * np.sqrt(path.length / most), rel=CONE)
    assert np.max(found.samples().uses) < 1.0
    assert found.program.own_constraints == ("gentle",)


def test_a_linear_bound_of_tensions_is_a_task_with_lower_limits():
    """Against the passes, to which the same bound is a limit."""
    _, task, path = case()
    program = PathTimingProgram(task, path, STATIONS)
    t = program.values("tensions")
    most = 12.0
    program.AddLinearConstraint(np.eye(len(t.offset)), -np.inf, most, of="tensions")
    other = plan_along_path(replace(task, limits=replace(task.limits, upper=most)), path, STATIONS)
    assert other.duration > 1.01 * plan_along_path(task, path, STATIONS).duration
    assert program.Solve().duration == pytest.approx(other.duration, rel=GREEDY)


def test_one_cable_by_its_name():
    _, task, path = case()
    program = PathTimingProgram(task, path, STATIONS)
    name = task.name(2)
    rows = len(program.values(name).offset)
    assert rows == 2 * (len(program.places) - 1)
    program.AddLinearConstraint(np.eye(rows), 4.0, 7.0, of=name)
    found = program.Solve()
    assert found.duration > plan_along_path(task, path, STATIONS).duration
    assert program.tensions().shape == (len(program.places) - 1, 2, 8)


def test_a_nonlinear_cost_is_what_scipy_finds():
    _, task, path = case("line")
    program = PathTimingProgram(task, path, even=16)
    plan = plan_along_path(task, path, STATIONS)
    start = SLOW * np.interp(program.places, plan.trajectory.stations,
                             plan.trajectory.squared_speeds)  # fmt: skip
    size = np.max(start)

    def steep(x):
        return 2.0 * np.sum(np.exp(x / size) - 1.0)

    program.AddCost(steep, name="steep")
    found = program.Solve()
    other = least_by_scipy(program, steep, start)
    x = found.trajectory.squared_speeds
    np.testing.assert_allclose(x, other, rtol=0.0, atol=LOCAL * np.max(other))
    whole = [time_of(one, np.diff(program.places)) + steep(one) for one in (x, other)]
    assert whole[0] == pytest.approx(whole[1], rel=CONE)
    assert found.program.own_costs["steep"] == pytest.approx(steep(x), rel=1e-3)


def test_what_points_ask_is_what_differences_of_poses_say():
    """Tensions of least norm that a speed and an acceleration need, by both; statics apart."""
    robot, task, path = case()
    task = replace(task, dynamics=replace(task.dynamics, damping=(7.0, 0.9)))
    places = np.linspace(0.1, 0.9, 7) * path.length
    one, other = task_asks(task)(path, places), difference_asks(robot, task)(path, places)
    for u, x in ((0.0, 0.0), (0.7, 0.0), (0.0, 0.4), (-0.5, 0.3)):
        by_both = [
            np.array([
                np.linalg.pinv(E) @ (b + u * a + x * c + np.sqrt(x) * d) for E, a, c, d, b in zip(
                    asks.balance, asks.by_u, asks.by_x, asks.by_root, asks.rest, strict=True)
            ])
            for asks in (one, other)
        ]  # fmt: skip
        np.testing.assert_allclose(*by_both, rtol=0.0, atol=1e-4 * np.max(np.abs(by_both[0])))
    for E in one.balance:
        np.testing.assert_allclose(E @ E.T, np.eye(6), atol=1e-12)
        assert null_space(E).shape == (8, 2)
    np.testing.assert_allclose(one.rates, other.rates, atol=1e-6)
    np.testing.assert_allclose(one.bends, other.bends, atol=1e-3)


def test_own_terms_that_leave_no_motion_are_said():
    _, task, path = case()
    program = PathTimingProgram(task, path, STATIONS)
    rows = len(program.values("tensions").offset)
    program.AddLinearConstraint(np.eye(rows), 40.0, 60.0, of="tensions", name="stiff")
    with pytest.raises(PlanningError, match=r"a law of time along the path: found none with stiff"):
        program.Solve()


def test_own_terms_that_stop_on_the_way_are_said():
    _, task, path = case()
    program = PathTimingProgram(task, path, STATIONS)
    x = program.speeds_squared()
    program.prog().AddBoundingBoxConstraint(0.0, 0.0, x[10:13])
    with pytest.raises(PlanningError, match="law of time along the path: found"):
        program.Solve()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p.AddQuadraticCost(0.1, of="speed"), "of: found 'speed'; accepted: speeds_sq"),
        (lambda p: p.AddQuadraticCost(np.ones(3)), r"wanted: found shape \(3,\)"),
        (lambda p: p.AddLinearConstraint(np.ones(3), 0, 1, of="C1"), r"A: found shape \(1, 3\)"),
        (lambda p: p.AddCost(lambda x: 1.0 / x[0]), "NaN or infinity where the search starts"),
    ],
)
def test_bad_input_is_one_line(change, words):
    _, task, path = case()
    program = PathTimingProgram(task, path, 10)
    with np.errstate(divide="ignore"), pytest.raises(PlanningError, match=words) as refused:
        change(program)
    assert "\n" not in str(refused.value)


def test_the_number_of_stations_is_checked():
    _, task, path = case()
    with pytest.raises(PlanningError, match="stations: found 3; accepted: 10 to"):
        PathTimingProgram(task, path, 3)

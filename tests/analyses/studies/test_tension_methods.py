"""Control by tensions: numbers of its trials, starts beside the path, paths, coverage."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import linprog

from cdpr_drake.analyses.studies import tension_trials as trials
from cdpr_drake.analyses.studies.tension_methods import GAINS, near_instability
from cdpr_drake.analyses.studies.tension_trials import (
    FINE,
    NOTHING,
    STATIC,
    THESIS_END,
    THESIS_START,
    Applied,
    StartTrial,
    TensionTrial,
    can_hold,
    held_path,
    run_start_trial,
    run_trial,
)
from cdpr_drake.analyses.tensions import applicable_methods
from cdpr_drake.control.force_balance import FORCE, WRENCH
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import wrench_matrix
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

ROBOT = load_robot("caroca_gazebo")
HOME = np.array(ROBOT.home.position)
PROBLEM = tension_problem(ROBOT, ROBOT.home.transform())
GRAVITY = 9.81

TRACKING = 1e-6
"""A platform at rest with the exact model stays where it is [m]."""

ROUNDING = 1e-9
"""Of forces of some hundred newtons [N, N m]."""

MEAN = 0.03
"""What the mean of a period of 10 ms leaves out, and a start that has not quite died out."""


def matrix_at(position):
    X_WP = pose_from_angles(position, np.zeros(3))
    return wrench_matrix(X_WP, ROBOT.exit_points(), ROBOT.anchor_points())


def run(method="quadratic_program", **changes):
    home = ROBOT.home.transform()
    settings = {
        "experiment": "test", "robot": "caroca_gazebo", "path": (home, home), "legs": (1.0,),
        "method": method, "stiffness": 100.0, "damping": 100.0, "duration": 0.2,
    }  # fmt: skip
    return run_trial(TensionTrial(**(settings | changes)))


def test_a_platform_at_rest_stays():
    found = run()
    assert not found["lost"]
    assert found["position_error_max_m"] < TRACKING
    assert found["failures"] == found["negative_tensions"] == 0
    assert found["control_steps"] == pytest.approx(0.2 / trials.STEP, abs=1)
    assert found["tension_min_n"] >= 1.0
    assert found["end_time_s"] == pytest.approx(0.2)
    assert found["times_s"].shape == found["errors_m"].shape == (len(found["tensions_n"]),)
    assert run(rate=100.0)["control_steps"] == pytest.approx(20, abs=1)


@pytest.mark.parametrize("gain", [100.0, 400.0])
def test_an_offset_asks_for_the_force_that_the_gain_says(gain):
    """The first tensions carry m (g + Kp e)."""
    offset = 0.01
    found = run(stiffness=gain, offset=(0.0, 0.0, -offset), duration=0.01)
    assert found["position_error_max_m"] == pytest.approx(offset, rel=1e-3)
    force = matrix_at(HOME - [0.0, 0.0, offset])[5] @ found["tensions_n"][0]
    assert force == pytest.approx(GRAVITY + gain * offset, rel=1e-6)


def test_what_is_out_of_bounds_falls_held_and_stays_pushed():
    held = run("closed_form", duration=2.0)
    assert held["lost"]
    assert held["failures"] >= held["control_steps"] - 1
    assert held["end_time_s"] < 1.0
    assert held["position_error_max_m"] == pytest.approx(trials.LOST_DISTANCE, rel=0.05)
    pushed = run("closed_form", applied=Applied.PUSHED)
    assert not pushed["lost"]
    assert pushed["tension_min_n"] < 0.0
    assert pushed["negative_tensions"] > 0
    assert pushed["position_error_max_m"] < TRACKING


@pytest.mark.parametrize(
    "method", ["pseudo_inverse", "closed_form", "linear_program", "quadratic_program"]
)
def test_unchecked_tensions_out_of_bounds_come_out_balanced(method):
    """Where nothing holds within bounds the pseudo-inverse and the closed form still balance."""
    start = pose_from_angles(np.array(THESIS_START) - [0.0, 0.0, 0.2], np.zeros(3))
    settings = TensionControlSettings(
        trajectory=PoseTrajectory((start, start), (1.0,)), gains=TaskGains(100.0, 100.0),
        method=method, push=True, distributor=trials.UncheckedDistributor,
    )  # fmt: skip
    control = build_tension_control(ROBOT, settings)
    context = control.make_context()
    distributor = control.diagram.GetSubsystemByName("distributor")
    own = distributor.GetMyMutableContextFromRoot(context)
    own.SetDiscreteState(distributor.EvalUniquePeriodicDiscreteUpdate(own))
    tensions = control.diagram.GetOutputPort("tensions").Eval(context)
    assert control.diagram.GetOutputPort("failures").Eval(context) == 1.0
    if method.endswith("program"):  # a search has no answer; the lower limits stay
        np.testing.assert_array_equal(tensions, np.ones(8))
        return
    wanted = control.diagram.GetSubsystemByName("controller").GetOutputPort("desired_wrench")
    asked = wanted.Eval(wanted.get_system().GetMyContextFromRoot(context))
    np.testing.assert_allclose(matrix_at(start.translation()) @ tensions, asked, atol=ROUNDING)
    assert tensions.min() < 0.0


def beside(**changes):
    asked = {
        "experiment": trials.START_ERROR, "robot": "caroca_gazebo", "path": (HOME, HOME),
        "leg": 1.0, "method": "quadratic_program", "gain": 100.0, "applied": Applied.HELD,
        "balance": WRENCH, "rate": 1000.0, "start": "somewhere",
        "position": HOME - [0.0, 0.0, 0.1], "duration": 0.2,
    }  # fmt: skip
    return StartTrial(**(asked | changes))


@pytest.mark.parametrize("balance", [WRENCH, FORCE])
@pytest.mark.parametrize(
    ("method", "applied"), [("quadratic_program", Applied.HELD), ("pseudo_inverse", Applied.PUSHED)]
)
def test_the_first_tensions_are_gain_times_start_error(balance, method, applied):
    """1 kg that starts 0.1 m below its goal at gain 100: 9.81 N and 10 N, upwards."""
    found = run_start_trial(beside(balance=balance, method=method, applied=applied))
    assert found["start_error_m"] == pytest.approx(0.1)
    force = np.array([0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY + 10.0])
    rows = slice(3 if balance == FORCE else 0, 6)
    W = matrix_at(HOME - [0.0, 0.0, 0.1])
    least = np.linalg.pinv(W[rows]) @ force[rows]  # within the bounds here, so of both methods
    assert least.min() > 1.0
    assert found["tension_first_max_n"] == pytest.approx(np.max(least), abs=ROUNDING)
    assert found["tension_max_n"] >= found["tension_first_max_n"]
    assert found["control_steps"] == 200
    assert not found["lost"]
    if balance == FORCE:  # by forces alone the platform turns
        assert found["turn_max_rad"] > 1e-2


def test_the_error_dies_out_by_the_wrench():
    """The slow mode at Kp = Kd = 100 has a time constant of 1 s."""
    found = run_start_trial(beside(duration=6.0))
    assert found["position_error_last_tenth_m"] == pytest.approx(0.1 * np.exp(-5.7), rel=0.1)
    assert found["turn_max_rad"] < 1e-3


def test_forces_that_act_a_tenth_of_the_time_are_ten_times_as_large():
    """In the balance of a mean: error and speed carry the other nine tenths of the weight.

    From pulse to pulse the speed goes from -v to v and back, v = 9 g 1 ms / 2; it is read at -v.
    """
    pulsed = beside(
        rate=100.0, between=NOTHING, gain=400.0, method="pseudo_inverse", applied=Applied.PUSHED,
        position=HOME, duration=6.0,
    )  # fmt: skip
    found = run_start_trial(pulsed)
    sag = (9.0 * GRAVITY - 400.0 * 4.5e-3 * GRAVITY) / 400.0
    assert found["position_error_last_tenth_m"] == pytest.approx(sag, rel=MEAN)
    inverse = np.linalg.pinv(matrix_at(HOME - [0.0, 0.0, sag]))
    ten = inverse @ [0.0, 0.0, 0.0, 0.0, 0.0, 10.0 * GRAVITY]
    assert found["tension_last_max_n"] == pytest.approx(np.max(ten), rel=MEAN)
    assert found["control_steps"] == 600


def test_tensions_of_rest_leave_nothing_to_do_at_home():
    pulsed = beside(rate=100.0, between=STATIC, balance=FORCE, position=HOME, duration=0.05)
    W = wrench_matrix(ROBOT.home.transform(), ROBOT.exit_points(), ROBOT.anchor_points())
    resting = pulsed.resting_tensions(ROBOT)
    np.testing.assert_allclose(W[3:] @ resting, [0.0, 0.0, GRAVITY], atol=ROUNDING)
    none = replace(pulsed, between=NOTHING).resting_tensions(ROBOT)
    np.testing.assert_array_equal(none, np.zeros(8))


def test_a_platform_that_nothing_holds_is_lost():
    """Unchecked tensions that a cable cannot have: closed form within bounds that it leaves."""
    found = run_start_trial(beside(method="closed_form", duration=5.0))
    assert found["lost"]
    assert found["tension_last_max_n"] is None
    assert found["end_time_s"] < 5.0


def holds_by_linprog(position):
    """An independent verdict."""
    X_WP, cables = pose_from_angles(position, np.zeros(3)), ROBOT.cable_set(pulleys=False)
    problem = tension_problem(ROBOT, X_WP, cables=cables)
    bounds = np.column_stack([problem.lower, problem.upper])
    return linprog(np.ones(8), A_eq=problem.W, b_eq=-problem.wrench, bounds=bounds).status == 0


def test_the_printed_start_is_moved_by_the_least_amount():
    start, end = (np.array(place) - [0.0, 0.0, 0.2] for place in (THESIS_START, THESIS_END))
    path = held_path(ROBOT, start, end, HOME)
    assert not can_hold(ROBOT, start)
    first, last = path.ends
    np.testing.assert_array_equal(last, end)
    assert path.limits[1] == path.shifts[1] == 0.0
    way = (HOME - start) / np.linalg.norm(HOME - start)
    np.testing.assert_allclose(first, start + path.shifts[0] * way)
    assert 0.0 < path.limits[0] <= path.shifts[0]
    assert holds_by_linprog(start + (path.limits[0] + FINE) * way)
    assert not holds_by_linprog(start + (path.limits[0] - 2.0 * FINE) * way)
    for share in np.linspace(0.0, 1.0, 50):
        assert holds_by_linprog(first + share * (last - first))


def test_a_path_that_can_be_held_stays_and_the_inside_must_be_held():
    away = HOME + np.array([0.5, 0.2, 0.3])
    path = held_path(ROBOT, HOME, away, HOME)
    np.testing.assert_array_equal(path.ends[0], HOME)
    np.testing.assert_allclose(path.ends[1], away)
    assert path.shifts == (0.0, 0.0)
    with pytest.raises(InfeasibleTensionError, match="no tensions hold"):
        held_path(ROBOT, HOME, HOME, np.array(THESIS_START))


@pytest.mark.parametrize("method", applicable_methods(PROBLEM))
def test_exact_methods_solve_all_of_a_grid_and_no_verdict_is_wrong(method):
    row = trials.cover("acrobot_large", (4, 3, 2), method)
    assert row["feasible"] > 0
    assert row["wrong"] == 0
    assert 0.0 <= row["share"] <= 1.0
    assert row["share"] == 1.0 or not METHODS[method].exact


ROW = {"lost": False, "failures": 0, "position_error_max_m": 1e-6, "end_time_s": 1.0}


@pytest.mark.parametrize(
    ("error", "failures", "held"),
    [(1e-3, 0, [True] * 2), (1e-9, 0, [False] * 3), (1e-9, 5, [False, False, True])],
)
def test_instability_is_a_fall_a_failure_or_a_larger_error(error, failures, held):
    far = {"position_error_max_m": error}
    pairs = [
        ("thesis", "quadratic_program", 100.0, {}), ("thesis", "linear_program", 1200.0, far),
        ("thesis", "quadratic_program", 1500.0, far), ("far_step", "quadratic_program", 1200.0, {}),
        *(("slow", "quadratic_program", gain, {"failures": failures}) for gain in GAINS),
    ]  # fmt: skip
    rows = pd.DataFrame([
        {"experiment": experiment, "method": method, "kp_per_s2": gain, "applied": "held", **ROW,
         **numbers}
        for experiment, method, gain, numbers in pairs
    ])  # fmt: skip
    assert near_instability(rows)[0] == held

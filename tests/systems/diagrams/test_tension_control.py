"""Dynamic control by tensions: a feasible trajectory is followed, by the exact model."""

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles, pose_from_row, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.robots.settings import DampingSettings
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

TRACKING = 1e-4
"""Promised distance from the trajectory with the exact model [m]; a wrench that is held for a
millisecond leaves some micrometres."""

UNDAMPED = DampingSettings(translation=0.0, rotation=0.0)
"""The controller's model has no damping of the platform, which CAROCA's file has."""

ROUNDING = 1e-12
"""The same numbers by another way, of order one [m, N]."""


def there_and_back(robot, step, turn):
    home = robot.home.transform()
    away = pose_from_angles(home.translation() + step, np.radians(turn))
    return PoseTrajectory((home, away, home), (1.0, 1.0), 0.1)


def advance(control, duration):
    context = control.make_context()
    simulator = Simulator(control.diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3).set_fixed_step_mode(True)
    worst = 0.0
    for k in range(1, int(duration / 0.05) + 1):
        simulator.AdvanceTo(0.05 * k)
        worst = max(worst, control.errors(context)[0])
    return context, worst


@pytest.mark.parametrize("method", ["quadratic_program", "barycenter"])
@pytest.mark.parametrize(
    ("name", "step", "turn"),
    [
        ("acrobot_large", [0.1, -0.08, 0.15], [4.0, -3.0, 6.0]),
        ("caroca", [0.3, 0.5, 0.3], [2.0, -2.0, 3.0]),
    ],
)
def test_feasible_trajectory_is_followed(name, step, turn, method):
    robot = load_robot(name)
    control = build_tension_control(
        robot,
        TensionControlSettings(
            trajectory=there_and_back(robot, step, turn),
            gains=TaskGains(100.0, 20.0),
            method=method,
            damping=UNDAMPED,
        ),
    )
    context, worst = advance(control, 2.2)
    assert worst < TRACKING
    assert control.diagram.GetOutputPort("failures").Eval(context) == 0.0


def test_pulleys_that_the_distribution_knows_do_not_matter():
    robot = load_robot("caroca")
    trajectory = there_and_back(robot, [0.3, 0.5, 0.3], [2.0, -2.0, 3.0])
    worst = {}
    for known in (True, False):
        believed = robot.cable_set() if known else robot.cable_set().without_pulleys()
        control = build_tension_control(
            robot,
            TensionControlSettings(
                trajectory=trajectory,
                gains=TaskGains(100.0, 20.0),
                cables=robot.cable_set(),
                believed_cables=believed,
                damping=UNDAMPED,
            ),
            log_rate=10.0,
        )
        context, worst[known] = advance(control, 2.2)
        log = control.read_log(context)
        X_WP = pose_from_row(log["X_WP"][-1])
        lengths = cable_paths(X_WP, robot.cable_set()).lengths
        np.testing.assert_allclose(log["lengths"][-1], lengths, rtol=0.0, atol=ROUNDING)
    assert worst[True] < TRACKING
    assert worst[False] > 10.0 * TRACKING


def test_planar_robot_follows_too():
    robot = load_robot("planar")
    control = build_tension_control(
        robot,
        TensionControlSettings(
            trajectory=there_and_back(robot, [0.1, 0.05, 0.0], [0, 0, 5.0]),
            gains=TaskGains(100.0, 20.0),
        ),
    )
    context, worst = advance(control, 2.2)
    assert worst < TRACKING
    assert control.diagram.GetOutputPort("failures").Eval(context) == 0.0


def test_names_are_public():
    robot = load_robot("acrobot_large")
    control = build_tension_control(
        robot,
        TensionControlSettings(
            trajectory=there_and_back(robot, [0.1, 0, 0.1], [0, 0, 0]), gains=TaskGains(100.0, 20.0)
        ),
    )
    assert {system.get_name() for system in control.diagram.GetSystems()} == {
        "plant", "controller", "distributor", "cables",
    }  # fmt: skip
    ports = {
        control.diagram.get_output_port(i).get_name()
        for i in range(control.diagram.num_output_ports())
    }
    assert ports == {
        "X_WP", "X_WP_desired", "desired_wrench", "tensions", "feasible", "failures", "lengths",
        "slack",
    }  # fmt: skip


def test_a_trajectory_that_cannot_be_held_is_counted():
    robot = load_robot("acrobot_large")
    control = build_tension_control(
        robot,
        TensionControlSettings(
            trajectory=there_and_back(robot, [0.0, 0.0, 0.1], [0, 0, 0]),
            gains=TaskGains(100.0, 20.0),
            limits=(0.0, 5.3),
        ),
    )
    context, _ = advance(control, 0.8)
    assert control.diagram.GetOutputPort("failures").Eval(context) > 0.0


def test_log_has_what_the_ports_give():
    """Lengths, slack and poses are computed from logged states, and not in the loop."""
    robot = load_robot("planar")
    control = build_tension_control(
        robot,
        TensionControlSettings(
            trajectory=there_and_back(robot, [0.1, 0.05, 0.0], [0, 0, 5.0]),
            gains=TaskGains(100.0, 20.0),
            limits=(0.0, 60.0),
        ),
        log_rate=100.0,
    )
    context, _ = advance(control, 0.5)
    log = control.read_log(context)
    assert log["time"][-1] == pytest.approx(0.5)
    for name in ("X_WP", "X_WP_desired"):
        here = pose_row(control.diagram.GetOutputPort(name).Eval(context))
        np.testing.assert_allclose(log[name][-1], here, rtol=0.0, atol=ROUNDING)
    for name in ("desired_wrench", "tensions", "feasible", "failures", "lengths", "slack"):
        here = control.diagram.GetOutputPort(name).Eval(context)
        np.testing.assert_allclose(log[name][-1], here, rtol=0.0, atol=ROUNDING)
        assert len(log[name]) == len(log["time"])
    assert np.any(log["slack"])  # the least tensions of a planar robot have cables at zero

"""Shows a simulation in Meshcat while it runs, at the pace of real time at most.

Frames are drawn between steps and change nothing in the simulation: a run has the same numbers with
and without them, and only its wall time grows to the simulated one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, EventStatus

from cdpr_drake.analyses.visualization.replay import REPLAY_RATE, RobotPicture
from cdpr_drake.analyses.visualization.shown_things import ShownThing, ShownView
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.cable_robot import holding_tensions
from cdpr_drake.systems.robots.settings import CableSettings
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.worlds.settings import WorldSettings

Prepare = Callable[[Simulator, Diagram], None]
"""Gets a run's simulator and diagram before it starts."""


def live_servo(scenario: Scenario, meshcat: Meshcat) -> Prepare:
    """Lets Meshcat follow a visual servo, its target too."""
    start = scenario.initial_pose.transform()
    return _follow(_at_start(meshcat, load_robot(scenario.robot), start, scenario))


def live_tension_control(scenario: TensionScenario, meshcat: Meshcat) -> Prepare:
    """Lets Meshcat follow dynamic control by commanded tensions."""
    start = scenario.trajectory.trajectory().pose(0.0)
    cables = CableSettings(model=ELASTIC, pulleys=scenario.cables.pulleys)
    robot = load_robot(scenario.robot)
    return _follow(_at_start(meshcat, robot, start, cables=cables, world=scenario.world))


def live_pick_and_place(
    scenario: PickAndPlaceScenario, meshcat: Meshcat, things: Sequence[ShownThing | ShownView]
) -> Prepare:
    """Lets Meshcat follow picking and placing; things move as outputs of the diagram do."""
    picture = _at_start(
        meshcat, load_robot(scenario.robot), scenario.initial_pose.transform(),
        cables=scenario.cables, world=scenario.world,
    )  # fmt: skip
    picture.show_things(things)
    return _follow(picture, things)


def _at_start(
    meshcat: Meshcat, robot: Robot, X_WP: RigidTransform, scenario: Scenario | None = None,
    cables: CableSettings | None = None, world: WorldSettings | None = None,
) -> RobotPicture:  # fmt: skip
    """A robot at the pose X_WP [m] where its run begins; the other arguments as `RobotPicture`."""
    try:
        holding = holding_tensions(robot, X_WP, (cables or CableSettings()).cable_set(robot))
        full_scale = 2.0 * float(np.max(holding))
    except CdprError:  # the run may begin where cables are slack
        full_scale = robot.tension_limits()[1]
    picture = RobotPicture(robot, full_scale, scenario, cables, meshcat=meshcat, world=world)
    picture.draw(X_WP, np.full(len(robot.cables), np.nan), 0.0)
    return picture


def _follow(picture: RobotPicture, things: Sequence[ShownThing | ShownView] = ()) -> Prepare:
    """Draws a frame when it is due, and waits until its simulated time has passed in reality."""

    def prepare(simulator: Simulator, diagram: Diagram) -> None:
        begin, due = 0.0, -np.inf  # in real time, and simulated [s]

        def draw(root: Context) -> EventStatus:
            nonlocal begin, due
            now = root.get_time()
            if now < due:
                return EventStatus.DidNothing()
            if due == -np.inf:
                begin = time.monotonic() - now

            def value(port: str) -> Any:
                return diagram.GetOutputPort(port).Eval(root)

            for thing in things:
                path = f"things/{thing.name}"
                if thing.quantity is not None:
                    picture.meshcat.SetTransform(path, value(thing.quantity))
                if thing.while_positive is not None:
                    shown = bool(value(thing.while_positive)[0] > 0.0)
                    picture.meshcat.SetProperty(path, "visible", shown)
            hangs = diagram.HasOutputPort("unstrained_lengths")
            time.sleep(max(begin + now - time.monotonic(), 0.0))
            picture.draw(
                value("X_WP"), value("tensions"), now,
                value("unstrained_lengths") if hangs else None,
            )  # fmt: skip
            due = now + 1.0 / REPLAY_RATE
            return EventStatus.Succeeded()

        # After each step; a periodic event would end steps of its own, and change the numbers.
        simulator.set_monitor(draw)

    return prepare

"""Shows a simulation in Meshcat while it runs, at the pace of real time at most."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, EventStatus

from cdpr_drake.analyses.visualization.replay import REPLAY_RATE, RobotPicture
from cdpr_drake.analyses.visualization.shown_things import ShownThing, ShownView
from cdpr_drake.arrays import Array
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


class LiveView:
    """A robot in Meshcat that follows a run.

    It draws between steps and changes nothing in the simulation, so a run has the same numbers
    with and without it; only its wall time grows to the simulated one.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        robot: Robot,
        X_WP: RigidTransform,
        scenario: Scenario | None = None,
        cables: CableSettings | None = None,
        *,
        world: WorldSettings | None = None,
    ) -> None:
        """Shows the robot at the pose X_WP [m] where the run begins; else as `RobotPicture`."""
        try:
            full_scale = 2.0 * float(
                np.max(holding_tensions(robot, X_WP, (cables or CableSettings()).cable_set(robot)))
            )
        except CdprError:  # the run may begin where cables are slack
            full_scale = robot.tension_limits()[1]
        self._picture = RobotPicture(
            robot, full_scale, scenario, cables, meshcat=meshcat, world=world
        )
        self._picture.draw(X_WP, np.full(len(robot.cables), np.nan), 0.0)
        self._began: float | None = None
        self._next = 0.0

    def show_things(self, things: Sequence[ShownThing | ShownView]) -> None:
        """As `RobotPicture` does."""
        self._picture.show_things(things)

    def is_due(self, sim_time: float) -> bool:
        """Whether a frame is wanted at a simulated time [s]."""
        return sim_time >= self._next

    def draw(
        self,
        sim_time: float,
        X_WP: RigidTransform,
        tensions: Array,
        unstrained_lengths: Array | None = None,
    ) -> None:
        """Draws a frame, and waits until its simulated time [s] has passed in reality, too.

        Args:
            sim_time: Simulated time [s].
            X_WP: Pose of the platform [m].
            tensions: Shape (m,) [N].
            unstrained_lengths: Shape (m,) [m]; None: cables are drawn straight.
        """
        if self._began is None:
            self._began = time.monotonic() - sim_time
        time.sleep(max(self._began + sim_time - time.monotonic(), 0.0))
        self._picture.draw(X_WP, tensions, sim_time, unstrained_lengths)
        self._next = sim_time + 1.0 / REPLAY_RATE


Prepare = Callable[[Simulator, Diagram], None]
"""Gets a run's simulator and diagram before it starts."""


def live_servo(scenario: Scenario, meshcat: Meshcat) -> Prepare:
    """What lets Meshcat follow a visual servo, its target too."""
    start = scenario.initial_pose.transform()
    return _follow(LiveView(meshcat, load_robot(scenario.robot), start, scenario))


def live_tension_control(scenario: TensionScenario, meshcat: Meshcat) -> Prepare:
    """What lets Meshcat follow dynamic control by commanded tensions."""
    start = scenario.trajectory.trajectory().pose(0.0)
    cables = CableSettings(model=ELASTIC, pulleys=scenario.cables.pulleys)
    robot = load_robot(scenario.robot)
    return _follow(LiveView(meshcat, robot, start, cables=cables, world=scenario.world))


def live_pick_and_place(
    scenario: PickAndPlaceScenario, meshcat: Meshcat, things: Sequence[ShownThing | ShownView]
) -> Prepare:
    """What lets Meshcat follow picking and placing; things move as outputs of the diagram do."""
    view = LiveView(
        meshcat, load_robot(scenario.robot), scenario.initial_pose.transform(),
        cables=scenario.cables, world=scenario.world,
    )  # fmt: skip
    view.show_things(things)

    def also(diagram: Diagram, context: Context) -> None:
        for thing in things:
            if thing.quantity is not None:
                pose = diagram.GetOutputPort(thing.quantity).Eval(context)
                meshcat.SetTransform(f"things/{thing.name}", pose)
            if thing.while_positive is not None:
                there = diagram.GetOutputPort(thing.while_positive).Eval(context)[0] > 0.0
                meshcat.SetProperty(f"things/{thing.name}", "visible", bool(there))

    return _follow(view, also)


def _follow(
    view: LiveView, also: Callable[[Diagram, Context], None] = lambda diagram, context: None
) -> Prepare:
    def prepare(simulator: Simulator, diagram: Diagram) -> None:
        # After each step; a periodic event would end steps of its own, and change the numbers.
        simulator.set_monitor(lambda context: look(diagram, context))

    def look(diagram: Diagram, context: Context) -> EventStatus:
        now = context.get_time()
        if not view.is_due(now):
            return EventStatus.DidNothing()
        lengths = None
        if diagram.HasOutputPort("unstrained_lengths"):
            lengths = diagram.GetOutputPort("unstrained_lengths").Eval(context)
        also(diagram, context)
        view.draw(
            now,
            diagram.GetOutputPort("X_WP").Eval(context),
            diagram.GetOutputPort("tensions").Eval(context),
            lengths,
        )
        return EventStatus.Succeeded()

    return prepare

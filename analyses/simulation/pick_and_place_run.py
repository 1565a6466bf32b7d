"""Runs a scenario of picking and placing, and keeps what it did."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.analyses.simulation.run_loop import (
    LONGEST_WARM_UP,
    EndedRun,
    advance,
    ended,
    fixed_step_simulator,
    left_unfinished,
)
from cdpr_drake.analyses.simulation.session import DEFAULT_SESSION, RunSession
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.pick_and_place.pick_and_place import PickAndPlace, build_pick_and_place
from cdpr_drake.systems.pick_and_place.pick_and_place_task import (
    FAILURE_WORDS,
    Failure,
    Phase,
    PickAndPlaceState,
)
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario


@dataclass(frozen=True, kw_only=True)
class PickAndPlaceRun(EndedRun):
    """What a run did; its outcome is COMPLETED, FAILED, TIMEOUT, DIVERGED or INTERRUPTED.

    Attributes:
        built: The diagram and its handles; its log has what `build_pick_and_place` says.
        state: Where the task stood at the end; None for a run that another program left behind.
    """

    built: PickAndPlace
    state: PickAndPlaceState | None

    @property
    def scenario(self) -> PickAndPlaceScenario:
        """The scenario."""
        return self.built.scenario


def make_simulator(built: PickAndPlace, context: Context) -> Simulator:
    """A simulator with the scenario's integrator and fixed step."""
    method = built.scenario.integration.integrator
    return fixed_step_simulator(built.diagram, context, method, built.max_step)


def run_pick_and_place(
    scenario: PickAndPlaceScenario, session: RunSession = DEFAULT_SESSION, **how: Any
) -> PickAndPlaceRun:
    """Simulates a scenario until the box is set down, or the task has failed.

    Arguments as `visual_servo_run.run_scenario`; nothing outside can be connected.

    Raises:
        CdprError: The scenario cannot be built: robot, cameras or initial pose.
        CheckpointError: There is no checkpoint of this run.
        OSError: The log cannot be written.
    """
    session = session.having(how)
    assert session.connect is None  # the scenario has no section remote
    built = build_pick_and_place(scenario)
    with suppress(CableGeometryError, RuntimeError):  # loads kernels and the renderer
        simulator = make_simulator(built, built.make_context())
        simulator.AdvanceTo(min(1.0 / scenario.handling.rate, scenario.duration, LONGEST_WARM_UP))
    context = built.make_context()
    keeper = session.keeper(built.log, context, built.log.read, scenario)
    simulator = make_simulator(built, context)
    session.begin(simulator, built.diagram)
    end = advance(
        simulator,
        scenario.duration,
        lambda _: _outcome(built, context),
        lambda: pose_error(built.X_WG, built.box_pose(context)),
        session,
        keeper,
    )
    state = built.machine.state(built.machine.GetMyContextFromRoot(context))
    end = replace(end, message=end.message or _message(built, context, state, end.outcome))
    return PickAndPlaceRun(**ended(end, keeper, context.get_time()), built=built, state=state)


def _outcome(built: PickAndPlace, context: Context) -> Outcome:
    p = built.platform_pose(context).translation()
    lower, upper = built.robot.frame.bounds()
    if np.any(p < lower) or np.any(p > upper):
        return Outcome.DIVERGED
    phase = built.machine.state(built.machine.GetMyContextFromRoot(context)).phase
    if phase in (Phase.DONE, Phase.FAILED):
        return Outcome.COMPLETED if phase is Phase.DONE else Outcome.FAILED
    over = context.get_time() >= built.scenario.duration * (1.0 - 1e-12)
    return Outcome.TIMEOUT if over else Outcome.RUNNING


def _message(
    built: PickAndPlace, context: Context, state: PickAndPlaceState, outcome: Outcome
) -> str:
    """Why a task was not done, with the phase in which it ended; empty if it was."""
    if outcome == Outcome.COMPLETED:
        return ""
    if outcome != Outcome.FAILED:
        return f"ended in phase {state.phase.word}"
    words = f"{state.failed_in.word}: {FAILURE_WORDS[state.failure]}"
    grip = built.gripper.status(built.gripper.GetMyContextFromRoot(context))
    if state.failure is Failure.NOT_GRASPED:
        words += f"; {reach_words(built, grip)}"
    elif state.failure is Failure.DROPPED:
        strength = built.gripper.law.strength
        words += f"; largest force {grip[4]:.3g} N, gripper.strength {strength:g} N"
    return words


def reach_words(built: PickAndPlace, grip: Array) -> str:
    """How far the box was from the gripper when that closed, and how far it may be."""
    law = built.gripper.law
    found = f"{1e3 * grip[1]:.2f} mm along, {1e3 * grip[2]:.2f} mm across, "
    found += f"{np.degrees(grip[3]):.2f} deg"
    accepted = f"{1e3 * law.reach:g} mm, {1e3 * law.sideways:g} mm, {np.degrees(law.tilt):g} deg"
    return f"found {found}; accepted: at most {accepted}"


def unfinished_pick_and_place(scenario: PickAndPlaceScenario, log: Log) -> PickAndPlaceRun:
    """A run whose program ended before it did, from its scenario and what it had logged."""
    return PickAndPlaceRun(built=build_pick_and_place(scenario), state=None, **left_unfinished(log))

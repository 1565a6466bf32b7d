"""Compiles at once what the first simulation, the first tension query and others would wait for."""

from __future__ import annotations

import gc
from collections.abc import Callable, Sequence
from functools import partial

from cdpr_drake.kernel_cache import compile_needed, group_names

LISTED = "the default simulation, as listed"
"""A step that begins at the other end."""

PIECE = 0.05
"""Simulated time of a scenario [s]: at least one image and one control step of each."""


def compilation_steps() -> list[tuple[str, Callable[[], None]]]:
    """What to call, one after the other, and what each compiles: a name for progress.

    Every scenario that ships is simulated for a moment, the default one by both engines; and every
    method distributes tensions once. What is compiled already, or by an earlier step, is not again.
    """
    from cdpr_drake.systems.scenarios import (
        PICK_AND_PLACE,
        TENSION_CONTROL,
        VISUAL_SERVO,
        scenario_names,
    )

    servos = sorted(scenario_names(VISUAL_SERVO), key=lambda name: name != "acrobot_pbvs")
    projected, compiled = "camera.kind=projected", "integration.engine=compiled"
    steps: list[tuple[str, Callable[[], None]]] = [("tension methods", _distribute)]
    for name in servos:
        steps.append((name, partial(_simulate, name, (projected,))))
        if name == "acrobot_pbvs":
            more = (projected, compiled)
            steps.append((f"{name}, compiled engine", partial(_simulate, name, more)))
    steps += [(name, partial(_simulate, name, ())) for name in scenario_names(TENSION_CONTROL)]
    steps += [
        (name, partial(_simulate, name, (projected,))) for name in scenario_names(PICK_AND_PLACE)
    ]
    return steps


def compile_step(name: str) -> None:
    """Does the step of a name; several processes may do different ones, and share the work.

    The first of all, `LISTED`, compiles what the default simulation needs from the last kernel to
    the first, where other steps come last.
    """
    paused = gc.isenabled()
    gc.disable()  # the compiler makes many objects and little garbage
    try:
        if name == LISTED:
            compile_needed(group_names())
        else:
            dict(compilation_steps())[name]()
    finally:
        if paused:
            gc.enable()


def _distribute() -> None:
    from cdpr_drake.analyses.queries import solve_all
    from cdpr_drake.models import load_robot, tension_problem

    robot = load_robot("acrobot_large")
    solve_all(tension_problem(robot, robot.home.transform()))


def _simulate(name: str, overrides: Sequence[str]) -> None:
    from cdpr_drake.analyses.runs import SCENARIO_KINDS
    from cdpr_drake.systems.diagrams import load_scenario

    scenario = load_scenario(name, [*overrides, f"duration={PIECE}"])
    SCENARIO_KINDS[scenario.kind].run(scenario)

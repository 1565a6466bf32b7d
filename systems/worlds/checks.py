"""What cannot be in a section `world`."""

from __future__ import annotations

from collections.abc import Iterator

from pydrake.math import RigidTransform

from cdpr_drake.errors import WorldError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import Refusal, told
from cdpr_drake.systems.worlds.clearances import WorldClearances
from cdpr_drake.systems.worlds.settings import WorldSettings
from cdpr_drake.systems.worlds.world import make_world


def world_refusals(
    settings: WorldSettings | None,
    robot: Robot,
    X_WP: RigidTransform,
    *,
    compiled: bool,
    stop: bool,
) -> Iterator[Refusal]:
    """What is wrong with a world round a robot, beside what its obstacles refuse.

    Args:
        settings: The section, whose files have been found; None: there is none.
        robot: The robot.
        X_WP: Where its platform starts [m].
        compiled: Whether the compiled engine is asked for.
        stop: Whether the first touch shall end the run.
    """
    if settings is None:
        if stop:
            yield "stop.contact", "true without a world", "false"
        return
    if settings.contact is not None and compiled:
        found = "compiled, which knows no contact, with world.contact"
        yield "integration.engine", found, "plant or automatic, or world.contact null"
    try:
        world = make_world(settings, robot)
    except WorldError as problem:
        yield told(problem, "world")
        return
    if settings.contact is None:
        return
    gaps = WorldClearances(robot, world, robot.cable_set().without_pulleys()).platform(X_WP, 0.0)
    for name, gap in zip(world.names(), gaps, strict=True):
        if gap < -settings.contact.penetration:
            most = f"{1e3 * settings.contact.penetration:g} mm"
            found = f"a platform that starts {-1e3 * gap:.3g} mm deep in {name}"
            yield "world", found, f"at most world.contact.penetration, {most}"

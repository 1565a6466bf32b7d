"""Rails of exit points: files, robots that are put on them, and their coordinates."""

from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import Annotated

import numpy as np

from cdpr_drake.errors import DataFileError, PlanningError
from cdpr_drake.models.cable_schema import Rail
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.reconfiguration import Rails
from cdpr_drake.schema.declarations import In, Text, filled, settings
from cdpr_drake.schema.typed_yaml import closest, load_typed
from cdpr_drake.summaries import numbers


@settings
class RailSettings:
    """A straight rail; exit points of several cables on it move together."""

    cables: Annotated[list[Text], "Cables that leave from it."] = filled(list)
    axis: Annotated[
        np.ndarray, In("-", 3), "Direction in W in which the coordinate grows; of any length."
    ]
    lower: Annotated[
        float, In("m"), "Smallest coordinate, counted from where the robot has its points."
    ]
    upper: Annotated[float, In("m"), "Largest coordinate."]


@settings
class RailFile:
    """Rails that a robot file does not have."""

    rails: Annotated[list[RailSettings], "The rails."]


def load_rails(path: Path) -> list[RailSettings]:
    """Reads rails; keys as `RailFile`.

    Raises:
        DataFileError: The file cannot be read, or a value is not accepted.
    """
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file of rails")
    return load_typed(RailFile, path).rails


def put_rails(robot: Robot, rails: Sequence[RailSettings], source: str = "rails") -> Robot:
    """A robot with these rails in the place of its own, its points where they are.

    Raises:
        PlanningError: A cable is unknown, on two rails, or a rail has no direction or length.
    """
    result, names = deepcopy(robot), [cable.name for cable in robot.cables]
    taken: set[str] = set()
    for k, rail in enumerate(rails):
        where = f"{source}: rails[{k}]"
        if not np.any(rail.axis) or not rail.lower < rail.upper:
            raise PlanningError(
                f"{where}: found axis ({numbers(rail.axis)}), {rail.lower:g} to {rail.upper:g} m; "
                "accepted: an axis that is not zero, lower < upper"
            )
        if not rail.cables:
            raise PlanningError(f"{where}.cables: found none; accepted: names of cables")
        for name in rail.cables:
            if name not in names:
                raise PlanningError(f"{where}.cables: {name!r} is unknown; {closest(name, names)}")
            if name in taken:
                raise PlanningError(f"{where}.cables: found {name} again; accepted: once")
            taken.add(name)
            cable = result.cables[names.index(name)]
            cable.exit_point = robot.cable_set().p_WA[:, names.index(name)]
            cable.rail = Rail(axis=np.array(rail.axis), lower=rail.lower, upper=rail.upper)
    return result


def rails_of(robot: Robot, groups: Sequence[Sequence[str]] = ()) -> tuple[Rails, list[str]]:
    """Rails of a robot's file, and names of their coordinates.

    Args:
        robot: The robot.
        groups: Names of cables that move together; all others that have rails move alone.

    Raises:
        PlanningError: It has none.
    """
    on_rails = {
        cable.name: (k, cable.rail)
        for k, cable in enumerate(robot.cables)
        if cable.rail is not None
    }
    if not on_rails:
        raise PlanningError(
            f"robot {robot.name}: found no cables[].rail; accepted: those of its file, or with "
            "rails"
        )
    grouped = {name for group in groups for name in group}
    together = [*groups, *([name] for name in on_rails if name not in grouped)]
    rows: list[tuple[float, float, float]] = []
    directions = np.zeros((len(together), 3, len(robot.cables)))
    for direction, group in zip(directions, together, strict=True):
        for name in group:
            k, rail = on_rails[name]
            direction[:, k] = rail.axis / np.linalg.norm(rail.axis)
        rows.append((rail.lower, rail.upper, rail.at))
    lower, upper, at = np.array(rows).T
    bases = np.array([cable.exit_point for cable in robot.cables], float).T
    return Rails(directions, lower, upper, at, bases), [",".join(group) for group in together]

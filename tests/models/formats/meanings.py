"""What the fields of a robot file mean, for comparing robots that say the same in other words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, fields, is_dataclass
from typing import Any

import numpy as np

from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_schema import Robot

SAME = 1e-12
"""Of numbers that go through a file and a few rotations, relative to the largest of a field."""


def schema_keys(section: Any, prefix: str = "") -> list[str]:
    """Keys of all fields that have none of their own, `cables[].name` for those of items."""
    found: list[str] = []
    for field in fields(section):
        key, value = f"{prefix}{field.name}", getattr(section, field.name)
        items = value if isinstance(value, list) else [value]
        if items and is_dataclass(items[0]):
            mark = "[]." if isinstance(value, list) else "."
            found += [name for item in items for name in schema_keys(item, key + mark)]
        else:
            found.append(key)
    return list(dict.fromkeys(found))


def values_of(section: Any, key: str) -> list[Any]:
    """What stands under a key, one value for each item on the way; None where a section is not."""
    name, _, rest = key.partition(".")
    value = getattr(section, name.removesuffix("[]"), None)
    items = value if name.endswith("[]") and value is not None else [value]
    return [found for item in items for found in (values_of(item, rest) if rest else [item])]


def _inertia(robot: Robot) -> Any:
    com = robot.center_of_mass()
    return platform_inertia(robot).Shift(com).CalcRotationalInertia().CopyToFullMatrix3()


def _directions(robot: Robot, home: Robot) -> Any:
    """What motions there are, whatever names them: a projector on twists at a home pose."""
    basis = robot.motion_type().basis(home.home.transform().rotation().matrix())
    return basis @ basis.T


_WHOLE: dict[str, Callable[[Robot], Any]] = {
    "gravity_direction": lambda robot: robot.down(),
    "platform.box_center": lambda robot: robot.box_center(),
    "platform.center_of_mass": lambda robot: robot.center_of_mass(),
    "platform.inertia": _inertia,
    "platform.inertia_of": _inertia,
    "home.angles_deg": lambda robot: robot.home.transform().rotation().matrix(),
    "pulley.arm": lambda robot: robot.pulley.arm,
    "frame.beam": lambda robot: robot.frame.beam_width(),
    "cables[].exit_point": lambda robot: robot.exit_points().T,
}


def _own(robot: Robot, key: str, each: Sequence[Any], mine: Callable[[Any], Any]) -> list[Any]:
    """Of values of all cables those that the cables give themselves, or those that they do not."""
    own = key.startswith("cables[]")
    return [
        value
        for cable, value in zip(robot.cables, each, strict=True)
        if (mine(cable) is not None) is own
    ]


def meaning(key: str, robot: Robot, of: Robot) -> Any:
    """What a field of `of` means in a robot with as many cables.

    A common value and one of a cable's own mean those of the cables that have it in `of`.
    """
    if key in _WHOLE:
        return _WHOLE[key](robot)
    if key in ("motion", "axis"):
        return _directions(robot, of)
    if len(robot.cables) != len(of.cables):
        return len(robot.cables)
    last = key.rpartition(".")[2]
    if key.startswith("pulley.") or key in ("cables[].pulley_radius", "cables[].swivel_axis"):
        name = last if last == "swivel_axis" else "pulley_radius"
        each = np.atleast_2d(getattr(robot.cable_set(), name)).T
        return _own(of, key, list(each), lambda cable: getattr(cable, name))
    if key.startswith(("platform_pulley", "cables[].anchor_pulley", "cables[].anchor_swivel")):
        name = "anchor_swivel_axis" if last.endswith("swivel_axis") else "anchor_pulley_radius"
        each = np.atleast_2d(getattr(robot.cable_set(), name)).T
        return _own(of, key, list(each), lambda cable: getattr(cable, name))
    if key.startswith("cable.behaviour"):
        laws = robot.cable_behaviour()
        return [getattr(laws, name) for name in ([last] if last != "behaviour" else asdict(laws))]
    if key.startswith(("cable.", "cables[].material.")):
        each = [asdict(material)[last] for material in robot.materials()]
        return _own(of, key, each, lambda cable: getattr(cable.material, last, None))
    return values_of(robot, key)


def same(one: Any, other: Any) -> bool:
    """Whether two meanings are the same, numbers to rounding."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(same, one, other))
    if is_dataclass(one):
        return True  # whose fields are compared one by one
    if one is None or other is None or isinstance(one, str) or is_dataclass(other):
        return one is other or (isinstance(one, str) and one == other)
    a, b = np.asarray(one, float), np.asarray(other, float)
    scale = float(np.max(np.abs(a), initial=0.0)) or 1.0
    return a.shape == b.shape and bool(np.allclose(a, b, rtol=0.0, atol=SAME * scale))


def fields_that_differ(before: Robot, after: Robot) -> set[str]:
    """Keys of the schema of which two robots do not mean the same.

    A cable without a section `material` says nothing by that: the key `cable` does.
    """
    return {
        key
        for key in schema_keys(before)
        if key != "cables[].material"
        and not same(meaning(key, before, before), meaning(key, after, before))
    }

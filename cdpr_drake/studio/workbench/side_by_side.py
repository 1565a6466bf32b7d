"""Two robots in numbers: what each has, and by how much they differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import settings_of
from cdpr_drake.studio.pose_answer import PoseAnswer, RobotQuestions

Value = float | str | None

AXES = "xyz"


@dataclass(frozen=True)
class Pair:
    """One number or word of both.

    Attributes:
        name: What it is, with its unit.
        one: Of the first; None: it has none.
        other: Of the second.
    """

    name: str
    one: Value
    other: Value

    @property
    def difference(self) -> float | None:
        """The second minus the first; None where they are no numbers."""
        if isinstance(self.one, float) and isinstance(self.other, float):
            return self.other - self.one
        return None

    @property
    def differs(self) -> bool:
        """Whether they are not the same."""
        return self.one != self.other


def robots_side_by_side(one: Robot, other: Robot) -> list[Pair]:
    """Fields of their files in which two robots differ, then what is known at their home poses."""
    fields = _pairs(dict(_fields(Robot, one, "")), dict(_fields(Robot, other, "")))
    home = _pairs(_at_home(one), _at_home(other))
    return [*(pair for pair in fields if pair.differs), *home]


def _pairs(one: Mapping[str, Value], other: Mapping[str, Value]) -> list[Pair]:
    names = [*one, *(name for name in other if name not in one)]
    return [Pair(name, one.get(name), other.get(name)) for name in names]


def _fields(schema: type, value: Any, before: str) -> Iterator[tuple[str, Value]]:
    """Fields of a typed document, with units and axes."""
    for name, rule in settings_of(schema).items():
        inner = getattr(value, name)
        words = f"{before} {name.replace('_', ' ')}".strip()
        unit = f" [{rule.unit}]" if rule.unit not in ("", "-") else ""
        if inner is None:
            continue
        if rule.kind == "section":
            yield from _fields(rule.section, inner, words)
        elif rule.kind == "sections":
            for k, item in enumerate(inner):
                yield from _fields(rule.section, item, f"{words} {k + 1}")
        elif rule.kind == "array":
            flat = np.ravel(inner)
            axes = AXES if np.shape(inner) == (3,) else [str(k + 1) for k in range(len(flat))]
            for axis, number in zip(axes, flat, strict=True):
                yield f"{words} {axis}{unit}", float(number)
        elif isinstance(inner, int | float) and not isinstance(inner, bool):
            yield f"{words}{unit}", float(inner)
        else:
            yield f"{words}{unit}", str(inner)


def _at_home(robot: Robot) -> dict[str, Value]:
    answer: PoseAnswer = RobotQuestions(robot).at(robot.home.transform())
    found: dict[str, Value] = {}
    known = answer.tensions[np.isfinite(answer.tensions)]
    if len(known):
        found["at home: least tension [N]"] = float(known.min())
        found["at home: largest tension [N]"] = float(known.max())
    if answer.rest is not None:
        found[f"at home: least stiffness [N/m], turns times {answer.rest.arm:.3g} m"] = float(
            np.min(answer.rest.principal)
        )
        if answer.rest.frequencies is not None:
            found["at home: lowest frequency [Hz]"] = float(np.min(answer.rest.frequencies))
    found["at home: capacity margin [N]"] = answer.capacity_margin
    found["at home: clearance [m]"] = answer.clearance
    return {name: value for name, value in found.items() if value is not None}

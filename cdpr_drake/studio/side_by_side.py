"""Two robots or runs in numbers: what each has, and by how much they differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import settings_of
from cdpr_drake.studio.pose_answer import PoseAnswer, RobotQuestions

Value = float | str | None


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


def pairs(one: Mapping[str, Value], other: Mapping[str, Value]) -> list[Pair]:
    """Pairs of what two have by name, in the order of the first; not what both have not."""
    both = [Pair(name, one.get(name), other.get(name)) for name in {**one, **other}]
    return [pair for pair in both if (pair.one, pair.other) != (None, None)]


def robots_side_by_side(one: Robot, other: Robot) -> list[Pair]:
    """Fields of their files in which two robots differ, then what is known at their home poses."""
    fields = pairs(dict(_fields(one, "")), dict(_fields(other, "")))
    home = pairs(dict(_at_home(one)), dict(_at_home(other)))
    return [*(pair for pair in fields if pair.one != pair.other), *home]


def _fields(settings: Any, before: str) -> Iterator[tuple[str, Value]]:
    """Numbers and words of settings, with units and axes."""
    for name, rule in settings_of(type(settings)).items():
        value = getattr(settings, name)
        words = f"{before} {name.replace('_', ' ')}".strip()
        unit = f" [{rule.unit}]" if rule.unit not in ("", "-") else ""
        if value is None:
            continue
        if rule.kind == "section":
            yield from _fields(value, words)
        elif rule.kind == "sections":
            for k, item in enumerate(value):
                yield from _fields(item, f"{words} {k + 1}")
        elif rule.kind == "array":
            axes = "xyz" if rule.shape == (3,) else map(str, range(1, len(value) + 1))
            for axis, number in zip(axes, value, strict=True):
                yield f"{words} {axis}{unit}", float(number)
        else:
            yield f"{words}{unit}", float(value) if rule.kind in ("number", "whole") else str(value)


def _at_home(robot: Robot) -> Iterator[tuple[str, Value]]:
    answer = PoseAnswer(RobotQuestions(robot), robot.home.transform())
    tensions = answer.tensions[np.isfinite(answer.tensions)]
    if len(tensions):
        yield "at home: least tension [N]", float(tensions.min())
        yield "at home: largest tension [N]", float(tensions.max())
    if answer.rest is not None:
        name = f"at home: least stiffness [N/m], turns times {answer.rest.arm:.3g} m"
        yield name, float(np.min(answer.rest.principal))
        if answer.rest.frequencies is not None:
            yield "at home: lowest frequency [Hz]", float(np.min(answer.rest.frequencies))
    yield "at home: capacity margin [N]", answer.capacity_margin
    yield "at home: clearance [m]", answer.clearance

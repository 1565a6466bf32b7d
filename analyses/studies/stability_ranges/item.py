"""Questions of the study of stability ranges, and their answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass
from functools import partial
from typing import Any

import numpy as np

from cdpr_drake.analyses.workspaces.pose_grid import plain

PLANAR_VISION = "3.2.1, planar: analyses I and II"
PLANAR_ROBOT = "3.2.1, planar: analysis III"
SPATIAL_VISION = "3.2.2, spatial: analysis I"
SPATIAL_CAMERA = "3.2.2, spatial: analysis II"
SPATIAL_ROBOT = "3.2.2, spatial: analysis III"
SINGLE = "3.4.2, one wrong parameter"
SECTIONS = (
    PLANAR_VISION, PLANAR_ROBOT, SPATIAL_VISION, SPATIAL_CAMERA, SPATIAL_ROBOT, SINGLE,
)  # fmt: skip
"""Sections of the servoing thesis."""

FOUND = "found"
"""Name of the answer of a question with one answer only."""


@dataclass(frozen=True, kw_only=True)
class RangeRow:
    """A question with its answers.

    Attributes:
        name: Name, unique in the study.
        section: One of `SECTIONS`.
        group: Questions that differ in one limit share it.
        limits: What is given, in the units of its names.
        sought: Name of what is sought.
        unit: Unit of all answers.
        published: What the thesis says; None: nothing.
        answers: What was found, by name.
    """

    name: str
    section: str
    group: str
    limits: dict[str, float]
    sought: str
    unit: str
    published: float | None
    answers: dict[str, float]

    @property
    def found(self) -> float:
        """The answer that counts: the searched one where there are several."""
        for name in (FOUND, "searched", "sampled"):
            if name in self.answers:
                return self.answers[name]
        return next(iter(self.answers.values()))


@dataclass(frozen=True)
class RangeItem:
    """A question; attributes as `RangeRow`. It is a task of a sweep, of one item.

    Attributes:
        compute: Answers it; a function of a module with its arguments, so that it pickles.
    """

    name: str
    section: str
    group: str
    limits: Mapping[str, float]
    sought: str
    unit: str
    _: KW_ONLY
    compute: partial[dict[str, float]]
    published: float | None = None

    def __call__(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """The answers as a sweep keeps them, shape (1,) each."""
        return {name: np.array([value]) for name, value in self.compute().items()}

    def arguments(self) -> dict[str, Any]:
        """All that the answers depend on, for JSON."""
        return {"question": self.compute.func.__name__, "arguments": plain(self.compute.args)}

    def row(self, answers: Mapping[str, np.ndarray]) -> RangeRow:
        """The question with answers, as a sweep kept them."""
        return RangeRow(
            name=self.name, section=self.section, group=self.group, limits=dict(self.limits),
            sought=self.sought, unit=self.unit, published=self.published,
            answers={name: float(value[0]) for name, value in answers.items()},
        )  # fmt: skip


def bisected(stable: Callable[[float], bool], high: float, step: float) -> float:
    """The largest multiple of step up to high at which `stable` holds, by bisection; 0 if none."""
    low, top = 0, round(high / step)
    if stable(top * step):
        return top * step
    while top - low > 1:
        middle = (low + top) // 2
        low, top = (middle, top) if stable(middle * step) else (low, middle)
    return low * step

"""What the plots of a run show: charts with their series, and rows of numbers for them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cdpr_drake.palette import ANGLE, DASHED, DISTANCE, Dash, Look, nth_look

DASHES: dict[str, tuple[float, ...]] = {"-": (), "--": (6.0, 3.0), "-.": (8.0, 3.0, 2.0, 3.0),
                                        ":": (2.0, 3.0)}  # fmt: skip
"""Dashes of the palette's names [px]."""

ROTATION = Look(ANGLE.color, DASHED)
"""Dashed, as both errors often are the same curve, each in its unit."""


@dataclass(frozen=True)
class Chart:
    """One plot over time.

    Attributes:
        title: What it shows, with its unit.
        series: Names of its curves, with their looks.
        limits: Bounds to draw, in the unit of the curves.
        right: Title of a second axis, to which the last curve belongs; empty: there is none.
    """

    title: str
    series: tuple[tuple[str, Look], ...]
    limits: tuple[float, ...] = ()
    right: str = ""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "title": self.title,
            "right": self.right,
            "limits": list(self.limits),
            "series": [
                {"name": name, "color": look.color, "dash": list(_dash(look.dash))}
                for name, look in self.series
            ],
        }


def charts_of(cables: Sequence[str], limits: Sequence[float]) -> tuple[Chart, ...]:
    """The charts of a run; each cable has the look that it has everywhere.

    Args:
        cables: Names of the cables.
        limits: Smallest and largest tension [N].
    """
    low, high = limits
    each = tuple((name, nth_look(number)) for number, name in enumerate(cables))
    return (
        Chart(
            "position error [mm]", (("position", DISTANCE), ("rotation", ROTATION)),
            right="rotation error [deg]",
        ),
        Chart(f"tension [N], limits {low:g} and {high:g} N", each, (low, high)),
        Chart("cable length [m]", each),
    )  # fmt: skip


def plot_row(sample: Mapping[str, Any]) -> list[float | None]:
    """A row for the charts: time, then the curves of one chart after the other; None: not known."""
    distance, angle = sample["position_error"], sample["rotation_error"]
    return [
        sample["t"],
        None if distance is None else 1e3 * distance,
        None if angle is None else math.degrees(angle),
        *sample["tensions"],
        *sample["lengths"],
    ]


def _dash(dash: Dash) -> tuple[float, ...]:
    return DASHES.get(dash, ()) if isinstance(dash, str) else dash[1]

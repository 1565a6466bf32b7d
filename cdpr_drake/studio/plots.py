"""Plots over time in the page, which move while a run goes on: charts, rows, and their element."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import monotonic
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from cdpr_drake.palette import ANGLE, DASHED, DISTANCE, Look, nth_look

Row = list[float | None]
"""Time, then the curves of one chart after the other; None where there is no value."""

LONGEST_SILENCE = 5.0
"""Time after which a browser that does not answer gets rows again [s]."""

FIRST_LAG, FADES = 0.1, 0.8
"""Assumed time that a browser needs before its first answer [s], and the factor by which a long one
fades at each answer."""


@dataclass(frozen=True)
class Chart:
    """One plot over time, as the browser gets it.

    Attributes:
        title: What it shows, with its unit.
        series: Names of its curves, with their looks, whose dashes are names.
        limits: Bounds to draw, in the unit of the curves.
        right: Title of a second axis, to which the last curve belongs; empty: there is none.
    """

    title: str
    series: tuple[tuple[str, Look], ...]
    limits: tuple[float, ...] = ()
    right: str = ""


def charts_of(cables: Sequence[str], limits: Sequence[float]) -> tuple[Chart, ...]:
    """The charts of a run; each cable has the look that it has everywhere.

    Args:
        cables: Names of the cables.
        limits: Smallest and largest tension [N].
    """
    low, high = limits
    each = tuple((name, nth_look(number)) for number, name in enumerate(cables))
    # Dashed, as both errors often are the same curve, each in its unit.
    errors = (("position", DISTANCE), ("rotation", Look(ANGLE.color, DASHED)))
    return (
        Chart("position error [mm]", errors, right="rotation error [deg]"),
        Chart(f"tension [N], limits {low:g} and {high:g} N", each, (low, high)),
        Chart("cable length [m]", each),
    )


def plot_row(sample: Mapping[str, Any]) -> Row:
    """The row of a sample for the charts of a run."""
    distance, angle = sample["position_error"], sample["rotation_error"]
    errors = (None if distance is None else 1e3 * distance,
              None if angle is None else math.degrees(angle))  # fmt: skip
    return [sample["t"], *errors, *sample["tensions"], *sample["lengths"]]


class MovingPlots(ui.element, component="plots.js"):
    """Charts over time. A browser gets new rows when it has drawn the rows before.

    So a slow browser, or a page in the background, delays nothing and piles nothing up. The
    component also has `compare(rows, name)`, `show_span(seconds)` and `cursor(time)`, to be called
    by `run_method`; None ends each of them.

    Attributes:
        newest: Time of the newest row that a browser has [s]; -inf: it has none.
    """

    def __init__(self, mounted: Callable[[], None]) -> None:
        """Without charts; `mounted` is called whenever a browser shows it anew, empty."""
        super().__init__()
        self.newest = -math.inf
        self._sent: float | None = None  # when rows were sent that are not drawn yet
        self._lag = FIRST_LAG
        self.on("drawn", self._drawn)
        self.on("mounted", lambda _: mounted())

    def begin(self, charts: Sequence[Chart], duration: float, rows: Sequence[Row]) -> None:
        """Shows other charts, with rows that are there already, of a run that lasts so long [s]."""
        self.newest = -math.inf
        self.run_method("begin", charts, duration)
        self.put(rows)

    def put(self, rows: Sequence[Row]) -> None:
        """Adds rows; to be called when the browser is ready for them."""
        self._sent = monotonic()
        self.run_method("put", rows, self._sent)
        if rows:
            self.newest = rows[-1][0] or 0.0

    @property
    def is_ready(self) -> bool:
        """True if the browser has drawn all that it was sent, or has been silent for long."""
        return self._sent is None or monotonic() - self._sent > LONGEST_SILENCE

    @property
    def lag(self) -> float:
        """Longest recent time from sending rows to the answer that they are drawn [s]."""
        return max(self._lag, 0.0 if self._sent is None else monotonic() - self._sent)

    def _drawn(self, event: GenericEventArguments) -> None:
        if self._sent is not None and event.args == self._sent:
            self._lag = max(monotonic() - self._sent, FADES * self._lag)
            self._sent = None

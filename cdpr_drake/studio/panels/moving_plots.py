"""Plots of a run that move, as an element of the page."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from time import monotonic
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from cdpr_drake.studio.workbench.plot_rows import Chart

Row = list[float | None]

MOST_WAITING = 3000
"""Rows that wait for a browser; one that is slower gets all rows of the run anew."""

LONGEST_SILENCE = 5.0
"""Time after which a browser that says nothing is given rows again [s]."""

FIRST_LAG, FADES = 0.1, 0.8
"""Time that a browser is thought to need before it has answered [s], and how fast a long one is
forgotten, at each answer."""


class MovingPlots(ui.element, component="moving_plots.js"):
    """Charts over time. A browser gets new rows when it has drawn the ones before.

    So a slow one, or a page in the background, holds up nothing and piles nothing up.
    """

    def __init__(self, mounted: Callable[[], None]) -> None:
        """Without charts; `mounted` is called whenever a browser shows it anew, empty."""
        super().__init__()
        self._waiting: list[Row] = []
        self._tokens = itertools.count(1)
        self._asked: int | None = None
        self._asked_at = 0.0
        self._replace = False
        self._lag = FIRST_LAG
        self.on("drawn", self._drawn)
        self.on("mounted", lambda _: mounted())

    def begin(self, charts: Sequence[Chart], duration: float, rows: Sequence[Row]) -> None:
        """Shows other charts, with rows that are there already.

        Args:
            charts: The charts.
            duration: Longest time of the run [s].
            rows: Time and the curves of one chart after the other.
        """
        self.run_method("begin", [chart.plain() for chart in charts], duration)
        self.replace(rows)

    def replace(self, rows: Sequence[Row]) -> None:
        """Shows these rows in the place of all others."""
        self._waiting, self._replace, self._asked = list(rows), True, None
        self.flush()

    def append(self, rows: Sequence[Row]) -> bool:
        """Adds rows; returns False if so many wait that all are better shown anew."""
        self._waiting += rows
        if len(self._waiting) > MOST_WAITING:
            self._waiting = []
            return False
        self.flush()
        return True

    def flush(self) -> None:
        """Sends what waits, if the browser is ready."""
        late = monotonic() - self._asked_at > LONGEST_SILENCE
        if not (self._waiting or self._replace) or (self._asked is not None and not late):
            return
        self._asked, self._asked_at = next(self._tokens), monotonic()
        self.run_method("put", self._waiting, self._asked, self._replace)
        self._waiting, self._replace = [], False

    @property
    def is_ready(self) -> bool:
        """Whether the browser has drawn all that it was sent."""
        return self._asked is None

    @property
    def lag(self) -> float:
        """Longest time of late from sending rows to the answer that they are drawn [s]."""
        waits = 0.0 if self._asked is None else monotonic() - self._asked_at
        return max(self._lag, waits)

    def compare(self, rows: Sequence[Row], name: str) -> None:
        """Shows rows of another run behind; none: that ends."""
        self.run_method("compare", list(rows), name)

    def show_span(self, seconds: float | None) -> None:
        """Shows the last seconds only; None: all."""
        self.run_method("show_span", seconds)

    def cursor(self, time: float | None) -> None:
        """Marks a time [s]; None: that ends."""
        self.run_method("cursor", time)

    def _drawn(self, event: GenericEventArguments) -> None:
        args: Any = event.args
        if isinstance(args, dict) and args.get("token") == self._asked:
            self._asked = None
            self._lag = max(monotonic() - self._asked_at, FADES * self._lag)
            self.flush()

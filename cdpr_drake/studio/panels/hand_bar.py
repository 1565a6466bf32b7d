"""Buttons that break a cable of a run, or push its platform, while it runs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from nicegui import ui

from cdpr_drake.analyses.runs.steering import BREAK, PUSH
from cdpr_drake.studio.jobs import JobState
from cdpr_drake.studio.panel import notify, show_errors
from cdpr_drake.studio.run_job import RunJob

DIRECTIONS = {
    f"{sign}{axis}": tuple(float(value) for value in factor * np.eye(3)[k])
    for k, axis in enumerate("xyz")
    for sign, factor in (("+", 1.0), ("-", -1.0))
}
"""Directions of a push in W."""

USUAL_FORCE, USUAL_TIME = 5.0, 0.3
"""Of a push [N], [s]."""


class HandBar:
    """What can be done by hand to the run that is looked at, and what was done."""

    def __init__(self, current: Callable[[], RunJob | None]) -> None:
        """Places it into the current slot.

        Args:
            current: The job that is looked at; None: there is none.
        """
        self._current = current
        self._of: RunJob | None = None
        self._told = -1
        self._names: list[str] = []
        with ui.element("div").classes("cdpr-hands w-full") as self._box:
            with ui.row().classes("w-full items-center"):
                self._cable = ui.select({}, label="cable")
                self._cable.props("dense outlined").mark("hand-cable")
                self._break = ui.button("Break", icon="content_cut", on_click=self._breaks)
                self._break.props('no-caps outline title="The cable pulls nothing from now on"')
                self._break.mark("break")
                self._direction = ui.select(list(DIRECTIONS), value="+x", label="direction in W")
                self._direction.props("dense outlined").classes("w-32").mark("push-direction")
                self._force = ui.number("force", value=USUAL_FORCE, min=0.0)
                self._force.props('dense outlined suffix="N"').classes("w-24").mark("push-force")
                self._time = ui.number("for", value=USUAL_TIME, min=0.0, step=0.1)
                self._time.props('dense outlined suffix="s"').classes("w-24").mark("push-time")
                self._push = ui.button("Push", icon="touch_app", on_click=self._pushes)
                self._push.props('no-caps outline title="A half sine with that peak, at Po"')
                self._push.mark("push")
            self._done = ui.label().classes("cdpr-soft").props('role="status"').mark("hand-done")
        self.refresh()

    def _breaks(self) -> None:
        job = self._current()
        with show_errors():
            if job is not None and self._cable.value is not None:
                job.break_cable(int(self._cable.value))

    def _pushes(self) -> None:
        job = self._current()
        with show_errors():
            if job is not None:
                size = float(self._force.value or 0.0)
                direction = DIRECTIONS[str(self._direction.value)]
                job.push([size * part for part in direction], float(self._time.value or 0.0))

    def refresh(self) -> None:
        """Offers what the run takes now, and says what was done."""
        job = self._current()
        takes = () if job is None else tuple(job.header.get("takes", ()))
        events = [] if job is None else list(job.events)
        self._box.set_visibility(bool(takes) or bool(events))
        if job is None:
            self._of = None
            return
        names = list(job.header.get("cables", ()))  # the header may come after the job
        if job is not self._of or len(events) != self._told or names != self._names:
            self._show(job, events, names)
        working = job.state in (JobState.RUNNING, JobState.PAUSED)
        self._break.set_enabled(working and BREAK in takes and self._cable.value is not None)
        self._push.set_enabled(working and PUSH in takes)

    def _show(self, job: RunJob, events: list[dict[str, object]], names: list[str]) -> None:
        before = self._told if job is self._of else len(events)
        self._of, self._told, self._names = job, len(events), names
        broken = {event.get("cable") for event in events}
        left = {k: name for k, name in enumerate(names) if k not in broken}
        kept = self._cable.value if self._cable.value in left else next(iter(left), None)
        self._cable.set_options(left, value=kept)
        done = [f"{event['t']:.2f} s: {event['words']}" for event in events if "words" in event]
        self._done.text = "; ".join(done)
        for event in events[before:]:
            if "refused" in event:
                notify(str(event["refused"]))

"""One run in the page, live or finished alike: state, picture, plots, scene, steering, results."""

from __future__ import annotations

import base64
import math
import os
from bisect import bisect_right
from collections.abc import Callable, Mapping
from contextlib import suppress
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import run, ui

from cdpr_drake.analyses.runs.steering import BREAK, PUSH
from cdpr_drake.studio.jobs import JobState
from cdpr_drake.studio.numbers import Pair, pair_table, pairs
from cdpr_drake.studio.plots import MovingPlots, plot_row
from cdpr_drake.studio.runs import NO_RUN, FinishedRun, RunBoard, RunEntry, RunJob, Sample, read_run
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.views import leaves, show_results

SCENE_SHARE, RAREST_SCENE = 3.0, 2.0
"""The scene is drawn when the browser has drawn its plots, at most once in so many times what it
needs for that, and at least once in so long [s]: one thread of the browser draws both, and without
a graphics card the scene takes most of its time."""

SPEEDS: dict[str, float | None] = {
    "x 0.1": 0.1, "x 0.5": 0.5, "real time": 1.0, "x 2": 2.0, "x 5": 5.0, "x 20": 20.0,
    "as fast as possible": None,
}  # fmt: skip
"""Speeds that are offered, as factors of real time."""

WORKING = (JobState.QUEUED, JobState.RUNNING, JobState.PAUSED)

STEERING: dict[str, tuple[str, Callable[[RunJob], None], Callable[[RunJob], bool]]] = {
    "Pause": ("pause", lambda job: job.tell("pause"), lambda job: not job.pace["paused"]),
    "Go on": ("play_arrow", lambda job: job.tell("go"), lambda job: job.pace["paused"]),
    "Step": (
        "skip_next", lambda job: job.tell("step"), lambda job: job.state == JobState.PAUSED
    ),
    "Stop": ("stop", RunJob.stop, lambda job: True),
}  # fmt: skip
"""Buttons with their icons, what they do, and if a run that works takes it now."""

DIRECTIONS = {
    f"{sign}{axis}": factor * np.eye(3)[k]
    for k, axis in enumerate("xyz") for sign, factor in (("+", 1.0), ("-", -1.0))
}  # fmt: skip
"""Directions of a push in W."""

USUAL_FORCE, USUAL_TIME = 5.0, 0.3
"""Of a push [N], [s]."""

READING = "reading the log"

OF_THE_PROGRAM = ("versions", "wall_time_s", "realtime_factor")
"""Keys of a summary that say nothing about the run."""


class RunWatch:
    """Shows one run of a board: samples while it goes on, rows of its log when it is finished.

    Attributes:
        entry: The run; None: none is shown.
        run: What is shown of it.
        other: The run behind it; None: there is none.
        files: Names of what is in its folder.
    """

    def __init__(self, bench: Workbench, board: RunBoard) -> None:
        """Of the board of a session, without elements."""
        self._bench, self._board = bench, board
        self.entry: RunEntry | None = None
        self.run: RunJob | FinishedRun = NO_RUN
        self.other: FinishedRun | None = None
        self.files: frozenset[str] = frozenset()
        self._begun = self._is_unreadable = False
        self._sample: Sample | None = None
        self._jpeg, self._time_sent = b"", -math.inf  # the newest that the browser has

    @property
    def job(self) -> RunJob:
        """The job of the run, as long as the server has it."""
        return (self.entry and self.entry.job) or NO_RUN

    def place_steering(self) -> None:
        """Places speed, pause, go, step and stop into the current slot."""

        def set_speed() -> None:
            self._board.speed = SPEEDS[str(speed.value)]
            self.job.tell("speed", factor=self._board.speed)

        names = {factor: words for words, factor in SPEEDS.items()}
        speed = ui.select([*SPEEDS], value=names[self._board.speed], label="speed")
        speed.props("dense outlined").classes("cdpr-speed").mark("speed").on_value_change(set_speed)
        for words, (icon, act, takes) in STEERING.items():
            button = self._button("", icon, act, takes)
            button.props(f'dense aria-label="{words}" title="{words}"')
            button.mark(words.lower().replace(" ", "-"))

    def _button(
        self, words: str, icon: str, act: Callable[[RunJob], None], takes: Callable[[RunJob], bool]
    ) -> ui.button:
        """A button that does something to a run that works, as long as that takes it."""
        button = ui.button(words, icon=icon, on_click=lambda: act(self.job))
        return button.bind_enabled_from(
            self, "job", lambda job: job.state in WORKING and takes(job)
        )

    def _place_hands(self) -> None:
        """Places buttons that break a cable or push the platform, and what was done so."""

        def break_cable(job: RunJob) -> None:
            job.tell(BREAK, cable=self._cable.value)

        def push(job: RunJob) -> None:
            peak = float(force.value or 0.0) * DIRECTIONS[str(direction.value)]
            job.tell(PUSH, force=peak.tolist(), seconds=float(time.value or 0.0))

        def takes(act: str) -> Callable[[RunJob], bool]:
            return lambda job: act in job.header.get("takes", ())

        with ui.element("div").classes("w-full") as box:
            with ui.row().classes("w-full items-center"):
                self._cable = ui.select({}, label="cable").mark("hand-cable")
                button = self._button("Break", "content_cut", break_cable, takes(BREAK))
                button.props('title="The cable pulls no more from now on"').mark("break")
                direction = ui.select([*DIRECTIONS], value="+x", label="direction in W")
                force = ui.number("force", value=USUAL_FORCE, min=0.0, suffix="N")
                time = ui.number("for", value=USUAL_TIME, min=0.0, step=0.1, suffix="s")
                hit = self._button("Push", "touch_app", push, takes(PUSH))
                hit.props('title="A push at Po, a half sine with this peak force"').mark("push")
            done = ui.label().classes("cdpr-soft").props('role="status"').mark("hand-done")
        for made in (button, hit):
            made.props("no-caps outline")
        for field in (self._cable, direction, force, time):
            field.props("dense outlined")
        direction.classes("w-32").mark("push-direction")
        force.classes("w-24").mark("push-force")
        time.classes("w-24").mark("push-time")
        done.bind_text_from(self, "job", _done_by_hand)
        box.bind_visibility_from(self, "job", lambda job: bool(job.header.get("takes")))

    def place(self) -> None:
        """Places the run into the current slot."""
        self._place_hands()
        with ui.element("div").classes("cdpr-run-view"):
            with ui.element("figure").classes("cdpr-camera") as figure:
                self._image = ui.element("img").props('alt="Image of the camera"').mark("camera")
            with ui.element("div").classes("cdpr-run-state"):
                self._state = ui.label().classes("cdpr-state").props('role="status"')
                self._state.mark("run-state")
                self._outcome = ui.label().classes("cdpr-outcome").mark("outcome")
                self._bar = ui.linear_progress(0.0, show_value=False)
                self._words = ui.label().classes("cdpr-soft").mark("run-words")
                self._problem = ui.label().classes("studio-problem").mark("run-problem")
                key = ui.label("Image: detected marks are orange, desired marks green.")
                key.classes("cdpr-soft")
        for element in (figure, key):
            element.bind_visibility_from(self, "_jpeg", bool)
        self._plots = MovingPlots(self._begin)
        with ui.row().classes("w-full items-center no-wrap") as scrub:
            self._time = ui.label("0.00 s").classes("cdpr-time")
            self._slider = ui.slider(min=0.0, max=1.0, step=0.001, value=0.0).classes("col")
            self._slider.props('aria-label="Time"').mark("cursor").on_value_change(self._scrub)
        scrub.bind_visibility_from(self, "run", lambda shown: isinstance(shown, FinishedRun))
        with ui.expansion("Both runs in numbers").classes("w-full studio-group") as self._both:
            self._pairs = ui.html("", sanitize=False).classes("w-full").mark("run-pairs")
        with ui.expansion("Results, figures and files") as self._fold:
            self._results = ui.element("div").classes("w-full")
        self._both.mark("both-runs")
        self._fold.classes("w-full studio-group").mark("run-results")
        self._fold.on_value_change(self._fill_results)
        self._fold.bind_visibility_from(
            self, "files", lambda files: bool(files) and self.job.state.is_over
        )

    def show(self, entry: RunEntry | None) -> None:
        """Shows another run; all of the one before is forgotten."""
        same = _identity(entry) == _identity(self.entry)
        self.entry = entry
        if not same:
            self.run, self.files, self._is_unreadable = self.job, frozenset(), False
            self._fold.value = False
            self._results.clear()
            self._begin()
        self._say()

    def show_span(self, seconds: float | None) -> None:
        """Shows the last seconds of plots only; None: all."""
        self._plots.run_method("show_span", seconds)

    def _begin(self) -> None:
        """Shows all that is there, as after a change, or in a browser that shows it anew."""
        shown, other = self.run, self.other
        self._begun = bool(shown.charts)
        self._time_sent = shown.samples[-1]["t"] if shown.samples else -math.inf
        self._plots.begin(shown.charts, shown.end, [plot_row(sample) for sample in shown.samples])
        rows = [] if other is None else [plot_row(sample) for sample in other.samples]
        self._plots.run_method("compare", rows, "" if other is None else other.folder.name)
        self._both.visible = isinstance(shown, FinishedRun) and other is not None
        if isinstance(shown, FinishedRun) and other is not None:
            pairs = run_pairs(shown.summary, other.summary)
            self._pairs.content = pair_table(pairs, shown.folder.name, other.folder.name)
        self._look()

    def tick(self) -> None:
        """Shows what is new; to be called many times a second."""
        shown, scene, wait = self.run, self._board.scene, 0.0
        if isinstance(shown, FinishedRun):
            self._slider.value = self._board.cursor  # as another tab may have moved it
        elif shown.charts and not self._begun:
            self._begin()
        elif self._begun and self._plots.is_ready:
            wait = min(SCENE_SHARE * self._plots.lag, RAREST_SCENE)
            new = shown.samples[bisect_right(shown.samples, self._time_sent, key=itemgetter("t")) :]
            if new:
                self._time_sent = new[-1]["t"]
                self._plots.put([plot_row(sample) for sample in new])
            self._look()
        if self._bench.panel not in ("", "run"):
            scene.give_back(self._bench)
        elif shown.scenario is not None and self._sample is not None:
            scene.draw(self._bench, shown.scenario, shown.subject, self._sample, wait)
        self._say()

    async def follow(self) -> None:
        """Reads what the run left once it is over."""
        entry = self.entry
        if entry is None:
            return
        self._offer_cables()
        self.files = await run.io_bound(_names, entry.folder) or frozenset()
        is_read = self._is_unreadable or isinstance(self.run, FinishedRun)
        if self.job.state.is_over and not is_read:
            try:
                done = await run.io_bound(read_run, entry.folder)
            except Exception:
                self._is_unreadable = True
                raise
            if done is not None and _identity(entry) == _identity(self.entry):
                self.run, board = done, self._board
                board.cursor = done.end if board.cursor is None else min(board.cursor, done.end)
                self._slider.props(f"max={done.end} step={max(done.end / 2000.0, 1e-3)}")
                self._slider.value = board.cursor
                self._begin()

    async def compare(self, entry: RunEntry | None) -> None:
        """Shows another run behind this one; None: that ends."""
        before, folder = self.other, None if entry is None else entry.folder
        if folder != (None if before is None else before.folder):
            try:
                self.other = None if folder is None else await run.io_bound(read_run, folder)
            except Exception:
                self._board.compared = ""
                raise
            self._begin()

    def _scrub(self) -> None:
        if isinstance(self.run, FinishedRun) and self._slider.value is not None:
            self._board.cursor = float(self._slider.value)
            self._look()

    def _look(self) -> None:
        """Camera and plots show the time of the slider, or the newest that a run has shown."""
        shown = self.run
        self._sample, jpeg = shown.at(self._board.cursor)
        if jpeg is not self._jpeg:
            self._jpeg = jpeg
            self._image.props["src"] = f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"
        if isinstance(shown, FinishedRun) and self._sample is not None:
            self._time.text = f"{self._sample['t']:.2f} s"
            self._plots.run_method("cursor", self._sample["t"])

    async def _fill_results(self) -> None:
        if self._fold.value and self.entry is not None and not self._results.default_slot.children:
            with self._results:
                await show_results(self.entry.folder)

    def _offer_cables(self) -> None:
        """Offers the cables that are not broken."""
        broken = {event.get("cable") for event in self.job.events}
        names = enumerate(self.job.header.get("cables", ()))
        left = {k: name for k, name in names if k not in broken}
        if left != self._cable.options:
            value = self._cable.value if self._cable.value in left else next(iter(left), None)
            self._cable.set_options(left, value=value)

    def _say(self) -> None:
        """State, outcome and progress in words."""
        job = self.job
        fraction, words = job.progress
        if job is not NO_RUN:
            starts = job.state == JobState.RUNNING and not job.header
            state = "starting" if starts else job.state.value
            words = job.message or words
        elif isinstance(self.run, FinishedRun):
            state = "finished"
        else:
            state = "unreadable" if self._is_unreadable else READING if self.entry else ""
        failed = state == JobState.FAILED
        self._state.text, self._outcome.text = state, self.run.outcome.replace("_", " ")
        self._words.text, self._problem.text = ("", words) if failed else (words, "")
        self._problem.visible = failed
        self._bar.visible = state == READING or not job.state.is_over
        self._bar.value = fraction or 0.0
        if self._bar.props.get("indeterminate", False) != (fraction is None):
            self._bar.props.set_bool("indeterminate", fraction is None)


def run_pairs(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[Pair]:
    """Numbers and words of two summaries of runs that at least one of them has."""

    def side(summary: Mapping[str, Any]) -> dict[str, Any]:
        own = {key: value for key, value in summary.items() if key not in OF_THE_PROGRAM}
        return {
            name: float(value) if isinstance(value, int) else value for name, value in leaves(own)
        }

    return pairs(side(one), side(other))


def _identity(entry: RunEntry | None) -> tuple[Path, RunJob | None] | None:
    """What tells runs apart: one may come after another in a folder."""
    return None if entry is None else (entry.folder, entry.job)


def _names(folder: Path) -> frozenset[str]:
    with suppress(OSError):
        return frozenset(os.listdir(folder))
    return frozenset()


def _done_by_hand(job: RunJob) -> str:
    """What was done to a run, or refused."""
    return "; ".join(
        f"{event['t']:.2f} s: {event.get('words') or 'refused: ' + event['refused']}"
        for event in job.events
    )

"""What a run shows: state, camera, plots, and the cursor of one that is finished.

`RUN_STYLE` is how the run panel looks, beside `studio.page`.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from typing import Any

from nicegui import run, ui

from cdpr_drake.studio.numbers import pair_table
from cdpr_drake.studio.panels.moving_plots import MovingPlots, Row
from cdpr_drake.studio.panels.panel import show_errors
from cdpr_drake.studio.workbench.finished_run import FinishedRun, is_run
from cdpr_drake.studio.workbench.job import JobState, Listener
from cdpr_drake.studio.workbench.plot_rows import charts_of, plot_row
from cdpr_drake.studio.workbench.run_board import RunBoard, RunEntry, outcome_words
from cdpr_drake.studio.workbench.run_job import RunJob
from cdpr_drake.studio.workbench.side_by_side import runs_side_by_side

STATES = {
    JobState.QUEUED: "waits for a place", JobState.RUNNING: "runs", JobState.PAUSED: "paused",
    JobState.STOPPING: "stops", JobState.FINISHED: "finished", JobState.FAILED: "failed",
    JobState.STOPPED: "stopped",
}  # fmt: skip
"""Words for states."""

Draw = Callable[[RunEntry, Mapping[str, Any], float], None]
"""Draws a sample of a run into the session's scene, at least a time after the one before [s]."""

SCENE_SHARE, RAREST_SCENE = 3.0, 2.0
"""The scene is drawn when the browser has drawn its plots, at most once in so many times what it
needs for that, and at least once in so long [s]: one thread of the browser draws both, and without
a graphics card the scene takes most of its time."""


class RunWatch:
    """Shows one run of a board; what was shown before is forgotten when another one is chosen."""

    def __init__(self, board: RunBoard, draw: Draw) -> None:
        """Places it into the current slot.

        Args:
            board: What the session looks at.
            draw: See `Draw`.
        """
        self._board, self._draw = board, draw
        self._shown: RunEntry | None = None
        self._listener: Listener | None = None
        self._finished: FinishedRun | None = None
        self._loading = False
        self._known: tuple[Any, ...] = ()
        self._begun = False
        self._jpeg = b""
        self._others: tuple[list[Row], str] = ([], "")
        with ui.element("div").classes("cdpr-run-view"):
            with ui.element("figure").classes("cdpr-camera") as self._figure:
                self._image = ui.element("img").props('alt="What the camera sees"').mark("camera")
            with ui.element("div").classes("cdpr-run-state"):
                self._state = ui.label().classes("cdpr-state").mark("run-state")
                self._outcome = ui.label().classes("cdpr-outcome").mark("outcome")
                self._bar = ui.linear_progress(0.0, show_value=False)
                self._words = ui.label().classes("cdpr-soft").mark("run-words")
                self._problem = ui.label().classes("studio-problem").mark("run-problem")
                self._key = ui.label("Camera: orange is found, green is wanted.")
                self._key.classes("cdpr-soft")
        self._plots = MovingPlots(self._begin)
        self._both = ui.expansion("Both runs in numbers").classes("w-full studio-group")
        with self._both.mark("both-runs"):
            self._pairs = ui.html("", sanitize=False).classes("w-full").mark("run-pairs")
        with ui.row().classes("w-full items-center no-wrap") as self._scrub:
            self._time = ui.label("0.00 s").classes("cdpr-time")
            self._slider = ui.slider(min=0.0, max=1.0, step=0.001, value=0.0).classes("col")
            self._slider.props('aria-label="Time"').mark("cursor")
            self._slider.on_value_change(lambda: self._scrubbed())
        self._figure.visible = self._key.visible = self._scrub.visible = False
        self._both.visible = False
        self._other: FinishedRun | None = None

    @property
    def job(self) -> RunJob | None:
        """The job that is looked at."""
        return None if self._shown is None else self._shown.job

    @property
    def shown(self) -> RunEntry | None:
        """The run that is looked at."""
        return self._shown

    def show(self, shown: RunEntry | None) -> None:
        """Looks at another run."""
        self.forget()
        self._shown, self._finished, self._known = shown, None, ()
        self._begun = self._loading = False
        self._say_pairs()
        self._jpeg = b""
        self._figure.visible = self._key.visible = self._scrub.visible = False
        if shown is not None and shown.job is not None:
            self._listener = shown.job.listen()
        self._begin()
        self._say()

    def forget(self) -> None:
        """Listens no more."""
        if self._listener is not None and self.job is not None:
            self.job.forget(self._listener)
        self._listener = None

    def show_span(self, seconds: float | None) -> None:
        """Shows the last seconds of plots only; None: all."""
        self._plots.show_span(seconds)

    def _begin(self) -> None:
        """Gives the plots all that there is."""
        if self._finished is not None:
            done = self._finished
            rows = [plot_row(sample) for sample in done.samples]
            self._plots.begin(charts_of(done.cables, done.limits), float(done.times[-1]), rows)
            self._plots.cursor(self._board.cursor)
            self._begun = True
        elif self.job is not None and self.job.header:
            header = self.job.header
            rows = [plot_row(sample) for sample in self.job.samples.all()]
            charts = charts_of(header["cables"], header["limits"])
            self._plots.begin(charts, header["duration"], rows)
            self._begun = True
            if self.job.image:
                self._picture(self.job.image)
        else:
            self._plots.begin((), 0.0, ())
        if self._others[0]:
            self._plots.compare(*self._others)

    def tick(self) -> None:
        """Shows what is new; called many times a second."""
        job = self.job
        if job is not None and self._listener is not None and self._finished is None:
            self._follow(job, self._listener)
        self._plots.flush()
        self._say()

    async def load_finished(self) -> None:
        """Reads the results once they are there."""
        shown = self._shown
        if shown is None or self._finished is not None or self._loading:
            return
        if (shown.job is not None and not shown.job.state.is_over) or not is_run(shown.folder):
            return
        self._loading = True
        with show_errors():
            done = await run.io_bound(self._board.finished, shown.folder)
            if shown is self._shown and done is not None:
                self._take_finished(done)

    def _take_finished(self, done: FinishedRun) -> None:
        self._finished = done
        end = float(done.times[-1])
        if self._board.cursor is None or self._board.cursor > end:
            self._board.cursor = end
        self._slider.props(f"max={end} step={max(end / 2000.0, 1e-3)}")
        self._slider.value = self._board.cursor
        self._scrub.visible = True
        self._say_pairs()
        self._begin()
        self._scrubbed()

    def _follow(self, job: RunJob, listener: Listener) -> None:
        events = listener.take()
        if not self._begun and job.header:
            self._begin()
            events = [event for event in events if event.kind != "sample"]
        samples = [event.data for event in events if event.kind == "sample"]
        for event in events:
            if event.kind == "image":
                self._jpeg = event.blob
        if self._plots.is_ready:
            if samples and self._shown is not None:
                wait = min(SCENE_SHARE * self._plots.lag, RAREST_SCENE)
                self._draw(self._shown, samples[-1], wait)
            if self._jpeg:
                self._picture(self._jpeg)
                self._jpeg = b""
        if samples and not self._plots.append([plot_row(sample) for sample in samples]):
            self._plots.replace([plot_row(sample) for sample in job.samples.all()])

    def _picture(self, jpeg: bytes) -> None:
        self._image.props["src"] = f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"
        self._image.update()
        self._figure.visible = self._key.visible = True

    def draw_again(self) -> None:
        """Draws what is shown into the scene once more, as after another panel had that."""
        done, job = self._finished, self.job
        if self._shown is None:
            return
        if done is not None:
            self._draw(self._shown, done.samples[done.row_at(float(self._slider.value))], 0.0)
        elif job is not None and job.samples.last is not None:
            self._draw(self._shown, job.samples.last, 0.0)

    def _scrubbed(self) -> None:
        """Scene, camera and plots show the time of the slider."""
        done = self._finished
        if done is None or self._slider.value is None:
            return
        time = float(self._slider.value)
        row = done.row_at(time)
        self._board.cursor = time
        self._time.text = f"{done.times[row]:.2f} s"
        self._plots.cursor(float(done.times[row]))
        image = done.image(row)
        if image:
            self._picture(image)
        assert self._shown is not None
        self._draw(self._shown, done.samples[row], 0.0)

    def follow_cursor(self) -> None:
        """Moves the slider where another tab of the session has moved it."""
        cursor = self._board.cursor
        if self._finished is not None and cursor is not None and self._slider.value != cursor:
            self._slider.value = cursor

    async def compare(self, other: RunEntry | None) -> None:
        """Shows another run behind this one; None: that ends."""
        with show_errors():
            self._others, self._other = ([], ""), None
            if other is not None:
                done = await run.io_bound(self._board.finished, other.folder)
                if done is not None:
                    rows = [plot_row(sample) for sample in done.samples]
                    self._others, self._other = (rows, other.folder.name), done
            self._plots.compare(*self._others)
        self._say_pairs()

    def _say_pairs(self) -> None:
        """Both runs in numbers, once both are finished."""
        one, other = self._finished, self._other
        self._both.visible = one is not None and other is not None
        if one is not None and other is not None:
            pairs = runs_side_by_side(one.summary, other.summary)
            self._pairs.content = pair_table(pairs, one.folder.name, other.folder.name)

    def _say(self) -> None:
        """State, outcome and progress in words, where they have changed."""
        job, shown = self.job, self._shown
        summary = None if self._finished is None else self._finished.summary
        if job is not None:
            fraction, words = job.progress
            now = (STATES[job.state], job.message, fraction, words)
            outcome = outcome_words(job.samples.last, summary)
        else:
            now = ("" if shown is None else "finished", "", None, "")
            outcome = outcome_words(None, summary)
        if (now, outcome) == self._known:
            return
        self._known = (now, outcome)
        self._state.text, self._outcome.text = now[0], outcome.replace("_", " ")
        self._bar.visible = job is not None and not job.state.is_over
        self._bar.value = now[2] or 0.0
        self._words.text = now[3]
        failed = job is not None and job.state == JobState.FAILED
        self._problem.text = now[1] if failed else ""
        self._problem.visible = failed
        if not failed and now[1]:
            self._words.text = now[1]


RUN_STYLE = """
.cdpr-run { width: 100%; padding: 0 0.6rem; box-sizing: border-box; display: flex;
  flex-direction: column; gap: 0.5rem; }
.cdpr-run .q-field { min-width: 7rem; }
.cdpr-speed { width: 10.5rem; }
.cdpr-compare { width: 14rem; }
.cdpr-state { font-weight: 600; white-space: nowrap; }
.cdpr-outcome { white-space: nowrap; }
.cdpr-time { font-variant-numeric: tabular-nums; min-width: 4.5rem; }
.cdpr-soft { color: var(--studio-soft); font-size: 0.82rem; min-height: 1.2rem; }
.cdpr-run .studio-problem { padding: 0; }
.cdpr-run-view { display: flex; gap: 0.8rem; width: 100%; align-items: flex-start; }
.cdpr-run-state { flex: 1; min-width: 0; display: flex; flex-direction: column; gap: 0.2rem; }
.cdpr-camera { margin: 0; flex: 0 0 auto; width: 16rem; max-width: 45%; }
.cdpr-camera img { display: block; width: 100%; height: auto;
  border: 1px solid var(--studio-line); }
.cdpr-plots { width: 100%; min-width: 0; }
.cdpr-plot { margin: 0 0 0.3rem 0; width: 100%; }
.cdpr-plot canvas { display: block; }
.cdpr-plots-legend { display: flex; flex-wrap: wrap; gap: 0.1rem 0.9rem; font-size: 0.8rem; }
.cdpr-plots-legend svg { margin-right: 0.3rem; }
.cdpr-fields { display: grid; gap: 0.5rem 0.7rem; width: 100%;
  grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); }
.cdpr-fold { width: 100%; }
@media (max-width: 600px) {
  .cdpr-run > .row.no-wrap { flex-wrap: wrap !important; }
  .cdpr-run > .row.no-wrap > .q-field.col { flex: 1 1 100%; }
  .cdpr-run > .row.no-wrap > .cdpr-speed { flex: 1 1 7rem; width: auto; }
}
@media (min-width: 1700px) { .cdpr-camera { width: 22rem; } }
"""

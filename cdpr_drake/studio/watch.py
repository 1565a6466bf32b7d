"""One run in the page, live or finished alike: state, picture, plots, scene, steering, results."""

from __future__ import annotations

import base64
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from time import monotonic
from typing import Any
from weakref import ref

import numpy as np
from nicegui import run, ui

from cdpr_drake.analyses.runs.steering import BREAK, PUSH
from cdpr_drake.studio.finished_run import FinishedRun, is_run
from cdpr_drake.studio.jobs import JobState
from cdpr_drake.studio.numbers import pair_table
from cdpr_drake.studio.panel import notify, show_errors
from cdpr_drake.studio.plots import MovingPlots, charts_of, plot_row
from cdpr_drake.studio.results import subject_of
from cdpr_drake.studio.run_board import RunBoard, RunEntry, outcome_words
from cdpr_drake.studio.run_job import RunJob
from cdpr_drake.studio.scene import RobotScene, RunScene
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.side_by_side import Pair
from cdpr_drake.studio.views import leaves, show_results

Sample = Mapping[str, Any]

SCENE_SHARE, RAREST_SCENE = 3.0, 2.0
"""The scene is drawn when the browser has drawn its plots, at most once in so many times what it
needs for that, and at least once in so long [s]: one thread of the browser draws both, and without
a graphics card the scene takes most of its time."""

AS_FAST = "as fast as possible"
SPEEDS: dict[str, float | None] = {
    "x 0.1": 0.1, "x 0.5": 0.5, "real time": 1.0, "x 2": 2.0, "x 5": 5.0, "x 20": 20.0,
    AS_FAST: None,
}  # fmt: skip
"""Speeds that are offered, as factors of real time."""

STEERING: dict[str, tuple[str, Callable[[RunJob], None]]] = {
    "Pause": ("pause", RunJob.pause), "Go on": ("play_arrow", RunJob.go),
    "Step": ("skip_next", RunJob.step), "Stop": ("stop", RunJob.stop),
}  # fmt: skip
"""Buttons with their icons and effects."""

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


class SceneOfRuns:
    """Draws runs into a workbench's scene, the newest sample when the last one is drawn.

    Attributes:
        was_missed: True if a run is not in the scene because another panel is, or was, shown.
    """

    def __init__(self, bench: Workbench) -> None:
        """For the scene of a workbench, which is not touched yet."""
        self._bench = ref(bench)  # the workbench keeps this object
        self._scene: RunScene | None = None
        self._shown: tuple[Path, RunJob | None] | None = None
        self._busy, self._drawn, self.was_missed = False, 0.0, False
        self._next: tuple[RunEntry, Sample, float] | None = None

    def draw(self, entry: RunEntry, sample: Sample, wait: float) -> None:
        """Draws a sample of a run, unless one was drawn less than `wait` before [s]."""
        bench = self._bench()
        if bench is None or bench.panel not in ("", "run"):
            self.was_missed = True
        elif self._busy:
            self._next = (entry, sample, wait)
        elif monotonic() - self._drawn >= wait:
            self._busy, self._next, self.was_missed = True, None, False
            dark = bool(bench.dark)
            bench.draw(lambda scene: self._work(scene, entry, sample, dark), self._done)

    def _work(self, scene: RobotScene, entry: RunEntry, sample: Sample, dark: bool) -> None:
        if self._scene is None or self._shown != (entry.folder, entry.job):
            scenario = entry.scenario()
            if scenario is None:
                return
            self._scene = RunScene(scene.meshcat, scenario)
            self._shown = entry.folder, entry.job
            scene.set_dark(dark)
        self._scene.draw(sample)

    def _done(self, future: Any) -> None:
        self._busy, self._drawn = False, monotonic()
        future.exception()
        bench = self._bench()
        if bench is not None and self._scene is not None:
            bench.draws(subject_of(self._scene.robot))
        if self._next is not None:
            self.draw(*self._next)

    def give_back(self) -> None:
        """Lets the open robot be shown again."""
        bench = self._bench()
        if self._scene is not None and bench is not None:
            self._scene = self._shown = None
            self.was_missed = True
            bench.draw(lambda scene: scene.redraw())
            bench.draws(None)
            bench.ask()


class RunWatch:
    """Shows one run of a board: samples while it goes on, rows of its log when it is finished.

    Attributes:
        entry: The run; None: none is shown.
    """

    def __init__(self, board: RunBoard, scene: SceneOfRuns) -> None:
        """Places it into the current slot."""
        self._board, self._scene = board, scene
        self.entry: RunEntry | None = None
        self._finished: FinishedRun | None = None
        self._other: FinishedRun | None = None
        self._unread: RunEntry | None = None  # whose log cannot be read
        self._begun = False
        self._said: tuple[Any, ...] = ()
        self._jpeg, self._time_sent = b"", -np.inf  # the newest that the browser has
        self._hands = _HandBar()
        with ui.element("div").classes("cdpr-run-view"):
            with ui.element("figure").classes("cdpr-camera") as self._figure:
                self._image = ui.element("img").props('alt="Image of the camera"').mark("camera")
            with ui.element("div").classes("cdpr-run-state"):
                self._state = ui.label().classes("cdpr-state").props('role="status"')
                self._outcome = ui.label().classes("cdpr-outcome").mark("outcome")
                self._bar = ui.linear_progress(0.0, show_value=False)
                self._words = ui.label().classes("cdpr-soft").mark("run-words")
                self._problem = ui.label().classes("studio-problem").mark("run-problem")
                self._key = ui.label("Image: detected marks are orange, desired marks green.")
                self._key.classes("cdpr-soft")
        self._state.mark("run-state")
        self._plots = MovingPlots(self._begin)
        with ui.row().classes("w-full items-center no-wrap") as self._scrub:
            self._time = ui.label("0.00 s").classes("cdpr-time")
            self._slider = ui.slider(min=0.0, max=1.0, step=0.001, value=0.0).classes("col")
            self._slider.props('aria-label="Time"').mark("cursor")
            self._slider.on_value_change(self._scrubbed)
        with ui.expansion("Both runs in numbers").classes("w-full studio-group") as self._both:
            self._pairs = ui.html("", sanitize=False).classes("w-full").mark("run-pairs")
        with ui.expansion("Results, figures and files") as self._fold:
            self._results = ui.element("div").classes("w-full")
        self._both.mark("both-runs")
        self._fold.classes("w-full studio-group").mark("run-results")
        self._fold.on_value_change(self._fill_results)
        self.show(None)

    @property
    def job(self) -> RunJob | None:
        """The job of the run that is shown."""
        return None if self.entry is None else self.entry.job

    def show(self, entry: RunEntry | None) -> None:
        """Shows another run; all of the one before is forgotten."""
        self.entry, self._finished, self._said = entry, None, ()
        self._fold.value = False
        self._results.clear()
        for element in (self._figure, self._key, self._scrub, self._fold):
            element.set_visibility(False)
        self._begin()
        self._say_pairs()
        self._say()

    def show_span(self, seconds: float | None) -> None:
        """Shows the last seconds of plots only; None: all."""
        self._plots.run_method("show_span", seconds)

    def _begin(self) -> None:
        """Gives the plots all that is there."""
        done, job = self._finished, self.job
        if done is not None:
            charts, end = charts_of(done.cables, done.limits), float(done.times[-1])
            samples: Sequence[Sample] = done.samples
        elif job is not None and job.header:
            charts = charts_of(job.header["cables"], job.header["limits"])
            end, samples = job.header["duration"], job.samples.all()
        else:
            charts, end, samples = (), 0.0, ()
        self._begun, self._jpeg = bool(charts), b""
        self._time_sent = samples[-1]["t"] if samples else -np.inf
        self._plots.begin(charts, end, [plot_row(sample) for sample in samples])
        if done is not None:
            self._plots.run_method("cursor", self._board.cursor)
        if self._other is not None:
            self._show_other()

    def tick(self) -> None:
        """Shows what is new; to be called many times a second."""
        job, entry = self.job, self.entry
        if job is not None and entry is not None and self._finished is None:
            if not self._begun and job.header:
                self._begin()
            elif self._begun and self._plots.is_ready:
                self._follow(job, entry)
        self._say()

    def _follow(self, job: RunJob, entry: RunEntry) -> None:
        """Shows the newest image, and samples that the browser does not have."""
        if job.image is not self._jpeg:
            self._jpeg = job.image
            self._show_image(job.image)
        samples = job.samples.all()
        new = samples[bisect_right(samples, self._time_sent, key=itemgetter("t")) :]
        if new:
            self._time_sent = new[-1]["t"]
            self._scene.draw(entry, new[-1], min(SCENE_SHARE * self._plots.lag, RAREST_SCENE))
            self._plots.put([plot_row(sample) for sample in new])

    async def tick_slowly(self) -> None:
        """Reads the results once they are there, and follows jobs and other tabs."""
        entry, cursor = self.entry, self._board.cursor
        self._hands.refresh(self.job)
        if entry is not None and self._finished is None and entry is not self._unread:
            over = entry.job is None or entry.job.state.is_over
            self._fold.set_visibility(over and entry.folder.is_dir())
            if over and is_run(entry.folder):
                try:
                    done = await run.io_bound(self._board.finished, entry.folder)
                except Exception:
                    self._unread = entry
                    raise
                if entry is self.entry and done is not None:
                    self._take_finished(done)
        elif self._finished is not None and cursor is not None and self._slider.value != cursor:
            self._slider.value = cursor  # as another tab has moved it

    def _take_finished(self, done: FinishedRun) -> None:
        self._finished, end = done, float(done.times[-1])
        if self._board.cursor is None or self._board.cursor > end:
            self._board.cursor = end
        self._slider.props(f"max={end} step={max(end / 2000.0, 1e-3)}")
        self._slider.value = self._board.cursor
        self._scrub.visible = True
        self._say_pairs()
        self._begin()
        self._scrubbed()

    async def _fill_results(self) -> None:
        if self._fold.value and self.entry is not None and not self._results.default_slot.children:
            with self._results:
                await show_results(self.entry.folder)

    def _show_image(self, jpeg: bytes) -> None:
        if jpeg:
            self._image.props["src"] = f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"
            self._image.update()
            self._figure.visible = self._key.visible = True

    def _scrubbed(self) -> None:
        """Scene, camera and plots show the time of the slider."""
        done = self._finished
        if done is not None and self._slider.value is not None:
            self._board.cursor = float(self._slider.value)
            row = done.row_at(self._board.cursor)
            self._time.text = f"{done.times[row]:.2f} s"
            self._plots.run_method("cursor", float(done.times[row]))
            self._show_image(done.image(row))
            self.draw_again()

    def draw_again(self) -> None:
        """Draws what is shown into the scene once more, as after another panel had the scene."""
        sample = None if self.job is None else self.job.samples.last
        if self._finished is not None:
            sample = self._finished.samples[self._finished.row_at(float(self._slider.value))]
        if self.entry is not None and sample is not None:
            self._scene.draw(self.entry, sample, 0.0)

    async def compare(self, other: RunEntry | None) -> None:
        """Shows another run behind this one; None: that ends."""
        self._other = None
        with show_errors():
            if other is not None:
                self._other = await run.io_bound(self._board.finished, other.folder)
        self._show_other()
        self._say_pairs()

    def _show_other(self) -> None:
        other = self._other
        rows = [] if other is None else [plot_row(sample) for sample in other.samples]
        self._plots.run_method("compare", rows, "" if other is None else other.folder.name)

    def _say_pairs(self) -> None:
        """Both runs in numbers, once both are finished."""
        both = self._finished, self._other
        self._both.visible = None not in both
        if both[0] is not None and both[1] is not None:
            pairs = run_pairs(both[0].summary, both[1].summary)
            self._pairs.content = pair_table(pairs, both[0].folder.name, both[1].folder.name)

    def _say(self) -> None:
        """State, outcome and progress in words, where they have changed."""
        job, done = self.job, self._finished
        summary = None if done is None else done.summary
        if job is None:
            state = (
                "finished" if done else READING if self.entry is not self._unread else "unreadable"
            )
            state = "" if self.entry is None else state
            fraction, words, said, outcome = None, "", "", outcome_words(None, summary)
        else:
            (fraction, words), said = job.progress, job.message
            starts = job.state == JobState.RUNNING and not job.header
            state = "starting" if starts else job.state.value
            outcome = outcome_words(job.samples.last, summary)
        if (state, fraction, words, said, outcome) == self._said:
            return
        self._said = (state, fraction, words, said, outcome)
        failed = job is not None and job.state == JobState.FAILED
        self._state.text, self._outcome.text = state, outcome.replace("_", " ")
        working = job is not None and not job.state.is_over
        self._bar.visible = working or state == READING
        self._bar.props(remove="indeterminate", add="indeterminate" if fraction is None else "")
        self._bar.value = fraction or 0.0
        self._words.text = words if failed else said or words
        self._problem.text, self._problem.visible = (said, True) if failed else ("", False)


def run_pairs(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[Pair]:
    """Numbers and words of two summaries of runs that at least one of them has."""
    sides = []
    for summary in (one, other):
        own = {key: value for key, value in summary.items() if key not in OF_THE_PROGRAM}
        sides.append({
            name: float(value) if isinstance(value, int) else value for name, value in leaves(own)
        })  # fmt: skip
    pairs = [Pair(name, *(side.get(name) for side in sides)) for name in sides[0] | sides[1]]
    return [pair for pair in pairs if pair.one is not None or pair.other is not None]


class SteeringBar:
    """Speed, pause, go, step and stop of the run that is shown."""

    def __init__(self, board: RunBoard, current: Callable[[], RunJob | None]) -> None:
        """Places it into the current slot; `current` gives the job that is shown, if any."""
        self._board, self._current = board, current
        now = next((words for words, speed in SPEEDS.items() if speed == board.speed), AS_FAST)
        self._speed = ui.select(list(SPEEDS), value=now, label="speed", on_change=self._set_speed)
        self._speed.props("dense outlined").classes("cdpr-speed").mark("speed")
        self._buttons = {}
        for words, (icon, act) in STEERING.items():
            button = ui.button(icon=icon, on_click=lambda act=act: self._do(act))
            button.props(f'dense aria-label="{words}" title="{words}"')
            self._buttons[words] = button.mark(words.lower().replace(" ", "-"))
        self.refresh()

    def _do(self, act: Callable[[RunJob], None]) -> None:
        job = self._current()
        if job is not None:
            with show_errors():
                act(job)

    def _set_speed(self) -> None:
        speed = self._board.speed = SPEEDS[str(self._speed.value)]
        self._do(lambda job: job.set_speed(speed))

    def refresh(self) -> None:
        """Offers what the run takes now."""
        job = self._current()
        state = None if job is None else job.state
        paused = job is not None and bool(job.pace.get("paused"))
        working = state in (JobState.QUEUED, JobState.RUNNING, JobState.PAUSED)
        enabled = {"Pause": working and not paused, "Go on": working and paused,
                   "Step": state == JobState.PAUSED, "Stop": working}  # fmt: skip
        for words, button in self._buttons.items():
            button.set_enabled(enabled[words])


class _HandBar:
    """Buttons that break a cable or push the platform, and what was done so."""

    def __init__(self) -> None:
        """Places it into the current slot."""
        self._job: RunJob | None = None
        self._said = 0
        self._names: list[str] = []
        with ui.element("div").classes("w-full") as self._box:
            with ui.row().classes("w-full items-center"):
                self._cable = ui.select({}, label="cable").mark("hand-cable")
                self._break = ui.button("Break", icon="content_cut", on_click=self._breaks)
                self._direction = ui.select(list(DIRECTIONS), value="+x", label="direction in W")
                self._force = ui.number("force", value=USUAL_FORCE, min=0.0, suffix="N")
                self._time = ui.number("for", value=USUAL_TIME, min=0.0, step=0.1, suffix="s")
                self._push = ui.button("Push", icon="touch_app", on_click=self._pushes)
            self._done = ui.label().classes("cdpr-soft").props('role="status"').mark("hand-done")
        for button, words, name in (
            (self._break, "The cable pulls no more from now on", "break"),
            (self._push, "A push at Po, a half sine with this peak force", "push"),
        ):
            button.props(f'no-caps outline title="{words}"').mark(name)
        for field, name in (
            (self._direction, "direction"), (self._force, "force"), (self._time, "time")
        ):  # fmt: skip
            field.classes("w-32" if name == "direction" else "w-24").mark(f"push-{name}")
        for field in (self._cable, self._direction, self._force, self._time):
            field.props("dense outlined")
        self.refresh(None)

    def _breaks(self) -> None:
        with show_errors():
            if self._job is not None and self._cable.value is not None:
                self._job.break_cable(int(self._cable.value))

    def _pushes(self) -> None:
        with show_errors():
            if self._job is not None:
                force = float(self._force.value or 0.0) * DIRECTIONS[str(self._direction.value)]
                self._job.push(force.tolist(), float(self._time.value or 0.0))

    def refresh(self, job: RunJob | None) -> None:
        """Offers what a run takes now, and says what was done."""
        takes = () if job is None else tuple(job.header.get("takes", ()))
        events = [] if job is None else list(job.events)
        names = [] if job is None else list(job.header.get("cables", ()))  # it may come late
        self._box.set_visibility(bool(takes) or bool(events))
        new = events[self._said :] if job is self._job else []
        if job is not self._job or new or names != self._names:
            broken = {event.get("cable") for event in events}
            left = {k: name for k, name in enumerate(names) if k not in broken}
            value = self._cable.value if self._cable.value in left else next(iter(left), None)
            self._cable.set_options(left, value=value)
            done = [f"{event['t']:.2f} s: {event['words']}" for event in events if "words" in event]
            self._done.text = "; ".join(done)
        for event in new:
            if "refused" in event:
                notify(str(event["refused"]))
        self._job, self._said, self._names = job, len(events), names
        working = job is not None and job.state in (JobState.RUNNING, JobState.PAUSED)
        self._break.set_enabled(working and BREAK in takes and self._cable.value is not None)
        self._push.set_enabled(working and PUSH in takes)

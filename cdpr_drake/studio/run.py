"""The run panel: a scenario's form, its run while it goes on, and finished ones."""

from __future__ import annotations

import asyncio
import base64
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import run, ui

from cdpr_drake.analyses.runs.log import PARTS
from cdpr_drake.analyses.runs.steering import BREAK, PUSH
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.boards import Entry
from cdpr_drake.studio.jobs import Job, JobState
from cdpr_drake.studio.numbers import Pair, pair_table, pairs
from cdpr_drake.studio.panel import COMPARED, RUN, offer, robot_argument, show_errors
from cdpr_drake.studio.plots import Chart, MovingPlots, plot_row
from cdpr_drake.studio.results import Subject, subject_of
from cdpr_drake.studio.runs import NO_RUN, READING, SPEEDS, FinishedRun, RunBoard, RunJob, Sample
from cdpr_drake.studio.scenario import ScenarioDraft, ScenarioForm
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.views import leaves, read_behind, send_file, show_results
from cdpr_drake.systems.scenarios.files import robot_scenario_names
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO

STYLE = Path(__file__).with_suffix(".css").read_text(encoding="utf-8")

TICK, SLOW_TICK = 1.0 / 30.0, 0.5
"""Times between looks at a run, and at jobs and folders [s]."""

SCENE_SHARE, RAREST_SCENE = 3.0, 2.0
"""The scene is drawn when the browser has drawn its plots, at most once in so many times what it
needs for that, and at least once in so long [s]: one thread of the browser draws both, and without
a graphics card the scene takes most of its time."""

SPANS = {"all": None, "last 5 s": 5.0, "last 20 s": 20.0}
"""Times that plots show."""

EMPTY = (
    "No run is shown. Choose a scenario and press Start to simulate the open robot, or choose one "
    "of the runs in the working folder."
)

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

OF_THE_PROGRAM = ("versions", "wall_time_s", "realtime_factor")
"""Keys of a summary that say nothing about the run."""


def run_panel(bench: Workbench) -> None:
    """Places the run panel."""
    RunPanel(bench)


class RunPanel:
    """The panel in one tab of a browser."""

    def __init__(self, bench: Workbench) -> None:
        """Places it into the current slot."""
        self._bench, self._board = bench, bench.kept(RunBoard)
        self._form: ScenarioForm | None = None
        self._placing = asyncio.Lock()
        # What the browser has.
        self._shown: object = None
        self._begun: tuple[object, tuple[Chart, ...], object] = NO_RUN, (), None
        self._sample: Sample | None = None
        self._jpeg = b""
        ui.add_css(STYLE)
        with ui.element("div").classes("cdpr-run"):
            self._place_start()
            self._place_choice()
            self._place_hands()
            self._place_state()
            self._place_plots()
            self._place_results()
        with ui.expansion("Fields of the scenario", value=True).classes("w-full"):
            self._body = ui.element("div")
        ui.timer(0.0, self._offer_scenarios, once=True)
        bench.robot.changed.subscribe(self._take_robot)
        ui.timer(TICK, self._tick)
        ui.timer(SLOW_TICK, self._slow_tick)

    def _place_start(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            self._scenario = ui.select({}, label="scenario", with_input=True)
            self._scenario.classes("col").mark("scenario")
            self._scenario.on_value_change(self._choose_scenario)
            self._paused = ui.checkbox("start paused").mark("paused")
            self._by_hand = ui.checkbox("break and push by hand").mark("by-hand")
            self._by_hand.props('title="Cables can be broken and the platform pushed"')
            self._start_button = ui.button("Start", icon="play_circle", on_click=self._start)
            self._start_button.props("no-caps").mark("start")
        with ui.row().classes("w-full items-center no-wrap"):
            self._which = ui.label().classes("studio-soft").mark("run-robot")
            self._own = ui.button(on_click=self._open_own_robot).mark("open-own-robot")
            self._own.props("dense no-caps outline")
            self._own.bind_visibility_from(self._own, "text", bool)

    def _place_choice(self) -> None:
        """Places which run is shown, its speed, and pause, go, step and stop."""
        board = self._board
        with ui.row().classes("w-full items-center no-wrap"):
            self._run = ui.select({}, label="run", on_change=self._choose_run)
            self._run.classes("col").mark("run")
            speed = ui.select([*SPEEDS], label="speed").bind_value(board, "speed")
            speed.classes("cdpr-speed").mark("speed")
            speed.on_value_change(lambda: board.job.tell("speed", factor=SPEEDS[board.speed]))
            for words, (icon, act, takes) in STEERING.items():
                props = f'dense aria-label="{words}" title="{words}"'
                button = self._button("", icon, props, act, takes)
                button.mark(words.lower().replace(" ", "-"))
        empty = ui.label(EMPTY).classes("studio-empty").mark("run-empty")
        empty.bind_visibility_from(board, "shown", lambda key: not key)

    def _button(
        self, words: str, icon: str, props: str, act: Callable[[RunJob], None],
        takes: Callable[[RunJob], bool],
    ) -> ui.button:  # fmt: skip
        """A button that does something to a run that works, as long as that takes it."""
        board = self._board
        button = ui.button(words, icon=icon, on_click=lambda: act(board.job)).props(props)
        return button.bind_enabled_from(
            board, "job", lambda job: job.state in WORKING and takes(job)
        )

    def _place_hands(self) -> None:
        """Places buttons that break a cable or push the platform, and what was done so."""
        board = self._board

        def break_cable(job: RunJob) -> None:
            job.tell(BREAK, cable=self._cable.value)

        def push(job: RunJob) -> None:
            peak = float(force.value or 0.0) * DIRECTIONS[str(direction.value)]
            job.tell(PUSH, force=peak.tolist(), seconds=float(time.value or 0.0))

        def hand(act: str, icon: str, title: str, do: Callable[[RunJob], None]) -> None:
            props, words = f'no-caps outline title="{title}"', act.capitalize()
            button = self._button(words, icon, props, do, lambda job: act in job.takes)
            button.mark(act)

        with ui.element("div").classes("w-full") as box:
            with ui.row().classes("w-full items-center"):
                self._cable = ui.select({}, label="cable").mark("hand-cable")
                hand(BREAK, "content_cut", "The cable pulls no more from now on", break_cable)
                direction = ui.select([*DIRECTIONS], value="+x", label="direction in W")
                force = ui.number("force", value=5.0, min=0.0, suffix="N").mark("push-force")
                time = ui.number("for", value=0.3, min=0.0, step=0.1, suffix="s").mark("push-time")
                hand(PUSH, "touch_app", "A push at Po, a half sine with this peak force", push)
            done = ui.label().classes("cdpr-soft").props('role="status"').mark("hand-done")
        direction.classes("w-32").mark("push-direction")
        for number in (force, time):
            number.classes("w-24")
        done.bind_text_from(board, "job", _done_by_hand)
        box.bind_visibility_from(board, "job", lambda job: bool(job.takes))

    def _place_state(self) -> None:
        """Places the camera's image, and how the run is."""
        board = self._board
        with ui.element("div").classes("cdpr-run-view"):
            with ui.element("figure").classes("cdpr-camera") as figure:
                self._image = ui.element("img").props('alt="Image of the camera"').mark("camera")
            with ui.element("div").classes("cdpr-run-state"):
                state = ui.label().classes("cdpr-state").props('role="status"').mark("run-state")
                outcome = ui.label().classes("cdpr-outcome").mark("outcome")
                self._bar = ui.linear_progress(0.0, show_value=False)
                words = ui.label().classes("cdpr-soft").mark("run-words")
                problem = ui.label().classes("studio-problem").mark("run-problem")
                key = ui.label("Image: detected marks are orange, desired marks green.")
                key.classes("cdpr-soft")
        for element in (figure, key):
            element.bind_visibility_from(self, "_jpeg", bool)
        state.bind_text_from(board, "state")
        outcome.bind_text_from(board, "run", lambda shown: shown.outcome.replace("_", " "))
        self._bar.bind_value_from(board, "job", lambda job: job.progress[0] or 0.0)
        self._bar.bind_visibility_from(
            board, "state", lambda state: state == READING or not board.job.state.is_over
        )
        words.bind_text_from(board, "job", lambda job: job.message or job.progress[1])
        problem.bind_text_from(words, "text")
        words.bind_visibility_from(board, "state", lambda state: state != JobState.FAILED)
        problem.bind_visibility_from(board, "state", lambda state: state == JobState.FAILED)

    def _place_plots(self) -> None:
        """Places plots over time, and a slider for the time of a finished run."""
        board = self._board
        self._plots = MovingPlots(self._begin)
        with ui.row().classes("w-full items-center no-wrap") as scrub:
            self._time = ui.label("0.00 s").classes("cdpr-time")
            self._slider = ui.slider(min=0.0, max=1.0, step=0.001).classes("col").mark("cursor")
            self._slider.props('aria-label="Time"').bind_value(board, "cursor")
        scrub.bind_visibility_from(board, "run", lambda shown: isinstance(shown, FinishedRun))

    def _place_results(self) -> None:
        """Places the numbers of both runs, what is in the folder, and what is done with it."""
        board = self._board
        with ui.expansion("Both runs in numbers").classes("w-full studio-group") as self._both:
            self._pairs = ui.html("", sanitize=False).classes("w-full").mark("run-pairs")
        self._fold = ui.expansion("Results, figures and files", on_value_change=self._fill_results)
        with self._fold.classes("w-full studio-group").mark("run-results"):
            self._results = ui.element("div").classes("w-full")
        self._both.mark("both-runs")
        with ui.row().classes("w-full items-center"):
            self._compare = ui.select({}, label="compare with", on_change=self._choose_other)
            self._compare.classes("cdpr-compare").mark("compare")
            span = ui.select([*SPANS], value="all", label="time shown")
            span.on_value_change(
                lambda event: self._plots.run_method("show_span", SPANS[event.value])
            )
            ui.space()
            recover = ui.button("Write the results so far", on_click=self._recover)
            recover.props("no-caps outline").mark("recover")
            download = ui.button("Download", icon="download", on_click=self._download)
            download.props('no-caps outline title="All files of the run"').mark("download")

        def show(element: ui.element, where: Callable[[Entry], bool]) -> None:
            element.bind_visibility_from(
                board, "entry", lambda entry: entry is not None and where(entry)
            )

        show(self._fold, lambda entry: bool(entry.files) and board.job.state.is_over)
        show(recover, lambda entry: board.job.state == JobState.FAILED and PARTS in entry.files)
        show(download, lambda entry: bool(entry.files))

    async def _offer_scenarios(self) -> None:
        """Offers scenarios, those of the working folder first."""

        def scenarios() -> tuple[dict[str, str], str]:
            folder, draft, own = self._bench.folder, self._board.draft, self._bench.scenario
            options = {str(folder.root / name): name for name in folder.files((".yaml", ".yml"))}
            options |= {name: name for name in robot_scenario_names()}
            names = (draft.name if draft else "", own, str(Path(own).resolve()))
            return options, next((name for name in names if name in options), DEFAULT_SCENARIO)

        options, value = await run.io_bound(scenarios) or ({}, None)
        self._scenario.set_options(options, value=value)

    async def _choose_scenario(self) -> None:
        """Shows the form of another scenario; changes of the same one are kept."""
        name = self._scenario.value

        def read() -> ScenarioDraft:
            folder, draft = self._bench.folder, self._board.draft
            file = str(folder.path(name)) if Path(name).is_absolute() else name
            return draft if draft and draft.name == file else ScenarioDraft(file, folder.root)

        async with self._placing:
            self._form = None
            self._body.clear()
            with self._body, show_errors():
                draft = await read_behind(read)
                if draft is not None and name == self._scenario.value:  # not changed meanwhile
                    self._board.draft, self._form = draft, ScenarioForm(draft)
                    await self._take_robot()

    async def _take_robot(self) -> bool:
        """Lets the next run be of the open robot, and says so; returns False if it cannot be."""
        draft = self._board.draft
        if draft is None:
            return False
        own, now = draft.own_robot, self._bench.subject
        subject = await run.io_bound(_subject_named, own)
        is_own, fits = subject is not None and not subject.is_another(now), True
        words = f"Runs {now.robot}, the robot that is open"
        try:
            draft.robot = own if is_own else robot_argument(self._bench)
            words += "." if is_own else f", instead of the scenario's {own}."
        except CdprError as problem:
            words, fits = f"Nothing can be started: {problem}.", False
        self._which.text, self._own.text = words, "" if is_own else f"Open {own}"
        return fits

    async def _open_own_robot(self) -> None:
        assert self._board.draft is not None
        opened = await run.io_bound(self._bench.files.open, self._board.draft.own_robot)
        if opened is not None:  # the server is not ending
            self._bench.take_opened(opened)

    async def _start(self) -> None:
        self._start_button.props("loading")
        with show_errors():
            async with self._placing:  # it may be on its way
                form = self._form
            if form is None:
                raise CdprError("there is no scenario to start; choose one that can be read")
            if await form.check():
                if not await self._take_robot():
                    raise CdprError(self._which.text)
                await self._board.simulate(paused=self._paused.value, by_hand=self._by_hand.value)
                self._refresh()
        self._start_button.props(remove="loading")

    def _choose_run(self) -> None:
        if self._run.value and self._run.value != self._board.shown:
            self._board.shown, self._board.cursor = str(self._run.value), None
            self._refresh()

    def _choose_other(self) -> None:
        self._board.compared = str(self._compare.value or "")

    def _recover(self) -> None:
        """Writes results of a run that was killed, as far as it was simulated."""
        job = self._board.job
        self._bench.jobs.submit(Job(["finish", str(job.folder), "--json"], job.working))

    async def _download(self) -> None:
        entry = self._board.entry
        if entry is not None:
            await send_file(entry.folder)

    async def _fill_results(self) -> None:
        entry = self._board.entry
        if self._fold.value and entry is not None and not self._results.default_slot.children:
            with self._results:
                await show_results(entry.folder)

    def _tick(self) -> None:
        """Shows what is new; many times a second."""
        board, shown, newest = self._board, self._board.run, self._plots.newest
        is_live = isinstance(shown, RunJob)
        if self._begun != (shown, shown.charts, board.other):
            self._begin()
        elif self._plots.is_ready or not is_live:
            if shown.samples and shown.samples[-1]["t"] > newest:
                new = (sample for sample in shown.samples if sample["t"] > newest)
                self._plots.put(list(map(plot_row, new)))
            self._look()
        if self._bench.panel not in ("", "run"):
            board.give_back()
        elif shown.scenario is not None and self._sample is not None:
            wait = min(SCENE_SHARE * self._plots.lag, RAREST_SCENE) if is_live else 0.0
            board.draw(shown, self._sample, wait)

    def _begin(self) -> None:
        """Shows all that is there, as after a change, or in a browser that shows it anew."""
        shown, other = self._board.run, self._board.other
        self._begun, self._sample = (shown, shown.charts, other), None
        if isinstance(shown, FinishedRun):
            self._slider.props(f"max={shown.end} step={max(shown.end / 2000.0, 1e-3)}")
        self._plots.begin(shown.charts, shown.end, [plot_row(sample) for sample in shown.samples])
        rows = [] if other is None else [plot_row(sample) for sample in other.samples]
        self._plots.run_method("compare", rows, "" if other is None else other.folder.name)
        self._both.visible = False
        if isinstance(shown, FinishedRun) and other is not None:
            self._both.visible = True
            both = run_pairs(shown.summary, other.summary)
            self._pairs.content = pair_table(both, shown.folder.name, other.folder.name)
        self._look()

    def _look(self) -> None:
        """Camera and plots show the time of the slider, or the newest that a run has shown."""
        shown = self._board.run
        sample, jpeg = shown.at(self._board.cursor)
        if jpeg is not self._jpeg:
            self._jpeg = jpeg
            self._image.props["src"] = f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"
        if sample is not None and sample is not self._sample and isinstance(shown, FinishedRun):
            self._time.text = f"{sample['t']:.2f} s"
            self._plots.run_method("cursor", sample["t"])
        self._sample = sample

    async def _slow_tick(self) -> None:
        board, results = self._board, self._bench.results
        await board.read(self._refresh())
        results.show(RUN, board.run.subject)
        results.show(COMPARED, board.other.subject if board.other else None)

    def _refresh(self) -> Entry | None:
        """Offers what runs there are, and shows the one looked at; returns the one behind it."""
        board = self._board
        choices = board.follow()
        offer(self._run, {key: entry.name for key, entry in choices.items()}, board.shown or None)
        whole = [key for key, entry in choices.items() if entry.is_whole and key != board.shown]
        others = {"": "none"} | {key: key for key in whole}
        offer(self._compare, others, board.compared if board.compared in others else "")
        if self._shown != board.looked_at:
            self._shown, self._fold.value = board.looked_at, False
            self._results.clear()
        job = board.job
        broken = {event.get("cable") for event in job.events}
        names = enumerate(job.header.get("cables", ()))
        left = {k: name for k, name in names if k not in broken}
        value = self._cable.value if self._cable.value in left else next(iter(left), None)
        offer(self._cable, left, value)
        is_endless = job.progress[0] is None
        if is_endless != self._bar.props.get("indeterminate", False):
            self._bar.props.set_bool("indeterminate", is_endless)
        return choices.get(board.compared)


def run_pairs(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[Pair]:
    """Numbers and words of two summaries of runs that at least one of them has."""

    def side(summary: Mapping[str, Any]) -> dict[str, Any]:
        own = {key: value for key, value in summary.items() if key not in OF_THE_PROGRAM}
        return {
            name: float(value) if isinstance(value, int) else value for name, value in leaves(own)
        }

    return pairs(side(one), side(other))


def _done_by_hand(job: RunJob) -> str:
    """What was done to a run, or refused."""
    return "; ".join(
        f"{event['t']:.2f} s: {event.get('words') or 'refused: ' + event['refused']}"
        for event in job.events
    )


def _subject_named(robot: str) -> Subject | None:
    """What a robot is to results, by its name or file; None: it cannot be read."""
    with suppress(CdprError, OSError):
        return subject_of(load_robot(robot))
    return None

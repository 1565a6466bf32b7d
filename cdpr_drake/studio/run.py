"""The run panel: a scenario's form, its run while it goes on, and finished ones."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from weakref import WeakKeyDictionary

from nicegui import run, ui

from cdpr_drake.analyses.runs.log import PARTS
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.jobs import JobState
from cdpr_drake.studio.panel import COMPARED, RUN, on_page, robot_argument, show_errors
from cdpr_drake.studio.results import Subject, subject_of
from cdpr_drake.studio.run_board import RunBoard, RunEntry
from cdpr_drake.studio.scenario import ScenarioForm
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.views import send_file
from cdpr_drake.studio.watch import RunWatch, SceneOfRuns, SteeringBar
from cdpr_drake.systems.scenarios.files import robot_scenario_names
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO

STYLE = Path(__file__).with_suffix(".css").read_text(encoding="utf-8")

TICK, SLOW_TICK = 1.0 / 30.0, 0.5
"""Times between looks at a run, and at jobs and folders [s]."""

SPANS = {"all": None, "last 5 s": 5.0, "last 20 s": 20.0}
"""Times that plots show."""

NOTHING = "none"

EMPTY = (
    "No run is shown. Choose a scenario and press Start to simulate the open robot, or choose one "
    "of the runs in the working folder."
)

_boards: WeakKeyDictionary[Workbench, RunBoard] = WeakKeyDictionary()
_scenes: WeakKeyDictionary[Workbench, SceneOfRuns] = WeakKeyDictionary()
"""What each session looks at, as long as it has a workbench."""


def run_panel(bench: Workbench) -> None:
    """Places the run panel."""
    board = _boards.setdefault(bench, RunBoard(bench.jobs, bench.folder.root))
    RunPanel(bench, board, _scenes.setdefault(bench, SceneOfRuns(bench)))


class RunPanel:
    """The panel in one tab of a browser."""

    def __init__(self, bench: Workbench, board: RunBoard, scene: SceneOfRuns) -> None:
        """Places it into the current slot."""
        self._bench, self._board, self._scene = bench, board, scene
        self._form: ScenarioForm | None = None
        self._key = self._other = ""
        self._shipped: frozenset[str] = frozenset()
        self._read = asyncio.Event()  # set while the chosen scenario has been read
        self._refused: CdprError | None = None
        self._names: dict[str, str] = {}
        self._stamps: dict[str, str] = {}
        ui.add_css(STYLE)
        with ui.element("div").classes("cdpr-run"):
            self._place_start()
            self._place_watch()
        with ui.expansion("Fields of the scenario", value=True).classes("w-full"):
            self._body = ui.element("div")
        ui.timer(0.0, self._begin, once=True)
        on_page(bench.robot.changed, self._robot_changed)
        ui.timer(TICK, self._tick)
        ui.timer(SLOW_TICK, self._slow_tick)

    def _place_start(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            self._scenario = ui.select([], label="scenario", with_input=True)
            self._scenario.props("dense outlined").classes("col").mark("scenario")
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

    def _place_watch(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            self._run = ui.select({}, label="run", on_change=self._choose_run)
            self._run.props("dense outlined").classes("col").mark("run")
            self._bar = SteeringBar(self._board, lambda: self._watch.job if self._key else None)
        self._empty = ui.label(EMPTY).classes("studio-empty").mark("run-empty")
        self._watch = RunWatch(self._board, self._scene)
        with ui.row().classes("w-full items-center"):
            self._compare = ui.select({NOTHING: NOTHING}, value=NOTHING, label="compare with")
            self._compare.props("dense outlined").classes("cdpr-compare").mark("compare")
            self._compare.on_value_change(self._choose_other)
            span = ui.select(list(SPANS), value="all", label="time shown").props("dense outlined")
            span.on_value_change(lambda: self._watch.show_span(SPANS[str(span.value)]))
            ui.space()
            self._recover = ui.button("Write the results so far", on_click=self._recover_run)
            self._recover.props("no-caps outline").mark("recover")
            self._download = ui.button("Download", icon="download", on_click=self._send_all)
            self._download.props('no-caps outline title="All files of the run"').mark("download")
        self._download.visible = self._recover.visible = False

    async def _begin(self) -> None:
        """Offers scenarios, those of the working folder first."""
        shipped = await run.io_bound(robot_scenario_names)
        if shipped is None:  # the server is ending
            return
        self._shipped = frozenset(shipped)
        folder, draft = self._bench.folder, self._board.draft
        options = [*folder.files((".yaml", ".yml")), *shipped]
        names = [
            name for name in ("" if draft is None else draft.name, self._bench.scenario) if name
        ]
        known = (option for name in names for option in (name, folder.shown(Path(name).resolve())))
        value = next((option for option in known if option in options), DEFAULT_SCENARIO)
        self._scenario.set_options(options, value=value)

    async def _choose_scenario(self) -> None:
        """Shows the form of another scenario; `Start` waits for it."""
        name = self._scenario.value
        if not name:
            return
        self._body.clear()
        self._form = None
        self._read.clear()
        try:
            with self._body, show_errors():
                ui.spinner(size="lg")
                file = name if name in self._shipped else str(self._bench.folder.path(name))
                draft = await run.io_bound(self._board.choose, file)
                if draft is not None and name == self._scenario.value:  # not changed meanwhile
                    self._body.clear()
                    self._form = ScenarioForm(draft)
                    await self._take_robot()
        finally:
            if name == self._scenario.value:
                self._read.set()
                if self._form is None:
                    self._body.clear()

    async def _robot_changed(self) -> None:
        with show_errors():
            await self._take_robot()

    async def _take_robot(self) -> None:
        """Lets the next run be of the robot that is open, and says so."""
        draft = self._board.draft
        if draft is None:
            return
        own, now = draft.own_robot, self._bench.subject
        own_subject = await run.io_bound(_subject_named, own)
        self._refused, is_own = None, own_subject is not None and not own_subject.is_another(now)
        words = f"Runs {now.robot}, the robot that is open"
        try:
            draft.robot = own if is_own else robot_argument(self._bench)
            words += "." if is_own else f", instead of the scenario's {own}."
        except CdprError as problem:
            self._refused, words = problem, f"Nothing can be started: {problem}."
        self._which.text, self._own.text = words, f"Open {own}"
        self._own.set_visibility(not is_own)

    async def _open_own_robot(self) -> None:
        with show_errors():
            if self._board.draft is not None:
                opened = await run.io_bound(self._bench.files.open, self._board.draft.own_robot)
                if opened is not None:  # the server is not ending
                    self._bench.take_opened(opened)

    async def _start(self) -> None:
        self._start_button.props("loading")
        try:
            await self._read.wait()
            if self._form is not None and await self._form.check():
                with show_errors():
                    await self._take_robot()
                    if self._refused is not None:
                        raise self._refused
                    paused, by_hand = bool(self._paused.value), bool(self._by_hand.value)
                    await self._board.start(paused=paused, by_hand=by_hand)
                    self._refresh_runs()
        finally:
            self._start_button.props(remove="loading")

    def _choose_run(self) -> None:
        if self._run.value and self._run.value != self._key:
            self._board.shown, self._board.cursor = str(self._run.value), None
            self._refresh_runs()

    async def _choose_other(self) -> None:
        self._board.compared = "" if self._compare.value == NOTHING else str(self._compare.value)
        await self._show_other()

    async def _show_other(self) -> None:
        self._other = self._board.compared
        await self._watch.compare(self._board.run(self._other) if self._other else None)

    def _recover_run(self) -> None:
        with show_errors():
            if self._watch.job is not None:
                self._board.recover(self._watch.job)

    async def _send_all(self) -> None:
        if self._watch.entry is not None:
            await send_file(self._watch.entry.folder)

    def _tick(self) -> None:
        with show_errors():
            self._watch.tick()

    async def _slow_tick(self) -> None:
        with show_errors():
            self._refresh_runs()
            await self._watch.tick_slowly()
            await self._say_subjects()
            if self._board.compared != self._other:
                self._compare.value = self._board.compared or NOTHING
                await self._show_other()
            if self._bench.panel not in ("", "run"):
                self._scene.give_back()
            elif self._scene.was_missed:
                self._watch.draw_again()

    async def _say_subjects(self) -> None:
        """Says of which robots the runs are that are shown."""
        board, choices = self._board, self._board.choices()
        for name, key in ((RUN, board.shown), (COMPARED, board.compared)):
            entry = choices.get(key)
            stamp = f"{key} {'' if entry is None else entry.folder.is_dir()}"
            if self._stamps.get(name) != stamp:
                self._stamps[name] = stamp
                robot = None if entry is None else await run.io_bound(_robot_of, entry)
                self._bench.results.show(name, None if robot is None else subject_of(robot))

    def _offer_others(self, choices: Mapping[str, RunEntry]) -> None:
        """Offers all finished runs to be compared with, but the one that is shown."""
        board = self._board
        if board.compared == board.shown:
            board.compared = ""
        others = {NOTHING: NOTHING} | {
            key: entry.folder.name for key, entry in choices.items()
            if key != board.shown and (entry.job is None or entry.job.state == JobState.FINISHED)
        }  # fmt: skip
        if others != self._compare.options:
            value = self._compare.value if self._compare.value in others else NOTHING
            self._compare.set_options(others, value=value)

    def _refresh_runs(self) -> None:
        """Offers the runs that there are, and shows the one that the session looks at."""
        board = self._board
        choices = board.choices()
        board.look_at_newest(choices)
        names = {key: entry.name for key, entry in choices.items()}
        if names != self._names:
            self._names = names
            self._run.set_options(names, value=board.shown or None)
        self._offer_others(choices)
        chosen = choices.get(board.shown)
        job = None if chosen is None else chosen.job
        if board.shown != self._key or job is not self._watch.job:  # one after another in a folder
            self._key = board.shown
            self._run.value = board.shown or None
            self._watch.show(chosen)
        self._bar.refresh()
        self._empty.set_visibility(not board.shown)
        entry = self._watch.entry
        self._download.set_visibility(entry is not None and entry.folder.is_dir())
        failed = job is not None and job.state == JobState.FAILED
        self._recover.set_visibility(failed and entry is not None and _left_log(entry.folder))


def _left_log(folder: Path) -> bool:
    """True if a run that was killed left the log of what it had simulated."""
    return (folder / PARTS).is_dir()


def _robot_of(entry: RunEntry) -> Robot | None:
    """The robot of a run; None: it cannot be read any more."""
    with suppress(CdprError, OSError):
        scenario = entry.scenario()
        return None if scenario is None else load_robot(scenario.robot)
    return None


def _subject_named(robot: str) -> Subject | None:
    """What a robot is to results, by its name or file; None: it cannot be read."""
    with suppress(CdprError, OSError):
        return subject_of(load_robot(robot))
    return None

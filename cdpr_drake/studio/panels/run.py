"""The run panel: a scenario's form, its run while it goes on, and finished ones."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Any
from weakref import WeakKeyDictionary, ref

from nicegui import run, ui

from cdpr_drake.analyses.runs.log import PARTS
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.panels.hand_bar import HandBar
from cdpr_drake.studio.panels.live_bar import SteeringBar
from cdpr_drake.studio.panels.panel import on_page, robot_argument, show_errors
from cdpr_drake.studio.panels.result_names import COMPARED, RUN
from cdpr_drake.studio.panels.run_watch import RUN_STYLE, RunWatch
from cdpr_drake.studio.panels.scenario_form import ScenarioForm
from cdpr_drake.studio.scene import RobotScene, RunScene
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.workbench.finished_run import zipped
from cdpr_drake.studio.workbench.job import JobState
from cdpr_drake.studio.workbench.result_subject import Subject, subject_of
from cdpr_drake.studio.workbench.run_board import RunBoard, RunEntry
from cdpr_drake.studio.workbench.run_job import RunJob
from cdpr_drake.studio.workbench.scenario_draft import ROBOT
from cdpr_drake.systems.scenarios.files import robot_scenario_names
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO

TICK = 1.0 / 30.0
"""Time between looks at a run [s]."""

SLOW_TICK = 0.5
"""Time between looks at jobs and folders [s]."""

SPANS = {"all": None, "last 5 s": 5.0, "last 20 s": 20.0}
"""Times that plots show."""

NOTHING = "none"

EMPTY = (
    "No run is shown. Choose a scenario and press Start to simulate the open robot, or choose one "
    "of the runs in the working folder."
)


class SceneOfRuns:
    """Draws runs into a workbench's scene, the newest sample when the last one is drawn.

    Attributes:
        was_missed: Whether a run is not in the scene because another panel is, or was, shown.
    """

    def __init__(self, bench: Workbench) -> None:
        """For the scene of a workbench, which is not touched yet."""
        self._bench = ref(bench)  # which this is kept by
        self._scene: RunScene | None = None
        self._of: Path | None = None
        self._busy, self._drawn, self.was_missed = False, 0.0, False
        self._next: tuple[RunEntry, Mapping[str, Any], float] | None = None

    def draw(self, shown: RunEntry, sample: Mapping[str, Any], wait: float) -> None:
        """Draws a sample of a run, unless one was drawn less than `wait` before [s]."""
        bench = self._bench()
        if bench is None or bench.panel not in ("", "run"):
            self.was_missed = True
            return
        if self._busy:
            self._next = (shown, sample, wait)
            return
        if monotonic() - self._drawn < wait:
            return
        self._busy, self._next, self.was_missed = True, None, False
        dark = bool(bench.dark)
        bench.draw(lambda scene: self._work(scene, shown, sample, dark), self._done)

    def _work(
        self, scene: RobotScene, shown: RunEntry, sample: Mapping[str, Any], dark: bool
    ) -> None:
        if self._scene is None or self._of != shown.folder:
            scenario = shown.scenario()
            if scenario is None:
                return
            self._scene, self._of = RunScene(scene.meshcat, scenario), shown.folder
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
        """Lets the robot that is worked on be shown again."""
        bench = self._bench()
        if self._scene is not None and bench is not None:
            self._scene = self._of = None
            self.was_missed = True
            bench.draw(lambda scene: scene.redraw())
            bench.draws(None)
            bench.ask()


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
        self._read = asyncio.Event()  # whether the scenario that is chosen has been read
        self._refused: CdprError | None = None
        self._names: dict[str, str] = {}
        self._told: dict[str, str] = {}
        ui.add_css(RUN_STYLE)
        with ui.element("div").classes("cdpr-run"):
            self._place_start()
            self._place_watch()
        with ui.expansion("Fields of the scenario", value=True).classes("w-full"):
            self._body = ui.element("div")
        ui.timer(0.0, self._begin, once=True)
        on_page(bench.robot.changed, self._robot_changed)
        ui.timer(TICK, self._tick)
        ui.timer(SLOW_TICK, self._slow_tick)
        ui.context.client.on_delete(self._watch.forget)

    def _place_start(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            self._scenario = ui.select([], label="scenario", with_input=True)
            self._scenario.props("dense outlined").classes("col").mark("scenario")
            self._scenario.on_value_change(self._choose_scenario)
            self._paused = ui.checkbox("paused").mark("paused")
            self._paused.props('title="Stands at the start"')
            self._by_hand = ui.checkbox("by hand").mark("by-hand")
            self._by_hand.props('title="Cables can be broken and the platform pushed"')
            start = ui.button("Start", icon="play_circle", on_click=self._start).mark("start")
            start.props("no-caps")

        with ui.row().classes("w-full items-center no-wrap"):
            self._which = ui.label().classes("studio-soft").mark("run-robot")
            self._own = ui.button(on_click=self._open_own_robot).mark("open-own-robot")
            self._own.props("dense no-caps outline")

    def _place_watch(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            self._run = ui.select({}, label="run", on_change=self._choose_run)
            self._run.props("dense outlined").classes("col").mark("run")
            self._bar = SteeringBar(self._board, lambda: self._watch.job if self._key else None)
        self._hands = HandBar(lambda: self._watch.job if self._key else None)
        self._empty = ui.label(EMPTY).classes("studio-empty").mark("run-empty")
        self._watch = RunWatch(self._board, self._scene.draw)
        with ui.row().classes("w-full items-center"):
            self._compare = ui.select({NOTHING: NOTHING}, value=NOTHING, label="compare with")
            self._compare.props("dense outlined").classes("cdpr-compare").mark("compare")
            self._compare.on_value_change(self._choose_other)
            span = ui.select(list(SPANS), value="all", label="time shown").props("dense outlined")
            span.on_value_change(lambda: self._watch.show_span(SPANS[str(span.value)]))
            ui.space()
            self._recover = ui.button("Results of what there is", on_click=self._recover_run)
            self._recover.props("no-caps outline").mark("recover")
            self._recover.visible = False
            self._download = ui.button("Download", icon="download", on_click=self._send_all)
            self._download.props('no-caps outline title="All files of the run"').mark("download")
        self._download.visible = False

    async def _begin(self) -> None:
        """Offers scenarios, which are read in another thread, as all files here are."""
        shipped = await run.io_bound(robot_scenario_names)
        if shipped is None:  # the server is ending
            return
        self._shipped = frozenset(shipped)
        options = [*shipped, *self._bench.folder.files((".yaml", ".yml"))]
        wanted = self._chosen(options) or DEFAULT_SCENARIO
        if self._board.draft is not None and self._shown_name() in options:
            wanted = self._shown_name()
        self._scenario.set_options(options, value=wanted)

    def _shown_name(self) -> str:
        """The draft's scenario as the list has it."""
        draft = self._board.draft
        if draft is None:
            return ""
        path = Path(draft.name)
        return self._bench.folder.shown(path) if path.is_absolute() else draft.name

    def _chosen(self, options: list[str]) -> str:
        """The scenario that the workbench has, as the list has it; empty: none of these."""
        name = self._bench.scenario
        if name in options:
            return name
        file = self._bench.folder.shown(Path(name).resolve()) if name else ""
        return file if file in options else ""

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
                file = name if name in self._shipped else str(self._bench.folder.path(name))
                draft = await run.io_bound(self._board.choose, file)
                if draft is None or name != self._scenario.value:  # another was chosen meanwhile
                    return
                self._form = ScenarioForm(draft)
                await self._take_robot()
        finally:
            if name == self._scenario.value:
                self._read.set()

    async def _robot_changed(self) -> None:
        with show_errors():
            await self._take_robot()

    async def _take_robot(self) -> None:
        """Lets the next run be of the robot that is open, and says so."""
        draft = self._board.draft
        if draft is None:
            return
        own = draft.own_robot
        own_subject = await run.io_bound(_subject_named, own)
        now, self._refused = self._bench.subject, None
        if own_subject is not None and not own_subject.is_another(now):
            draft.change(ROBOT, own)
            self._say_robot(f"Runs {now.robot}, the robot that is open.")
            return
        words = f"Runs {now.robot}, the robot that is open, in the place of the scenario's {own}."
        try:
            draft.change(ROBOT, robot_argument(self._bench))
        except CdprError as problem:
            self._refused = problem
            words = f"Nothing can be started: {problem}."
        self._say_robot(words, own)

    def _say_robot(self, words: str, own: str = "") -> None:
        self._which.text, self._own.text = words, f"Open {own}"
        self._own.set_visibility(bool(own))

    async def _open_own_robot(self) -> None:
        with show_errors():
            if self._board.draft is not None:
                own = self._board.draft.own_robot
                opened = await run.io_bound(self._bench.files.open, own)
                if opened is not None:  # the server is not ending
                    self._bench.take_opened(opened)

    async def _start(self) -> None:
        await self._read.wait()
        if self._form is None or not await self._form.check():
            return
        with show_errors():
            await self._take_robot()
            if self._refused is not None:
                raise self._refused
            paused, by_hand = bool(self._paused.value), bool(self._by_hand.value)
            await run.io_bound(lambda: self._board.start(paused=paused, by_hand=by_hand))
            self._refresh_runs()

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
        job = self._watch.job
        if job is not None:
            with show_errors():
                self._board.recover(job)

    async def _send_all(self) -> None:
        shown = self._watch.shown
        if shown is None:
            return
        with show_errors():
            data = await run.io_bound(_packed, shown.folder)
            if data is not None:
                ui.download(data, f"{shown.folder.name}.zip", "application/zip")

    def _tick(self) -> None:
        with show_errors():
            self._watch.tick()

    async def _slow_tick(self) -> None:
        with show_errors():
            self._refresh_runs()
            await self._watch.load_finished()
            self._watch.follow_cursor()
            await self._tell_subjects()
            if self._board.compared != self._other:
                self._compare.value = self._board.compared or NOTHING
                await self._show_other()
            if self._bench.panel not in ("", "run"):
                self._scene.give_back()
            elif self._scene.was_missed:
                self._watch.draw_again()

    async def _tell_subjects(self) -> None:
        """Says which robots the runs are of that are looked at."""
        board, choices = self._board, self._board.choices()
        for name, key in ((RUN, board.shown), (COMPARED, board.compared)):
            shown = choices.get(key)
            stamp = f"{key} {'' if shown is None else shown.folder.is_dir()}"
            if self._told.get(name) == stamp:
                continue
            self._told[name] = stamp
            robot = None if shown is None else await run.io_bound(_robot_of, shown)
            self._bench.results.show(name, None if robot is None else subject_of(robot))

    def _offer_others(self, choices: Mapping[str, RunEntry]) -> None:
        """Offers all finished runs to be compared with, but the one that is looked at."""
        board = self._board
        if board.compared == board.shown:
            board.compared = ""
        offered = {NOTHING: NOTHING} | {
            key: shown.folder.name for key, shown in choices.items()
            if key != board.shown and (shown.job is None or shown.job.state == JobState.FINISHED)
        }  # fmt: skip
        if offered != self._compare.options:
            kept = self._compare.value if self._compare.value in offered else NOTHING
            self._compare.set_options(offered, value=kept)

    def _refresh_runs(self) -> None:
        """Offers the runs that there are, and looks at the one that the session looks at."""
        board = self._board
        choices = board.choices()
        board.look_at_newest(choices)
        names = {key: shown.name for key, shown in choices.items()}
        if names != self._names:
            self._names = names
            self._run.set_options(names, value=board.shown or None)
        self._offer_others(choices)
        if board.shown != self._key:
            self._key = board.shown
            self._run.value = board.shown or None
            self._watch.show(choices.get(board.shown))
        self._bar.refresh()
        self._hands.refresh()
        self._empty.set_visibility(not board.shown)
        shown = self._watch.shown
        there = shown is not None and shown.folder.is_dir()
        if self._download.visible != there:
            self._download.visible = there
        job = self._watch.job
        failed = job is not None and job.state == JobState.FAILED and _left_log(job)
        if self._recover.visible != failed:
            self._recover.visible = failed


def _robot_of(shown: RunEntry) -> Robot | None:
    """The robot of a run; None: it cannot be read any more."""
    with suppress(CdprError, OSError):
        scenario = shown.scenario()
        return None if scenario is None else load_robot(scenario.robot)
    return None


def _left_log(job: RunJob) -> bool:
    """True if a run that was killed left the log of what it had simulated."""
    return job.folder is not None and (job.folder / PARTS).is_dir()


def _subject_named(robot: str) -> Subject | None:
    """What a robot is to results, by its name or file; None: it cannot be read."""
    with suppress(CdprError, OSError):
        return subject_of(load_robot(robot))
    return None


def _packed(folder: Path) -> bytes:
    with tempfile.TemporaryFile() as file:
        zipped(folder, file)
        file.seek(0)
        return file.read()

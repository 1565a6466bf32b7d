"""The run panel: a scenario's form, its run while it goes on, and finished ones."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from weakref import WeakKeyDictionary

from nicegui import run, ui

from cdpr_drake.analyses.runs.log import PARTS
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.jobs import Job, JobState
from cdpr_drake.studio.panel import COMPARED, RUN, robot_argument, show_errors
from cdpr_drake.studio.results import Subject, subject_of
from cdpr_drake.studio.runs import RunBoard
from cdpr_drake.studio.scenario import ScenarioDraft, ScenarioForm
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.views import send_file
from cdpr_drake.studio.watch import RunWatch
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
"""What each session looks at, as long as it has a workbench."""


def run_panel(bench: Workbench) -> None:
    """Places the run panel."""
    RunPanel(bench, _boards.setdefault(bench, RunBoard(bench.jobs, bench.folder.root)))


class RunPanel:
    """The panel in one tab of a browser."""

    def __init__(self, bench: Workbench, board: RunBoard) -> None:
        """Places it into the current slot."""
        self._bench, self._board = bench, board
        self._form: ScenarioForm | None = None
        self._watch = RunWatch(bench, board)
        ui.add_css(STYLE)
        with ui.element("div").classes("cdpr-run"):
            self._place_start()
            self._place_watch()
        with ui.expansion("Fields of the scenario", value=True).classes("w-full"):
            self._body = ui.element("div")
        ui.timer(0.0, self._begin, once=True)
        bench.robot.changed.subscribe(self._take_robot)
        ui.timer(TICK, self._tick)
        ui.timer(SLOW_TICK, self._slow_tick)

    def _place_start(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            self._scenario = ui.select({}, label="scenario", with_input=True)
            self._scenario.props("dense outlined").classes("col").mark("scenario")
            self._scenario.on_value_change(self._choose_scenario)
            self._paused = ui.checkbox("start paused").mark("paused")
            self._by_hand = ui.checkbox("break and push by hand").mark("by-hand")
            self._by_hand.props('title="Cables can be broken and the platform pushed"')
            self._start_button = ui.button("Start", icon="play_circle", on_click=self._start)
            self._start_button.props("no-caps").mark("start")
            self._start_button.bind_enabled_from(self, "_form", lambda form: form is not None)
        with ui.row().classes("w-full items-center no-wrap"):
            self._which = ui.label().classes("studio-soft").mark("run-robot")
            self._own = ui.button(on_click=self._open_own_robot).mark("open-own-robot")
            self._own.props("dense no-caps outline")
            self._own.visible = False  # until the scenario says of which robot it is

    def _place_watch(self) -> None:
        board, watch = self._board, self._watch
        with ui.row().classes("w-full items-center no-wrap"):
            self._run = ui.select({}, label="run", on_change=self._choose_run)
            self._run.props("dense outlined").classes("col").mark("run")
            watch.place_steering()
        empty = ui.label(EMPTY).classes("studio-empty").mark("run-empty")
        empty.bind_visibility_from(board, "shown", lambda key: not key)
        watch.place()
        with ui.row().classes("w-full items-center"):
            self._compare = ui.select({NOTHING: NOTHING}, value=NOTHING, label="compare with")
            self._compare.props("dense outlined").classes("cdpr-compare").mark("compare")
            self._compare.on_value_change(self._choose_other)
            span = ui.select(list(SPANS), value="all", label="time shown").props("dense outlined")
            span.on_value_change(lambda: watch.show_span(SPANS[str(span.value)]))
            ui.space()
            recover = ui.button("Write the results so far", on_click=self._recover)
            recover.props("no-caps outline").mark("recover")
            recover.bind_visibility_from(watch, "files", self._can_recover)
            download = ui.button("Download", icon="download", on_click=self._download)
            download.props('no-caps outline title="All files of the run"').mark("download")
            download.bind_visibility_from(watch, "files", bool)

    async def _begin(self) -> None:
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
        name, self._form = self._scenario.value, None

        def read() -> ScenarioDraft:
            folder, draft = self._bench.folder, self._board.draft
            file = str(folder.path(name)) if Path(name).is_absolute() else name
            return draft if draft and draft.name == file else ScenarioDraft(file, folder.root)

        self._body.clear()
        with self._body:
            spinner = ui.spinner(size="lg")
            with show_errors():
                draft = await run.io_bound(read)
                if draft is not None and name == self._scenario.value:  # not changed meanwhile
                    self._board.draft, form = draft, ScenarioForm(draft)
                    await self._take_robot()
                    self._form = form
            spinner.delete()

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
        self._which.text, self._own.text = words, f"Open {own}"
        self._own.visible = not is_own
        return fits

    async def _open_own_robot(self) -> None:
        with show_errors():
            assert self._board.draft is not None
            opened = await run.io_bound(self._bench.files.open, self._board.draft.own_robot)
            if opened is not None:  # the server is not ending
                self._bench.take_opened(opened)

    async def _start(self) -> None:
        self._start_button.props("loading")
        with show_errors():
            if self._form is not None and await self._form.check():
                if not await self._take_robot():
                    raise CdprError(self._which.text)
                await self._board.start(paused=self._paused.value, by_hand=self._by_hand.value)
                self._refresh()
        self._start_button.props(remove="loading")

    def _choose_run(self) -> None:
        if self._run.value and self._run.value != self._board.shown:
            self._board.shown, self._board.cursor = str(self._run.value), None
            self._refresh()

    def _choose_other(self) -> None:
        self._board.compared = "" if self._compare.value == NOTHING else str(self._compare.value)

    def _can_recover(self, files: frozenset[str]) -> bool:
        """True if a run that was killed left the log of what it had simulated."""
        return self._watch.job.state == JobState.FAILED and PARTS in files

    def _recover(self) -> None:
        """Writes results of a run that was killed, as far as it was simulated."""
        job = self._watch.job
        words, title = (
            ["finish", str(job.folder), "--json"],
            f"{job.title}: results of what there is",
        )
        with show_errors():
            self._bench.jobs.submit(Job(title, words, job.working, job.folder))

    async def _download(self) -> None:
        if self._watch.entry is not None:
            await send_file(self._watch.entry.folder)

    def _tick(self) -> None:
        with show_errors():
            self._watch.tick()

    async def _slow_tick(self) -> None:
        board, watch = self._board, self._watch
        with show_errors():
            self._refresh()
            await watch.follow()
            await watch.compare(board.choices().get(board.compared))
            self._bench.results.show(RUN, watch.run.subject)
            self._bench.results.show(COMPARED, watch.other.subject if watch.other else None)

    def _refresh(self) -> None:
        """Offers the runs that there are, and shows the one that the session looks at."""
        board, choices = self._board, self._board.choices()
        if board.shown not in choices:
            board.shown = next((key for key, entry in choices.items() if entry.job), "")
        if board.compared == board.shown:
            board.compared = ""
        _offer(self._run, {key: entry.name for key, entry in choices.items()}, board.shown or None)
        others = {NOTHING: NOTHING} | {
            key: entry.folder.name for key, entry in choices.items()
            if key != board.shown and (entry.job is None or entry.job.state == JobState.FINISHED)
        }  # fmt: skip
        _offer(self._compare, others, board.compared if board.compared in others else NOTHING)
        self._watch.show(choices.get(board.shown))


def _offer(select: ui.select, options: Mapping[str, str], value: str | None) -> None:
    """Changes options only where they are others: that closes a list that is unfolded."""
    if select.options != options:
        select.set_options(dict(options), value=value)
    select.value = value


def _subject_named(robot: str) -> Subject | None:
    """What a robot is to results, by its name or file; None: it cannot be read."""
    with suppress(CdprError, OSError):
        return subject_of(load_robot(robot))
    return None

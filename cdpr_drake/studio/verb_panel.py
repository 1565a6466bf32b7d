"""A panel of verbs: the form of one, its start, and the results that there are of all.

The tabs Workspace, Logs, Studies and Commands are such panels.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from weakref import WeakKeyDictionary

from nicegui import run, ui

from cdpr_drake.studio.boards import Board, Entry
from cdpr_drake.studio.jobs import Job, JobState
from cdpr_drake.studio.panel import notify, robot_argument, show_errors
from cdpr_drake.studio.results import Subject
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.verb_form import FieldProblem, Filled, VerbForm
from cdpr_drake.studio.views import View, read_results

TICK = 0.5
"""Time between looks at jobs and folders [s]."""

ROBOT = "robot"
"""The option that the open robot is given to, where a verb needs one."""


@dataclass(frozen=True)
class VerbTab:
    """What a panel of verbs is about.

    Attributes:
        folder: Folder of its results in the working folder; also of its marks.
        result: Name of what it shows among `Workbench.results`.
        empty: What is said where there is no result yet.
        verbs: Names of its verbs; empty: all that there are.
        first: Keys of options that are shown unfolded, by verb.
        start: Words of the button.
    """

    folder: str
    result: str
    empty: str
    verbs: tuple[str, ...] = ()
    first: Mapping[str, Sequence[str]] = field(default_factory=dict)
    start: str = "Start"


class VerbView:
    """What a session sees of a panel of verbs, in all its tabs.

    Attributes:
        board: Commands and their results.
        filled: What was filled into the forms.
        verb: Name of the verb whose form is shown.
    """

    def __init__(self, bench: Workbench, tab: VerbTab) -> None:
        """For a workbench."""
        self.board = Board(bench.jobs, bench.folder.root, tab.folder)
        self.filled: Filled = {}
        self.verb = next(iter(tab.first or tab.verbs or bench.commands))


_views: WeakKeyDictionary[Workbench, dict[str, VerbView]] = WeakKeyDictionary()


def view_of(bench: Workbench, tab: VerbTab) -> VerbView:
    """What a session sees of a tab, as long as it has a workbench."""
    views = _views.setdefault(bench, {})
    return views.setdefault(tab.folder, VerbView(bench, tab))


class VerbPanel:
    """The panel in one tab of a browser."""

    def __init__(
        self, bench: Workbench, tab: VerbTab, *,
        given: Callable[[], Mapping[str, str]] = dict,
        show: Callable[[View], Awaitable[None] | None] = View.place,
    ) -> None:  # fmt: skip
        """Places it into the current slot.

        Args:
            bench: The workbench.
            tab: What it is about.
            given: Values of options beside those of the form, by key, which then has no inputs for
                them; called when the form is placed, and when the verb starts.
            show: Places results into the current slot.
        """
        self._bench, self._tab, self.view = bench, tab, view_of(bench, tab)
        self._given, self._show = given, show
        self._form: VerbForm | None = None
        self._job: Job | None = None
        self._shown: tuple[Path | None, float] = None, 0.0
        self._verbs = {name: bench.commands[name] for name in tab.verbs or bench.commands}
        titles = {name: f"{name}: {verb.line}" for name, verb in self._verbs.items()}
        with ui.row().classes("w-full items-center no-wrap"):
            choice = ui.select(titles, value=self.view.verb, label="what", with_input=not tab.verbs)
            choice.props("dense outlined").classes("col").mark(f"verb-{tab.folder}")
            choice.set_visibility(len(titles) > 1)
            self.start = ui.button(tab.start, icon="play_circle", on_click=self._start)
            self.start.props("no-caps").mark(f"start-{tab.folder}")
        self._fields = ui.element("div").classes("w-full")
        self._place_bar()
        self._empty = ui.label(tab.empty).classes("studio-empty").mark(f"{tab.folder}-empty")
        self._body = ui.element("div").classes("w-full").mark(f"{tab.folder}-shown")
        choice.on_value_change(lambda: self._place_form(choice.value))
        ui.timer(0.0, lambda: self._place_form(self.view.verb), once=True)
        ui.timer(TICK, self._tick)

    def _place_bar(self) -> None:
        """Which results are looked at, how far the command is, and what it may be asked for."""
        mark = self._tab.folder
        with ui.row().classes("w-full items-center no-wrap"):
            self._choice = ui.select({}, label="results", on_change=self._choose)
            self._choice.props("dense outlined").classes("col").mark(f"{mark}-results")
            self._stop = ui.button(icon="stop", on_click=self._ask_to_stop).mark(f"{mark}-stop")
            self._stop.props('dense aria-label="Stop" title="Stop; what is finished is kept"')
            self._go_on = ui.button("Continue", on_click=self._ask_to_go_on)
            self._go_on.props('dense no-caps outline title="Goes on where it was stopped"')
            self._go_on.mark(f"{mark}-continue")
        self._progress = ui.linear_progress(show_value=False).props("size=8px")
        self._state = ui.label().classes("studio-soft").props('role="status"').mark(f"{mark}-state")

    async def _place_form(self, name: str | None) -> None:
        """Imports a verb in another thread, and places its form."""
        if not name:
            return
        self.view.verb, self._form, verb = name, None, self._verbs[name]
        folder = self._bench.folder
        self._fields.clear()
        with self._fields, show_errors():
            sign = ui.spinner()
            read = await run.io_bound(lambda: (verb.options, folder.files((".yaml", ".yml"))))
            if read is None or name != self.view.verb:  # the server is ending, or another verb
                return
            options, files = read
            sign.delete()
            needed = [ROBOT] if ROBOT in options and options[ROBOT].required else []
            self._form = VerbForm(
                verb, self.view.filled, folder, files,
                first=self._tab.first.get(name, ()), without=[*needed, *self._given()],
            )  # fmt: skip

    async def _start(self) -> None:
        with show_errors(), suppress(FieldProblem):  # which a field says
            if self._form is None:
                return
            form, bench, given, about = self._form, self._bench, dict(self._given()), {}
            names = [_stem(value) for value in given.values()]
            if ROBOT in form.verb.options and form.verb.options[ROBOT].required:
                given[ROBOT], now = robot_argument(bench), bench.subject
                about = {"robot": now.robot, "digest": now.digest}
                names.append(now.robot)
            words = await form.words(given)
            if len(self._tab.verbs) != 1:
                names.append(form.verb.title)
            name = "-".join(names) or _stem(words[-1])
            self._job = await self.view.board.start(form.verb, words, name, about)
            self._refresh()

    def _choose(self) -> None:
        if self._choice.value and self._choice.value != self.view.board.shown:
            self.open(str(self._choice.value))

    def open(self, key: str) -> None:
        """Looks at the results of a key."""
        self.view.board.shown = key
        self._refresh()

    def _ask_to_stop(self) -> None:
        entry = self.view.board.shown_entry()
        if entry is not None and entry.job is not None:
            entry.job.stop()
        self._refresh()

    async def _ask_to_go_on(self) -> None:
        with show_errors():
            entry = self.view.board.shown_entry()
            if entry is not None:
                await self.view.board.go_on(entry, self._verbs, self._bench.folder)
            self._refresh()

    def _refresh(self) -> Entry | None:
        """Follows jobs and folders; returns what is looked at."""
        board = self.view.board
        entry = board.shown_entry()
        names = {key: one.name for key, one in board.choices().items()}
        if names != self._choice.options:
            self._choice.set_options(names, value=board.shown or None)
        self._choice.value = board.shown or None
        job = None if entry is None else entry.job
        working = job is not None and not job.state.is_over
        self._stop.set_enabled(working and job is not None and job.state != JobState.STOPPING)
        self._go_on.set_visibility(entry is not None and bool(entry.asked) and not working)
        self._progress.set_visibility(working)
        self._empty.set_visibility(entry is None)
        if job is None:
            asked = entry is not None and entry.asked
            self._state.text = "stopped with an earlier server" if asked else ""
            return entry
        fraction, words = job.progress
        place = "indeterminate" if fraction is None else ""
        self._progress.props(remove="indeterminate", add=place).set_value(fraction or 0.0)
        last = job.lines[-1] if working and job.lines else ""
        parts = [job.state.value, f"{job.elapsed:.0f} s", job.message or words or last]
        self._state.text = ", ".join(part for part in parts if part)
        return entry

    async def _tick(self) -> None:
        with show_errors():
            entry = self._refresh()
            if self._job is not None and self._job.state.is_over:
                job, self._job = self._job, None
                refused = job.message if job.state == JobState.FAILED else ""
                if refused and (self._form is None or not self._form.say(refused)):
                    notify(refused)
            whole = entry if entry is not None and entry.is_whole else None
            stamp = (None, 0.0) if whole is None else (whole.folder, whole.changed)
            if stamp != self._shown:
                self._shown = stamp
                await self._place_results(whole)

    async def _place_results(self, entry: Entry | None) -> None:
        """Reads results in another thread, places them, and says what they are about."""
        self._body.clear()
        self._bench.results.show(self._tab.result, None)
        if entry is None:
            return
        with self._body, show_errors():
            sign = ui.spinner(size="lg")
            view = await run.io_bound(read_results, entry.folder)
            if view is None or sign.is_deleted:  # the server is ending, or others are shown
                return
            sign.delete()
            placed = self._show(view)
            if placed is not None:
                await placed
            robot = view.robot or entry.about.get("robot", "")
            self._bench.results.show(self._tab.result, Subject(robot, entry.digest(robot)))


def _stem(word: str) -> str:
    """What a file or a word is called, as a part of a folder's name."""
    path = Path(word.rpartition("=")[2])
    return path.parent.name if path.stem == "log" and path.parent.name else path.stem

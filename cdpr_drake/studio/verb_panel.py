"""A panel of verbs: the form of one, its start, and the results that there are of all.

The panels Workspace, Logs, Studies and Commands are such; the latter two are here.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from nicegui import run, ui

from cdpr_drake.errors import CdprError
from cdpr_drake.studio.boards import Board, Entry
from cdpr_drake.studio.jobs import Job, JobState
from cdpr_drake.studio.panel import ANSWER, STUDY, notify, offer, robot_argument, show_errors
from cdpr_drake.studio.results import NOTHING, Subject
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.verb_form import Filled, VerbForm
from cdpr_drake.studio.views import View, place_figure, read_behind, read_numbers

TICK = 0.5
"""Time between looks at jobs and folders [s]."""

MOST_IN_GALLERY = 24
"""Studies in the gallery, the newest."""


class Verbs:
    """What a session sees of a panel of verbs, in all its tabs of the browser.

    Attributes:
        folder: Folder of its results in the working folder; also of its marks.
        result: Name of what it shows among `Workbench.results`.
        empty: What is said where there is no result yet.
        names: Of its verbs; empty: all that there are.
        first: Keys of options that are shown unfolded, by verb.
        start: Words of the button.
        unfolded: True if the numbers of results are unfolded.
        board: Commands and their results.
        filled: What was filled into the forms.
        verb: Name of the verb whose form is shown.
    """

    folder: ClassVar[str]
    result: ClassVar[str]
    empty: ClassVar[str]
    names: ClassVar[Sequence[str]] = ()
    first: ClassVar[Mapping[str, Sequence[str]]] = {}
    start: ClassVar[str] = "Start"
    unfolded: ClassVar[bool] = False

    def __init__(self, bench: Workbench) -> None:
        """For a workbench, which keeps it."""
        self.bench = bench
        self.board = Board(bench.jobs, bench.folder.root, self.folder)
        self.filled: Filled = {}
        self.verb = next(iter(self.first or self.names or bench.commands))

    def given(self) -> dict[str, str]:
        """Values of options beside those of the form, by key, which has no inputs for them."""
        return {}

    def read(self, folder: Path) -> Any:
        """What is placed before the numbers of results; another thread reads it."""
        return ()

    def place(self, read: Any) -> None:
        """Places what `read` gave into the current slot."""


class VerbPanel:
    """The panel in one tab of a browser."""

    def __init__(self, verbs: Verbs) -> None:
        """Places it into the current slot."""
        self._verbs, self._bench, self._board = verbs, verbs.bench, verbs.board
        self._form: VerbForm | None = None
        self._placing = asyncio.Lock()
        self._job: Job | None = None
        self._shown: tuple[Path | None, float] = None, 0.0
        commands, mark = self._bench.commands, verbs.folder
        titles = {name: f"{name}: {commands[name].line}" for name in verbs.names or commands}
        with ui.row().classes("w-full items-center no-wrap"):
            choice = ui.select(titles, value=verbs.verb, label="what", with_input=not verbs.names)
            choice.classes("col").mark(f"verb-{mark}")
            choice.set_visibility(len(titles) > 1)
            start = ui.button(verbs.start, icon="play_circle", on_click=self._start)
            start.props("no-caps").mark(f"start-{mark}")
        self._fields = ui.element("div").classes("w-full")
        with ui.row().classes("w-full items-center no-wrap"):
            self._choice = ui.select({}, label="results", on_change=self._choose)
            self._choice.classes("col").mark(f"{mark}-results")
            self._stop = ui.button(icon="stop", on_click=self._ask_to_stop).mark(f"{mark}-stop")
            self._stop.props('dense aria-label="Stop" title="Stop; what is finished is kept"')
            self._go_on = ui.button("Continue", on_click=self._ask_to_go_on)
            self._go_on.props('dense no-caps outline title="Goes on where it was stopped"')
            self._go_on.mark(f"{mark}-continue")
        self._progress = ui.linear_progress(show_value=False).props("size=8px")
        self._state = ui.label().classes("studio-soft").props('role="status"').mark(f"{mark}-state")
        self._empty = ui.label(verbs.empty).classes("studio-empty").mark(f"{mark}-empty")
        self._body = ui.element("div").classes("w-full").mark(f"{mark}-shown")
        choice.on_value_change(lambda: self._place_form(choice.value))
        ui.timer(0.0, lambda: self._place_form(verbs.verb), once=True)
        ui.timer(TICK, self._tick)

    async def _place_form(self, name: str | None) -> None:
        """Imports a verb in another thread, and places its form."""
        if not name:
            return
        verbs, folder = self._verbs, self._bench.folder
        verbs.verb, verb = name, self._bench.commands[name]
        async with self._placing:
            self._form = None
            self._fields.clear()
            with self._fields, show_errors():
                read = await read_behind(lambda: (verb.options, folder.files((".yaml", ".yml"))))
                if read is not None:
                    without = [*verbs.given(), *(["robot"] if verb.needs_robot else [])]
                    self._form = VerbForm(
                        verb, verbs.filled, folder, read[1],
                        first=verbs.first.get(name, ()), without=without,
                    )  # fmt: skip

    async def _start(self) -> None:
        async with self._placing:  # it may be on its way
            form = self._form
        if form is None:
            raise CdprError("there is no form; choose what to start")
        verb, given, about = form.verb, self._verbs.given(), NOTHING
        names = [_stem(value) for value in given.values()]
        if verb.needs_robot:
            given["robot"], about = robot_argument(self._bench), self._bench.questions.subject
            names.append(about.robot)
        if words := await form.words(given):
            if len(self._verbs.names) != 1:
                names.append(verb.title)
            name = "-".join(names) or _stem(words[-1])
            self._job = await self._board.start(verb, words, name, about)
            self._refresh()

    def _choose(self) -> None:
        if self._choice.value and self._choice.value != self._board.shown:
            self.open(str(self._choice.value))

    def open(self, key: str) -> None:
        """Looks at the results of a key."""
        self._board.shown = key
        self._refresh()

    def _ask_to_stop(self) -> None:
        entry = self._board.entry
        if entry is not None and entry.job is not None:
            entry.job.stop()
        self._refresh()

    async def _ask_to_go_on(self) -> None:
        entry = self._board.entry
        if entry is not None:
            await self._board.go_on(entry, self._bench.commands, self._bench.folder)
        self._refresh()

    def _refresh(self) -> Entry | None:
        """Follows jobs and folders; returns what is looked at."""
        board = self._board
        names = {key: one.name for key, one in board.follow().items()}
        offer(self._choice, names, board.shown or None)
        entry = board.entry
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
        results, name = self._bench.results, self._verbs.result
        results.show(name, None)
        if entry is None:
            return
        with self._body, show_errors():
            folder = entry.folder
            view = await read_behind(lambda: View(read_numbers(folder), folder))
            if view is not None:
                with show_errors():
                    read = await read_behind(lambda: self._verbs.read(folder))
                    if read is not None:
                        self._verbs.place(read)
                view.place(self._verbs.unfolded)
                is_known = view.robot in ("", entry.about.robot)
                results.show(name, entry.about if is_known else Subject(view.robot))


def _stem(word: str) -> str:
    """What a file or a word is called, as a part of a folder's name."""
    path = Path(word.rpartition("=")[2])
    return path.parent.name if path.stem == "log" and path.parent.name else path.stem


class Commands(Verbs):
    """Any verb with its form, and what it leaves."""

    folder, result, unfolded = "commands", ANSWER, True
    first: ClassVar = {"tension": ("pose", "method", "pulleys", "wrench")}
    empty = (
        "No result yet. Choose a question and press Start; a command about a robot takes the open "
        "one."
    )


def commands_panel(bench: Workbench) -> None:
    """Places the panel of all commands."""
    VerbPanel(bench.kept(Commands))


class Studies(Verbs):
    """Studies, and what they found."""

    folder, result, names = "studies", STUDY, ("study",)
    first: ClassVar = {"study": ("quick", "seeds")}
    empty = (
        "No study yet. Choose one and press Start; quick takes a short form of it. Statements with "
        "their verdicts, tables and figures come here. A study that is stopped keeps its finished "
        "rows, and can be continued."
    )


def studies_panel(bench: Workbench) -> None:
    """Places the studies panel."""
    studies = bench.kept(Studies)
    panel = VerbPanel(studies)
    placed: list[tuple[Path, float]] = []
    with ui.expansion("Finished studies in the working folder", value=True) as fold:
        gallery = ui.row().classes("w-full")
    fold.classes("w-full studio-group")

    async def follow() -> None:
        whole = [one for one in studies.board.choices().values() if one.is_whole]
        stamp = [(one.folder, one.changed) for one in whole[:MOST_IN_GALLERY]]
        if stamp != placed:
            placed[:] = stamp
            views = await run.io_bound(_readable, [folder for folder, _ in stamp])
            with gallery.clear(), show_errors():
                for view in views or ():
                    _place_card(view, panel)

    ui.timer(TICK, follow)


def _readable(folders: list[Path]) -> list[View]:
    """The results in those folders that can be read."""
    views = []
    for folder in folders:
        with suppress(CdprError):
            views.append(View(read_numbers(folder), folder))
    return views


def _place_card(view: View, panel: VerbPanel) -> None:
    assert view.folder is not None
    name = view.folder.name
    with ui.card().props("flat bordered").style("width: 14rem; cursor: pointer") as card:
        card.props(f'tabindex=0 role="button" aria-label="Show {name}"').mark(f"card-{name}")
        for event in ("click", "keydown.enter", "keydown.space"):
            card.on(event, partial(panel.open, name))
        if view.figures:
            first = next(iter(view.figures.values()))
            place_figure(first, "height: 7rem; width: 100%; object-fit: contain")
        ui.label(name).classes("studio-title")
        for words in filter(None, (view.verdicts or "no statements to judge", view.remarks)):
            ui.label(words).classes("studio-soft")

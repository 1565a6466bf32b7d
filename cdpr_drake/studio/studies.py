"""The studies panel: start, watch, and look at what studies found."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from pathlib import Path
from weakref import WeakKeyDictionary

from nicegui import run, ui

from cdpr_drake.analyses.studies.study import STUDIES
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.boards import CommandBoard
from cdpr_drake.studio.panel import STUDY, show_errors
from cdpr_drake.studio.panels.command_fields import CommandFields, Filled
from cdpr_drake.studio.results import Subject
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.views import CommandResults, View, changed, place_figure, read_results

TICK = 0.5
"""Time between looks at jobs and folders [s]."""

MOST_IN_GALLERY = 24
"""Studies in the gallery, the newest."""

EMPTY = (
    "No study yet. Choose one and press Start; quick takes a short form of it. Statements with "
    "their verdicts, tables and figures come here."
)


class StudyView:
    """What a session sees of studies, in all its tabs."""

    def __init__(self, bench: Workbench) -> None:
        """For a workbench."""
        forms = {"study": bench.commands["study"]}
        self.board = CommandBoard(bench.jobs, bench.folder.root, "studies", forms)
        self.filled, self.name = Filled(), next(iter(STUDIES))


_views: WeakKeyDictionary[Workbench, StudyView] = WeakKeyDictionary()
"""What each session sees, as long as it has a workbench."""


def studies_panel(bench: Workbench) -> None:
    """Places the studies panel."""
    _StudiesPanel(bench, _views.setdefault(bench, StudyView(bench)))


class _StudiesPanel:
    """The panel in one tab of a browser."""

    def __init__(self, bench: Workbench, view: StudyView) -> None:
        self._view = view
        bench.results.show(STUDY, Subject(""))
        self._in_gallery: tuple[tuple[Path, float], ...] = ()
        with ui.row().classes("w-full items-center no-wrap"):
            name = ui.select(list(STUDIES), value=view.name, label="study", with_input=True)
            name.props("dense outlined").classes("col").mark("study")
            name.on_value_change(lambda event: setattr(view, "name", event.value or ""))
            start = ui.button("Start", icon="play_circle", on_click=self._start)
            start.props("no-caps").mark("start-study")
        words = "A study that is stopped keeps its finished rows, and can be continued."
        ui.label(words).classes("studio-soft")
        form = bench.commands["study"]
        fields = CommandFields(form, view.filled, ("quick", "seeds"), {}, bench.folder)
        self._results = CommandResults(view.board, fields, "results")
        self._empty = ui.label(EMPTY).classes("studio-empty").mark("study-empty")
        with ui.expansion("Finished studies in the working folder", value=True) as gallery:
            self._gallery = ui.element("div").classes("w-full")
        gallery.classes("w-full studio-group")
        ui.timer(TICK, self._tick)

    def _start(self) -> None:
        if self._view.name:
            self._results.start(self._view.name, ["study", self._view.name])

    async def _tick(self) -> None:
        with show_errors():
            await self._results.tick()
            self._empty.set_visibility(not self._view.board.shown)
            whole = [one.folder for one in self._view.board.choices().values() if one.is_whole]
            stamp = tuple((folder, changed(folder)) for folder in whole[:MOST_IN_GALLERY])
            if stamp != self._in_gallery:
                self._in_gallery = stamp
                studies = await run.io_bound(_readable, [folder for folder, _ in stamp])
                self._gallery.clear()
                with self._gallery, ui.row().classes("w-full"):
                    for study in studies or ():
                        self._place_card(study)

    def _place_card(self, study: View) -> None:
        assert study.folder is not None
        name = study.folder.name
        with ui.card().props("flat bordered").style("width: 14rem; cursor: pointer") as card:
            card.props(f'tabindex=0 role="button" aria-label="Show {name}"').mark(f"card-{name}")
            for event in ("click", "keydown.enter", "keydown.space"):
                card.on(event, partial(self._open, name))
            if study.figures:
                first = next(iter(study.figures.values()))
                place_figure(first, "height: 7rem; width: 100%; object-fit: contain")
            ui.label(name).classes("studio-title")
            for words in (study.verdicts() or "no statements to judge", study.remarks()):
                if words:
                    ui.label(words).classes("studio-soft")

    def _open(self, name: str) -> None:
        self._view.board.shown = name
        self._results.bar.refresh()


def _readable(folders: list[Path]) -> list[View]:
    """The results in those folders that can be read."""
    results = []
    for folder in folders:
        with suppress(CdprError):
            results.append(read_results(folder))
    return results

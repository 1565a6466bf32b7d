"""The studies panel: start, watch, and look at what studies found."""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path
from weakref import WeakKeyDictionary

from nicegui import run, ui

from cdpr_drake.analyses.studies.study import STUDIES
from cdpr_drake.studio.numbers import fact_table
from cdpr_drake.studio.panels.command_fields import CommandFields, Filled
from cdpr_drake.studio.panels.job_bar import JobBar
from cdpr_drake.studio.panels.panel import notify, show_errors
from cdpr_drake.studio.panels.result_names import STUDY
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.workbench.command_board import CommandBoard
from cdpr_drake.studio.workbench.command_form import FieldProblem
from cdpr_drake.studio.workbench.finished_studies import (
    STUDY_RESULTS,
    StudyFolder,
    study_folder,
    study_folders,
)
from cdpr_drake.studio.workbench.result_subject import Subject

TICK = 0.5
"""Time between looks at jobs and folders [s]."""

LARGEST_FIGURE = 8_000_000
"""Of a figure that is shown [bytes]."""

MOST_IN_GALLERY = 24
"""Studies in the gallery, the newest."""

TYPES = {".png": "image/png", ".svg": "image/svg+xml"}

EMPTY = (
    "No study yet. Choose one and press Start; quick takes a short form of it. Statements with "
    "their verdicts, tables and figures come here."
)

SHADES = {"confirmed": "#1b7f4f", "in part": "#a86200", "not confirmed": "#c01010"}
"""Behind the words of verdicts."""


class StudyView:
    """What a session sees of studies, in all its tabs."""

    def __init__(self, bench: Workbench) -> None:
        """For a workbench."""
        self.board = CommandBoard(
            bench.jobs, bench.folder.root, STUDY_RESULTS, {"study": bench.commands["study"]}
        )
        self.filled, self.name = Filled(), next(iter(STUDIES))


_views: WeakKeyDictionary[Workbench, StudyView] = WeakKeyDictionary()
"""What each session sees, as long as it has a workbench."""


def studies_panel(bench: Workbench) -> None:
    """Places the studies panel."""
    _StudiesPanel(bench, _views.setdefault(bench, StudyView(bench)))


class _StudiesPanel:
    """The panel in one tab of a browser."""

    def __init__(self, bench: Workbench, view: StudyView) -> None:
        self._view, self._started, self._jobs = view, 0, bench.jobs
        bench.results.show(STUDY, Subject(""))
        self._read: tuple[Path | None, float] = (None, 0.0)
        self._gallery_of: tuple[tuple[Path, float], ...] = ()
        with ui.row().classes("w-full items-center no-wrap"):
            self._name = ui.select(list(STUDIES), value=view.name, label="study", with_input=True)
            self._name.props("dense outlined").classes("col").mark("study")
            self._name.on_value_change(self._choose)
            start = ui.button("Start", icon="play_circle", on_click=self._start).props("no-caps")
            start.mark("start-study")
        ui.label("Stopped, it keeps what is finished, and can be continued.").classes("studio-soft")
        self._fields = CommandFields(
            bench.commands["study"], view.filled, ("quick", "seeds"), {}, bench.folder
        )
        self._bar = JobBar(view.board, "results")
        self._empty = ui.label(EMPTY).classes("studio-empty").mark("study-empty")
        self._body = ui.element("div").classes("w-full").mark("study-results")
        with ui.expansion("Finished studies in the working folder", value=True) as gallery:
            gallery.classes("w-full studio-group")
            self._gallery = ui.element("div").classes("w-full")
        self._choose()
        ui.timer(TICK, self._tick)

    def _choose(self) -> None:
        if not self._name.value:
            return
        self._view.name = str(self._name.value)

    def _start(self) -> None:
        with show_errors():
            try:
                options = self._fields.arguments()
            except FieldProblem:
                return  # the field says it
            name = self._view.name
            self._started = self._view.board.start(name, ["study", name, *options]).number
            self._bar.refresh()

    async def _tick(self) -> None:
        with show_errors():
            self._bar.refresh()
            self._empty.set_visibility(not self._view.board.shown)
            self._say_mistake()
            computed = self._bar.computed
            folder = computed.folder if computed is not None and computed.is_whole else None
            stamp = (folder, 0.0 if folder is None else _changed(folder))
            if stamp != self._read:
                self._read = stamp
                self._body.clear()
                if folder is not None:
                    found = await run.io_bound(study_folder, folder)
                    if found is not None:  # else the server is ending
                        with self._body:
                            _place_study(found)
            await self._show_gallery()

    def _say_mistake(self) -> None:
        job = self._jobs.job(self._started) if self._started else None
        if job is not None and job.state.is_over:
            self._started = 0
            self._fields.say(self._fields.form.field_of(job.message), job.message)

    async def _show_gallery(self) -> None:
        whole = [each.folder for each in self._view.board.choices().values() if each.is_whole]
        stamp = tuple((folder, _changed(folder)) for folder in whole[:MOST_IN_GALLERY])
        if stamp == self._gallery_of:
            return
        self._gallery_of = stamp
        found = await run.io_bound(study_folders, [folder for folder, _ in stamp])
        self._gallery.clear()
        with self._gallery, ui.row().classes("w-full"):
            for each in found or []:
                self._place_card(each)

    def _place_card(self, study: StudyFolder) -> None:
        with ui.card().classes("cdpr-study-card").props("flat bordered") as card:
            card.style("width: 14rem; cursor: pointer").mark(f"card-{study.folder.name}")
            card.props(f'tabindex=0 role="button" aria-label="Show {study.folder.name}"')
            for event in ("click", "keydown.enter", "keydown.space"):
                card.on(event, lambda name=study.folder.name: self._open(name))
            if study.figures:
                _place_figure(study.figures[0], "height: 7rem; width: 100%; object-fit: contain")
            ui.label(study.folder.name).classes("studio-title")
            words = [f"{count} {name}" for name, count in study.verdicts().items()]
            ui.label(", ".join(words) or "no statements to judge").classes("studio-soft")
            if study.remarks():
                ui.label(study.remarks()).classes("studio-soft")

    def _open(self, name: str) -> None:
        self._view.board.shown = name
        self._bar.refresh()


def _changed(folder: Path) -> float:
    """When the results were written."""
    try:
        return (folder / "results.json").stat().st_mtime
    except OSError:
        return 0.0


def _place_study(study: StudyFolder) -> None:
    """Statements with verdicts, tables and figures of a study."""
    if study.remarks():
        ui.label(f"These results: {study.remarks()}.").classes("studio-soft").mark("study-remarks")
    if study.statements:
        ui.html(_statements_html(study), sanitize=False).classes("w-full").mark("statements")
    for name, (columns, rows, count) in study.tables.items():
        words = f"{name}, {count} rows" if count == len(rows) else (
            f"{name}, the first {len(rows)} of {count} rows"
        )  # fmt: skip
        with ui.expansion(words).classes("w-full studio-group"):
            ui.html(_table_html(columns, rows), sanitize=False).classes("w-full overflow-auto")
    with ui.expansion("Numbers").classes("w-full studio-group"):
        ui.html(fact_table(study.facts), sanitize=False).classes("w-full")
    figures = {figure.relative_to(study.folder).as_posix(): figure for figure in study.figures}
    if figures:
        chosen = ui.select(list(figures), value=next(iter(figures)), label="figure")
        chosen.props("dense outlined").classes("w-full").mark("figure")
        place = ui.element("div").classes("w-full")

        def show() -> None:
            place.clear()
            with place, show_errors():
                _place_figure(figures[str(chosen.value)], "max-width: 100%; background: white")

        chosen.on_value_change(show)
        show()


def _place_figure(path: Path, style: str) -> None:
    """A figure as an image in the page; nothing in it is run, whatever it is."""
    place = ui.element("div").classes("w-full")

    async def fill() -> None:
        with place, show_errors():
            data = await run.io_bound(_figure_data, path)
            if data is None:  # the server is ending
                return
            if not data:
                words = f"{path.name}: too large to be shown; it is in {path.parent.name}"
                notify(words, "warning")
                return
            kind = TYPES[path.suffix.lower()]
            words = escape(path.stem.replace("_", " "), quote=True)
            ui.html(
                f'<img src="data:{kind};base64,{data}" alt="{words}" style="{style}">',
                sanitize=False,
            )

    ui.timer(0.0, fill, once=True)


def _figure_data(path: Path) -> str:
    """A file as text of base 64; empty: it is too large."""
    if path.stat().st_size > LARGEST_FIGURE:
        return ""
    return base64.b64encode(path.read_bytes()).decode("ascii")


def _statements_html(study: StudyFolder) -> str:
    rows = "".join(
        "<tr>"
        f'<td><b style="white-space:nowrap;color:#ffffff;border-radius:3px;padding:0 0.3rem;'
        f'background:{SHADES.get(row.get("verdict", ""), "#606060")}">'
        f"{escape(row.get('verdict', ''))}</b></td>"
        + "".join(
            f'<td style="text-align:left">{escape(row.get(key, ""))}</td>'
            for key in ("words", "printed", "found", "why")
        )
        + "</tr>"
        for row in study.statements
    )
    heads = "".join(
        f'<th style="text-align:left">{words}</th>'
        for words in ("verdict", "the source says", "printed", "found", "remark")
    )
    return _table(heads, rows)


def _table_html(columns: list[str], rows: list[list[str]]) -> str:
    heads = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(words)}</td>" for words in row) + "</tr>" for row in rows
    )
    return _table(heads, body)


def _table(heads: str, body: str) -> str:
    return (
        '<div style="overflow-x:auto"><table class="studio-facts" style="min-width:34rem"><thead>'
        f"<tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>"
    )

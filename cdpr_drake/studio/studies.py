"""The studies panel: start, watch, and look at what studies found, with a gallery of all."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import ClassVar

from nicegui import run, ui

from cdpr_drake.errors import CdprError
from cdpr_drake.studio.panel import STUDY, show_errors
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.verb_panel import TICK, VerbPanel, Verbs
from cdpr_drake.studio.views import View, place_figure, read_results

MOST_IN_GALLERY = 24
"""Studies in the gallery, the newest."""


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
            views.append(read_results(folder))
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
        for words in filter(None, (view.verdicts() or "no statements to judge", view.remarks())):
            ui.label(words).classes("studio-soft")

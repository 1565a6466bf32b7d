"""The logs panel: what is in a log, and a log beside the model of the robot that is open.

What is in a log is what `cdpr check LOG` says; the comparison is what `cdpr replay` writes.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from nicegui import run, ui

from cdpr_drake.analyses.logs.columns import SECONDS
from cdpr_drake.analyses.logs.dialects import LOG_SUFFIXES
from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.analyses.logs.replay import TABLE
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.palette import DASHED, Look, nth_look
from cdpr_drake.studio.files import MOST_FILES, WorkingFolder
from cdpr_drake.studio.panel import LOG, show_errors
from cdpr_drake.studio.plots import Chart, MovingPlots, Row
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.verb_panel import TICK, VerbPanel, Verbs
from cdpr_drake.studio.views import View, place_image, read_behind, read_numbers

MOST_ROWS = 1500
"""Rows of a comparison that are drawn, evenly spread."""

DOTS = 110
"""Of the picture of a log [1/inch]."""

OFFSETS = "length, measured minus the model's [mm]"
LENGTHS, POSITIONS = "cable length [m]", "position [m]"
PAIRS = {
    LENGTHS: ("{}_length_m", "{}_predicted_length_m"),
    "tension [N]": ("{}_tension_n", "{}_predicted_tension_n"),
    POSITIONS: ("{}_m", "by_lengths_{}_m"),
}
"""Charts of a comparison, with the columns of the log and of the model."""


class Logs(Verbs):
    """Logs beside the model of the open robot.

    Attributes:
        log: Name of the log that is looked at, in the working folder; empty: none.
    """

    folder, result, names, start = "logs", LOG, ("replay",), "Compare"
    first: ClassVar = {"replay": ("follow", "fit-frame", "unit", "log-format")}
    empty = (
        "No comparison yet. Put a log of a machine or tracker into the working folder, or simulate "
        "a run in the tab Run, and choose it above: its channels, rates and gaps are listed. "
        "Compare puts it beside the model of the open robot."
    )
    log = ""

    def given(self) -> dict[str, str]:
        """The log."""
        return {"log": str(self.bench.folder.root / self.log) if self.log else ""}

    def read(self, folder: Path) -> Any:
        """A comparison as curves."""
        return read_comparison(folder)

    def place(self, read: Any) -> None:
        """Places the curves."""
        with ui.element("div").classes("w-full cdpr-run").mark("comparison"):
            plots = MovingPlots(lambda: plots.begin(*read))


def logs_panel(bench: Workbench) -> None:
    """Places the logs panel."""
    logs = bench.kept(Logs)
    chosen = ui.select([], label="log in the working folder", with_input=True)
    chosen.classes("w-full").mark("log")
    contents = ui.element("div").classes("w-full").mark("log-contents")
    VerbPanel(logs)

    async def choose() -> None:
        name = logs.log = str(chosen.value or "")
        with contents.clear(), show_errors():
            if not name:
                return
            read = await read_behind(lambda: log_contents(bench.folder.path(name)))
            if read is not None:
                with ui.expansion("What is in the log", value=True).classes("w-full studio-group"):
                    read[0].place(unfolded=True)
                    place_image(read[1], Path("columns of the log over time.png"))

    async def follow() -> None:
        files = await run.io_bound(log_files, bench.folder)
        if files is not None and files != chosen.options:
            chosen.set_options(files, value=logs.log or None)

    chosen.on_value_change(choose)
    ui.timer(TICK, follow)


def log_files(folder: WorkingFolder) -> list[str]:
    """Files of a working folder that may be logs, then the logs of its runs."""
    files = [name for name in folder.files(LOG_SUFFIXES) if not name.startswith("logs/")]
    runs = sorted(folder.root.glob("runs/*/log.csv"))
    return [*files, *(folder.shown(path) for path in runs)][:MOST_FILES]


def log_contents(path: Path) -> tuple[View, bytes]:
    """What is in a log, and its columns over time as PNG.

    Raises:
        LogFileError: No reader knows it, or it is damaged; one line.
    """
    log, picture = import_log(path), BytesIO()
    log.plot().savefig(picture, format="png", dpi=DOTS)
    most_rows = len(log.ledger) + len(log.frame.columns)
    return View(log.as_dict(), most_rows=most_rows), picture.getvalue()


def read_comparison(folder: Path) -> tuple[list[Chart], float, list[Row]]:
    """What `cdpr replay` wrote: charts of the log and the model, end [s], rows.

    Raises:
        CdprError: There is none, or it cannot be read.
    """
    summary = read_numbers(folder)
    try:
        table = pd.read_csv(folder / TABLE)
        rows = np.unique(np.linspace(0, len(table) - 1, min(len(table), MOST_ROWS)).astype(int))
        return _compared(summary["cables"], table.iloc[rows].astype(float))
    except (OSError, ValueError, KeyError, IndexError) as problem:
        raise OutputFolderError(f"{folder.name}: cannot be read: {problem}") from problem


def _compared(cables: Sequence[str], table: pd.DataFrame) -> tuple[list[Chart], float, list[Row]]:
    curves: dict[str, dict[str, tuple[Look, Any]]] = {OFFSETS: {}, **{title: {} for title in PAIRS}}
    for title, (measured, model) in PAIRS.items():
        for k, name in enumerate("xyz" if title == POSITIONS else cables):
            look, one, other = nth_look(k), table[measured.format(name)], table[model.format(name)]
            curves[title][name] = look, one
            curves[title][f"{name} by the model"] = Look(look.color, DASHED), other
            if title == LENGTHS:
                curves[OFFSETS][name] = look, 1e3 * (one - other)
    charts, columns = [], [table[SECONDS]]
    for title, named in curves.items():
        filled = {name: curve for name, curve in named.items() if curve[1].notna().any()}
        columns += [values for _, values in filled.values()]
        if filled:
            charts.append(Chart(title, tuple((name, look) for name, (look, _) in filled.items())))
    values = np.column_stack(columns)
    rows = [[float(v) if np.isfinite(v) else None for v in row] for row in values]
    return charts, float(values[-1, 0]), rows

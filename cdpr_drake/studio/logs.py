"""The logs panel: what is in a log, and a log beside the model of the robot that is open.

What is in a log is what `cdpr check LOG` says; the comparison is what `cdpr replay` writes.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import pandas as pd
from nicegui import run, ui

from cdpr_drake.analyses.logs.columns import LENGTH, PARTS, POSITION, SECONDS, TENSION
from cdpr_drake.analyses.logs.dialects import LOG_SUFFIXES
from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.analyses.logs.replay import SUMMARY, TABLE
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.palette import DASHED, Look, nth_look
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.folder import MOST_FILES, WorkingFolder
from cdpr_drake.studio.panel import LOG, show_errors
from cdpr_drake.studio.plots import Chart, MovingPlots, Row
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.verb_panel import TICK, VerbPanel, VerbTab
from cdpr_drake.studio.views import View, place_image

TAB = VerbTab(
    folder="logs", result=LOG, verbs=("replay",), start="Compare",
    first={"replay": ("follow", "fit-frame", "unit", "log-format")},
    empty="No comparison yet. Put a log of a machine or tracker into the working folder, or "
    "simulate a run in the tab Run, and choose it above: its channels, rates and gaps are listed. "
    "Compare puts it beside the model of the open robot.",
)  # fmt: skip

MOST_ROWS = 1500
"""Rows of a comparison that are drawn, evenly spread."""

DOTS = 110
"""Of the picture of a log [1/inch]."""

_logs: WeakKeyDictionary[Workbench, str] = WeakKeyDictionary()
"""Name of the log that each session looks at, in its working folder."""


def logs_panel(bench: Workbench) -> None:
    """Places the logs panel."""
    files = log_files(bench.folder)
    chosen = ui.select(files, label="log in the working folder", with_input=True)
    chosen.props("dense outlined").classes("w-full").mark("log")
    contents = ui.element("div").classes("w-full").mark("log-contents")

    def given() -> dict[str, str]:
        return {"log": str(bench.folder.path(_logs[bench])) if bench in _logs else ""}

    panel = VerbPanel(bench, TAB, given=given, show=_show)

    async def choose() -> None:
        name = _logs[bench] = str(chosen.value or "")
        contents.clear()
        panel.start.set_enabled(bool(name))
        if not name:
            return
        with contents, show_errors():
            sign = ui.spinner(size="lg")
            try:
                read = await run.io_bound(lambda: log_contents(bench.folder.path(name)))
            finally:
                if not sign.is_deleted:  # another log was chosen meanwhile
                    sign.delete()
            if read is not None and name == _logs[bench]:
                view, picture = read
                with ui.expansion("What is in the log", value=True).classes("w-full studio-group"):
                    view.place(unfolded=True)
                    place_image(picture, Path("columns of the log over time.png"))

    async def follow() -> None:
        files = await run.io_bound(log_files, bench.folder)
        if files is not None and files != chosen.options:
            chosen.set_options(files, value=_logs.get(bench) or None)

    panel.start.set_enabled(False)
    chosen.on_value_change(choose)
    chosen.value = _logs.get(bench) or None
    ui.timer(TICK, follow)


async def _show(view: View) -> None:
    """Places a comparison as curves, then all else that there is of it."""
    assert view.folder is not None
    with show_errors():
        comparison = await run.io_bound(read_comparison, view.folder)
        if comparison is not None:  # the server is not ending
            with ui.element("div").classes("w-full cdpr-run").mark("comparison"):
                plots = MovingPlots(lambda: plots.begin(*comparison))
    view.place()


def log_files(folder: WorkingFolder) -> list[str]:
    """Files of a working folder that may be logs, then the logs of its runs."""
    files = [name for name in folder.files(LOG_SUFFIXES) if not name.startswith(f"{TAB.folder}/")]
    runs = sorted(folder.root.glob("runs/*/log.csv"))
    return [*files, *(folder.shown(path) for path in runs)][:MOST_FILES]


def log_contents(path: Path) -> tuple[View, bytes]:
    """What is in a log, and its columns over time as PNG.

    Raises:
        LogFileError: No reader knows it, or it is damaged; one line.
    """
    log, picture = import_log(path), io.BytesIO()
    log.plot().savefig(picture, format="png", dpi=DOTS)
    return View.of(
        log.as_dict(), most_rows=len(log.ledger) + len(log.frame.columns)
    ), picture.getvalue()


def read_comparison(folder: Path) -> tuple[list[Chart], float, list[Row]]:
    """What `cdpr replay` wrote: charts of the log and the model, end [s], rows.

    Raises:
        OutputFolderError: There is none, or it cannot be read.
    """
    try:
        summary = load_json((folder / SUMMARY).read_text(encoding="utf-8"))
        table = pd.read_csv(folder / TABLE)
        rows = np.unique(np.linspace(0, len(table) - 1, min(len(table), MOST_ROWS)).astype(int))
        return _compared(list(summary["cables"]), table.iloc[rows].astype(float))
    except (OSError, ValueError, KeyError, IndexError) as problem:
        raise OutputFolderError(f"{folder.name}: cannot be read: {problem}") from problem


def _compared(cables: list[str], table: pd.DataFrame) -> tuple[list[Chart], float, list[Row]]:
    charts: list[Chart] = []
    columns = [table[SECONDS]]

    def add(title: str, series: Mapping[str, tuple[Look, pd.Series[Any]]]) -> None:
        filled = {name: one for name, one in series.items() if one[1].notna().any()}
        if filled:
            charts.append(Chart(title, tuple((name, look) for name, (look, _) in filled.items())))
            columns.extend(values for _, values in filled.values())

    def pairs(names: Mapping[str, tuple[str, str]]) -> dict[str, tuple[Look, pd.Series[Any]]]:
        both = {}
        for k, (name, (measured, model)) in enumerate(names.items()):
            look = nth_look(k)
            both[name] = (look, table[measured])
            both[f"{name} by the model"] = (Look(look.color, DASHED), table[model])
        return both

    lengths = {name: (f"{name}_{LENGTH}", f"{name}_predicted_{LENGTH}") for name in cables}
    tensions = {name: (f"{name}_{TENSION}", f"{name}_predicted_{TENSION}") for name in cables}
    places = {header[0]: (header, f"by_lengths_{header}") for header in PARTS[POSITION]}
    offsets = {
        name: (nth_look(k), 1e3 * (table[measured] - table[model]))
        for k, (name, (measured, model)) in enumerate(lengths.items())
    }
    add("length, measured minus the model's [mm]", offsets)
    add("cable length [m]", pairs(lengths))
    add("tension [N]", pairs(tensions))
    add("position [m]", pairs(places))
    values = pd.concat(columns, axis=1).to_numpy()
    rows = [[float(v) if np.isfinite(v) else None for v in row] for row in values]
    return charts, float(table[SECONDS].iloc[-1]), rows

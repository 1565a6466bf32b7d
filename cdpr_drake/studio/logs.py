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
from cdpr_drake.analyses.logs.dialects import AUTO, DIALECTS, LOG_SUFFIXES
from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.analyses.logs.replay import SUMMARY, TABLE
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.palette import DASHED, Look, nth_look
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.boards import CommandBoard
from cdpr_drake.studio.folder import MOST_FILES, WorkingFolder
from cdpr_drake.studio.panel import LOG, robot_argument, show_errors
from cdpr_drake.studio.panels.command_fields import Choices, CommandFields, Filled
from cdpr_drake.studio.plots import Chart, MovingPlots, Row
from cdpr_drake.studio.results import Subject
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.views import CommandResults, View, place_image, show_results

RESULTS = "logs"
"""Folder of comparisons in the working folder."""

TICK = 0.5
"""Time between looks at jobs and folders [s]."""

FIRST = ("follow", "fit-frame", "unit", "log-format")
"""Options that are always shown."""

MOST_ROWS = 1500
"""Rows of a comparison that are drawn, evenly spread."""

DOTS = 110
"""Of the picture of a log [1/inch]."""

EMPTY = (
    "No log is open. Put a log of a machine or tracker into the working folder, or simulate a run "
    "in the tab Run, and choose it above: its channels, rates and gaps are listed here. Compare "
    "puts it beside the model of the open robot."
)


class LogView:
    """What a session sees of logs, in all its tabs.

    Attributes:
        board: Comparisons.
        filled: What was filled into the form.
        log: Name of the log that is open, in the working folder; empty: none.
    """

    def __init__(self, bench: Workbench) -> None:
        """For a workbench."""
        # A comparison is done or not: it cannot go on, so nothing is run that a file asks for.
        self.board = CommandBoard(
            bench.jobs, bench.folder.root, RESULTS, {}, is_whole=is_comparison
        )
        self.filled, self.log = Filled(), ""


_views: WeakKeyDictionary[Workbench, LogView] = WeakKeyDictionary()
"""What each session sees, as long as it has a workbench."""


def logs_panel(bench: Workbench) -> None:
    """Places the logs panel."""
    _LogsPanel(bench, _views.setdefault(bench, LogView(bench)))


class _LogsPanel:
    """The panel in one tab of a browser."""

    def __init__(self, bench: Workbench, view: LogView) -> None:
        self._bench, self._view, self._robot = bench, view, ""
        with ui.row().classes("w-full items-center no-wrap"):
            files = log_files(bench.folder)
            self._log = ui.select(files, label="log in the working folder", with_input=True)
            self._log.props("dense outlined").classes("col").mark("log")
            self._log.on_value_change(self._choose)
            self._start_button = ui.button("Compare", icon="compare_arrows", on_click=self._start)
            self._start_button.props("no-caps").mark("compare-log")
        self._empty = ui.label(EMPTY).classes("studio-empty").mark("logs-empty")
        self._contents = ui.element("div").classes("w-full").mark("log-contents")
        fields = CommandFields(
            bench.commands["replay"], view.filled, FIRST,
            {"log-format": Choices([*DIALECTS, AUTO])}, bench.folder,
        )  # fmt: skip
        self._results = CommandResults(view.board, fields, "comparisons", self._show)
        self._say_empty()
        self._log.value = view.log or None
        ui.timer(TICK, self._tick)

    def _say_empty(self) -> None:
        self._empty.set_visibility(not self._view.log)
        self._start_button.set_enabled(bool(self._view.log))

    async def _choose(self) -> None:
        name = self._view.log = str(self._log.value or "")
        self._contents.clear()
        self._say_empty()
        if not name:
            return
        with self._contents, show_errors():
            sign = ui.spinner(size="lg")
            try:
                read = await run.io_bound(log_contents, self._bench.folder.path(name))
            finally:
                if not sign.is_deleted:  # another log was chosen meanwhile
                    sign.delete()
            if read is not None and name == self._view.log:
                contents, picture = read
                with ui.expansion("What is in the log", value=True).classes("w-full studio-group"):
                    contents.place(unfolded=True)
                    place_image(picture, Path("columns of the log over time.png"))

    def _start(self) -> None:
        with show_errors():
            path, now = self._bench.folder.path(self._view.log), self._bench.subject
            words = ["replay", str(path), f"--robot={robot_argument(self._bench)}"]
            name = f"{path.parent.name if path.stem == 'log' else path.stem}-{now.robot}"
            self._results.start(name, words, {"robot": now.robot, "digest": now.digest})

    async def _tick(self) -> None:
        with show_errors():
            files = log_files(self._bench.folder)
            if files != self._log.options:
                self._log.set_options(files, value=self._view.log or None)
            entry = await self._results.tick()
            digest = "" if entry is None else entry.about.get("digest", "")
            subject = Subject(self._robot, digest) if entry is not None and self._robot else None
            self._bench.results.show(LOG, subject)

    async def _show(self, folder: Path) -> None:
        self._robot = ""
        with show_errors():
            comparison = await run.io_bound(read_comparison, folder)
            if comparison is None:  # the server is ending
                return
            self._robot, charts, end, rows = comparison
            with ui.element("div").classes("w-full cdpr-run").mark("comparison"):
                plots = MovingPlots(lambda: plots.begin(charts, end, rows))
        await show_results(folder)


def log_files(folder: WorkingFolder) -> list[str]:
    """Files of a working folder that may be logs, then the logs of its runs."""
    files = [name for name in folder.files(LOG_SUFFIXES) if not name.startswith(f"{RESULTS}/")]
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


def is_comparison(folder: Path) -> bool:
    """True if a folder has what `cdpr replay` writes."""
    return all((folder / name).is_file() for name in (SUMMARY, TABLE))


def read_comparison(folder: Path) -> tuple[str, list[Chart], float, list[Row]]:
    """What `cdpr replay` wrote: the robot's name, charts of the log and the model, end [s], rows.

    Raises:
        OutputFolderError: There is none, or it cannot be read.
    """
    try:
        summary = load_json((folder / SUMMARY).read_text(encoding="utf-8"))
        table = pd.read_csv(folder / TABLE)
        rows = np.unique(np.linspace(0, len(table) - 1, min(len(table), MOST_ROWS)).astype(int))
        curves = _compared(list(summary["cables"]), table.iloc[rows].astype(float))
        return str(summary["robot"]), *curves
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

"""The logs panel: what is in a log, and a log beside the model of the robot that is open."""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

from nicegui import run, ui

from cdpr_drake.analyses.logs.dialects import AUTO, DIALECTS
from cdpr_drake.studio.numbers import fact_rows, fact_table, number_words, plain_table
from cdpr_drake.studio.panels.command_fields import Choices, CommandFields, Filled
from cdpr_drake.studio.panels.job_bar import JobBar
from cdpr_drake.studio.panels.moving_plots import MovingPlots
from cdpr_drake.studio.panels.panel import notify, robot_argument, show_errors
from cdpr_drake.studio.panels.result_names import LOG
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.workbench.command_board import CommandBoard
from cdpr_drake.studio.workbench.command_form import FieldProblem
from cdpr_drake.studio.workbench.job import JobState
from cdpr_drake.studio.workbench.recorded_logs import (
    LOG_RESULTS,
    Comparison,
    LogContents,
    is_comparison,
    log_contents,
    log_files,
    read_comparison,
)
from cdpr_drake.studio.workbench.result_subject import Subject

TICK = 0.5
"""Time between looks at jobs and folders [s]."""

FIRST = ("follow", "fit-frame", "unit", "log-format")
"""Options that are always shown."""

EMPTY = (
    "No log is open. Put a log of a machine or tracker into the working folder, or simulate a run "
    "in the tab Run, and choose it above: its channels, rates and gaps are listed here. Compare "
    "puts it beside the model of the open robot."
)

COLUMNS = ("channel", "unit", "rows with a number", "rows without", "least", "largest")


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
            bench.jobs, bench.folder.root, LOG_RESULTS, {}, is_whole=is_comparison
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
        self._bench, self._view, self._started = bench, view, 0
        self._read: Path | None = None
        self._shown: Comparison | None = None
        with ui.row().classes("w-full items-center no-wrap"):
            self._log = ui.select(self._files(), label="log in the working folder", with_input=True)
            self._log.props("dense outlined").classes("col").mark("log")
            self._log.on_value_change(self._choose)
            self._start_button = ui.button("Compare", icon="compare_arrows", on_click=self._start)
            self._start_button.props("no-caps").mark("compare-log")
        self._empty = ui.label(EMPTY).classes("studio-empty").mark("logs-empty")
        self._contents = ui.element("div").classes("w-full").mark("log-contents")
        self._fields = CommandFields(
            bench.commands["replay"], view.filled, FIRST,
            {"log-format": Choices([*DIALECTS, AUTO])}, bench.folder,
        )  # fmt: skip
        self._bar = JobBar(view.board, "comparisons")
        self._body = ui.element("div").classes("w-full cdpr-run").mark("comparison")
        self._plots: MovingPlots | None = None
        if view.log:
            self._log.value = view.log
        self._say_empty()
        ui.timer(TICK, self._tick)

    def _files(self) -> list[str]:
        return log_files(self._bench.folder)

    def _say_empty(self) -> None:
        self._empty.set_visibility(not self._view.log)
        self._start_button.set_enabled(bool(self._view.log))

    async def _choose(self) -> None:
        name = self._view.log = str(self._log.value or "")
        self._contents.clear()
        self._say_empty()
        if not name:
            return
        with show_errors():
            found = await run.io_bound(log_contents, self._bench.folder.path(name))
            if found is not None and name == self._view.log:
                with self._contents:
                    _place_contents(found)

    def _start(self) -> None:
        with show_errors():
            try:
                options = self._fields.arguments()
            except FieldProblem:
                return  # the field says it
            path = self._bench.folder.path(self._view.log)
            robot, now = robot_argument(self._bench), self._bench.subject
            name = f"{path.parent.name if path.stem == LOG else path.stem}-{now.robot}"
            about = {"robot": now.robot, "digest": now.digest}
            arguments = ["replay", str(path), f"--robot={robot}", *options]
            self._started = self._view.board.start(name, arguments, about).number
            self._bar.refresh()

    async def _tick(self) -> None:
        with show_errors():
            files = self._files()
            if files != self._log.options:
                self._log.set_options(files, value=self._view.log or None)
            self._bar.refresh()
            self._say_mistake()
            computed = self._bar.computed
            whole = computed is not None and computed.is_whole
            folder = computed.folder if computed is not None and whole else None
            if folder == self._read:
                return
            self._read = folder
            found = None if folder is None else await run.io_bound(read_comparison, folder)
            about = {} if computed is None else computed.about
            self._show(found, about.get("digest", ""))

    def _show(self, found: Comparison | None, digest: str) -> None:
        self._shown = found
        self._bench.results.show(LOG, None if found is None else Subject(found.robot, digest))
        self._body.clear()
        self._plots = None
        if found is None:
            return
        with self._body:
            ui.html(_numbers(found), sanitize=False).classes("w-full").mark("log-numbers")
            self._plots = MovingPlots(self._begin)

    def _begin(self) -> None:
        if self._plots is not None and self._shown is not None:
            self._plots.begin(self._shown.charts, self._shown.end, self._shown.rows)

    def _say_mistake(self) -> None:
        job = self._bench.jobs.job(self._started) if self._started else None
        if job is None or not job.state.is_over:
            return
        self._started = 0
        if job.state == JobState.FAILED:
            key = self._fields.form.field_of(job.message)
            if not (key and self._fields.say(key, job.message)):
                notify(job.message)


def _place_contents(found: LogContents) -> None:
    with ui.expansion("What is in the log", value=True).classes("w-full studio-group"):
        ui.html(fact_rows(found.facts), sanitize=False).classes("w-full").mark("log-facts")
        data = base64.b64encode(found.picture).decode("ascii")
        ui.html(
            f'<img src="data:image/png;base64,{data}" alt="Columns of the log over time" '
            'style="width:100%;background:white">',
            sanitize=False,
        ).classes("w-full")
    with ui.expansion(f"Channels, {len(found.columns)}").classes("w-full studio-group"):
        table = plain_table(COLUMNS, found.columns)
        ui.html(table, sanitize=False).classes("w-full").mark("log-channels")


def _numbers(found: Comparison) -> str:
    """Residuals by cable, and what the comparison says of poses and forces, as HTML."""
    told = found.summary
    rows = [
        (name, _mm(one["length_offset_m"]), _mm(one["length_residual_rms_m"]),
         _mm(one["length_residual_largest_m"]), number_words(one["tension_residual_rms_n"]))
        for name, one in told["cables"].items()
    ]  # fmt: skip
    heads = (
        "cable",
        "length off by [mm]",
        "rms about that [mm]",
        "largest [mm]",
        "tension, rms of the difference [N]",
    )
    facts = {
        "log": escape(Path(str(told["log"])).name),
        "rows": f"{told['rows']['rows']}, with a measured pose {told['rows_with_pose']}, with a "
        f"pose by lengths {told['rows_with_pose_by_lengths']}",
        "position, measured to the model's [mm]": f"{_mm(told['position_by_lengths_rms_m'])} rms, "
        f"{_mm(told['position_by_lengths_largest_m'])} largest",
        "force that tensions and weight leave [N]": number_words(told["unbalanced_force_rms_n"]),
    }
    followed: Any = told.get("followed")
    if followed is not None:
        words = f"{_mm(followed['position_error_rms_m'])} rms"
        facts["simulated robot with the log's lengths, position error [mm]"] = words
    return plain_table(heads, rows) + fact_table(facts)


def _mm(value: float | None) -> str:
    return number_words(None if value is None else 1e3 * value)

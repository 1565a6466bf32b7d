"""Logs of machines and runs in the working folder: what is in one, and one beside a model.

What is in a log is what `cdpr check LOG` says; the comparison is what `cdpr replay` writes.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.logs.columns import LENGTH, PARTS, POSITION, SECONDS, TENSION
from cdpr_drake.analyses.logs.dialects import LOG_SUFFIXES
from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.analyses.logs.log import Log, unit_of
from cdpr_drake.analyses.logs.replay import SUMMARY, TABLE
from cdpr_drake.arrays import Array
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.palette import DASHED, Look, nth_look
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.workbench.plot_rows import Chart
from cdpr_drake.studio.workbench.working_folder import MOST_FILES, WorkingFolder

LOG_RESULTS = "logs"
"""Folder of comparisons in the working folder."""

MOST_ROWS = 1500
"""Rows of a comparison that are drawn, evenly spread."""

DOTS = 110
"""Of the picture [1/inch]."""


def log_files(folder: WorkingFolder) -> list[str]:
    """Files of a working folder that may be logs, those of its runs too."""
    found = [name for name in folder.files(LOG_SUFFIXES) if not name.startswith(f"{LOG_RESULTS}/")]
    runs = sorted(folder.root.glob("runs/*/log.csv"))
    return [*found, *(folder.shown(path) for path in runs)][:MOST_FILES]


@dataclass(frozen=True)
class LogContents:
    """What is in a log.

    Attributes:
        facts: Words by what they say: reader, rows, gaps, units, remarks.
        columns: Header, unit, rows with a number, rows without, least and largest, of each column.
        picture: All kinds of columns over time, as PNG.
    """

    facts: tuple[tuple[str, str], ...]
    columns: tuple[tuple[str, ...], ...]
    picture: bytes


def log_contents(path: Path) -> LogContents:
    """Reads a log, by the reader that knows it.

    Raises:
        LogFileError: No reader knows it, or it is damaged; one line.
    """
    log = import_log(path)
    picture = io.BytesIO()
    log.plot().savefig(picture, format="png", dpi=DOTS)
    facts = [
        ("log", f"Log {log.path.name}, {log.dialect}"), ("read so", log.why),
        ("rows", log.rows_words()), ("columns", f"{len(log.frame.columns)}, in the table below"),
        *log.units.items(), *(("note", words) for words in log.remarks),
    ]  # fmt: skip
    return LogContents(tuple(facts), _columns(log), picture.getvalue())


def _columns(log: Log) -> tuple[tuple[str, ...], ...]:
    rows, found = len(log.frame), log.as_dict()["columns"]
    return tuple(
        (
            header,
            unit_of(header) or "–",
            str(about["rows"]),
            str(rows - about["rows"]),
            *("–" if value is None else f"{value:.5g}" for value in _range(about)),
        )
        for header, about in found.items()
    )


def _range(about: Mapping[str, Any]) -> tuple[float | None, float | None]:
    return about["least"], about["largest"]


@dataclass(frozen=True)
class Comparison:
    """A log beside a model, as `cdpr replay` left it in a folder.

    Attributes:
        summary: The command's summary.
        charts: Residuals, lengths, tensions and positions, measured and the model's.
        rows: Time and the curves of one chart after the other; None: not known.
        end: The last time [s].
    """

    summary: Mapping[str, Any]
    charts: tuple[Chart, ...]
    rows: list[list[float | None]]
    end: float

    @property
    def robot(self) -> str:
        """Name of the robot that the model is of."""
        return str(self.summary["robot"])


def is_comparison(folder: Path) -> bool:
    """Whether a folder has what `cdpr replay` writes."""
    return all((folder / name).is_file() for name in (SUMMARY, TABLE))


def read_comparison(folder: Path) -> Comparison:
    """Reads what `cdpr replay` wrote.

    Raises:
        OutputFolderError: There is none, or it cannot be read.
    """
    try:
        summary = load_json((folder / SUMMARY).read_text(encoding="utf-8"))
        with (folder / TABLE).open(encoding="utf-8", newline="") as file:
            heads, *lines = csv.reader(file)
        kept = np.unique(np.linspace(0, len(lines) - 1, min(len(lines), MOST_ROWS)).astype(int))
        cells = [[float(cell) if cell else np.nan for cell in lines[k]] for k in kept]
        table = dict(zip(heads, np.array(cells).T, strict=True))
        return _compared(summary, table)
    except (OSError, ValueError, KeyError, IndexError, csv.Error) as problem:
        raise OutputFolderError(f"{folder.name}: cannot be read: {problem}") from problem


def _compared(summary: Mapping[str, Any], table: Mapping[str, Array]) -> Comparison:
    charts: list[Chart] = []
    curves: list[Array] = []
    cables = list(summary["cables"])

    def add(title: str, series: Sequence[tuple[str, Look, Array]]) -> None:
        known = [one for one in series if np.isfinite(one[2]).any()]
        if known:
            charts.append(Chart(title, tuple((name, look) for name, look, _ in known)))
            curves.extend(values for _, _, values in known)

    def of_cables(what: str) -> list[tuple[str, Look, Array]]:
        pairs = []
        for k, name in enumerate(cables):
            look = nth_look(k)
            pairs.append((name, look, table[f"{name}_{what}"]))
            model = table[f"{name}_predicted_{what}"]
            pairs.append((f"{name} by the model", Look(look.color, DASHED), model))
        return pairs

    add(
        "length, measured minus the model's [mm]",
        [
            (
                name,
                nth_look(k),
                1e3 * (table[f"{name}_{LENGTH}"] - table[f"{name}_predicted_{LENGTH}"]),
            )
            for k, name in enumerate(cables)
        ],
    )
    add("cable length [m]", of_cables(LENGTH))
    add("tension [N]", of_cables(TENSION))
    places = []
    for k, header in enumerate(PARTS[POSITION]):
        axis, look = header[0], nth_look(k)
        places.append((axis, look, table[header]))
        model = table[f"by_lengths_{header}"]
        places.append((f"{axis} by the model", Look(look.color, DASHED), model))
    add("position [m]", places)
    whole = np.column_stack([table[SECONDS], *curves])
    rows = [[float(v) if np.isfinite(v) else None for v in row] for row in whole]
    return Comparison(summary, tuple(charts), rows, float(table[SECONDS][-1]))

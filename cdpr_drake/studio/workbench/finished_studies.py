"""What studies left in their folders: statements with verdicts, tables, figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json

STUDY_RESULTS = "studies"
"""Folder of results in the working folder, as that of `cdpr study`."""

FIGURES = (".png", ".svg")
"""Endings of figures that a page shows."""

MOST_ROWS, MOST_COLUMNS = 60, 12
"""Of a table that is shown; the file has all."""

LARGEST_RESULTS = 64_000_000
"""Of a file that is read [bytes]."""

MOST_FIGURES = 200
"""Figures that are listed."""


@dataclass(frozen=True)
class StudyFolder:
    """What a study left.

    Attributes:
        folder: Its folder.
        facts: Single numbers and words.
        statements: What the source says and what was found: words, printed, found, verdict, why.
        tables: Other tables by name: columns, rows, and how many rows there are in the file.
        figures: Its figures.
    """

    folder: Path
    facts: dict[str, str]
    statements: list[dict[str, str]]
    tables: dict[str, tuple[list[str], list[list[str]], int]]
    figures: list[Path]

    def remarks(self) -> str:
        """What has to be known beside its verdicts; empty: nothing."""
        said = {"interrupted": "stopped before its end", "quick": "short form"}
        return ", ".join(words for key, words in said.items() if self.facts.get(key) == "yes")

    def verdicts(self) -> dict[str, int]:
        """How many statements got each verdict."""
        found: dict[str, int] = {}
        for statement in self.statements:
            name = statement.get("verdict", "")
            found[name] = found.get(name, 0) + 1
        return found


def study_folder(folder: Path) -> StudyFolder:
    """Reads the results of a study.

    Raises:
        CdprError: There are none that can be read.
    """
    path = folder / "results.json"
    try:
        if path.stat().st_size > LARGEST_RESULTS:
            raise CdprError(f"{folder.name}: results.json is larger than {LARGEST_RESULTS} bytes")
        told = load_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as problem:
        raise CdprError(f"{folder.name}: results.json cannot be read: {problem}") from problem
    if not isinstance(told, dict):
        raise CdprError(f"{folder.name}: results.json: found no results of a study")
    return StudyFolder(
        folder,
        {key: _words(value) for key, value in told.items() if _is_single(value)},
        [
            {str(key): _words(value) for key, value in row.items()}
            for row in told.get("statements", []) if isinstance(row, dict)
        ],
        {
            key: _table(value) for key, value in told.items()
            if key != "statements" and isinstance(value, list) and value
            and all(isinstance(row, dict) for row in value)
        },
        _figures(folder),
    )  # fmt: skip


def study_folders(folders: list[Path]) -> list[StudyFolder]:
    """Reads those of several folders that can be read."""
    found = []
    for folder in folders:
        try:
            found.append(study_folder(folder))
        except CdprError:
            continue
    return found


def _figures(folder: Path) -> list[Path]:
    """Figures here and one folder below; none that a link leads to."""
    some = [
        path for pattern in ("*", "*/*") for path in sorted(folder.glob(pattern))
        if path.suffix.lower() in FIGURES and path.is_file()
        and path.resolve().is_relative_to(folder.resolve())
    ]  # fmt: skip
    return some[:MOST_FIGURES]


def _is_single(value: Any) -> bool:
    return value is None or isinstance(value, str | int | float)


def _table(rows: list[dict[str, Any]]) -> tuple[list[str], list[list[str]], int]:
    columns = [key for key, value in rows[0].items() if _is_single(value)][:MOST_COLUMNS]
    shown = [[_words(row.get(key)) for key in columns] for row in rows[:MOST_ROWS]]
    return columns, shown, len(rows)


def _words(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)[:400]

"""Runs that an earlier version of the code computed, taken over where the user asks for it.

A study whose statements, tables or figures have changed needs its runs again, not new ones. Which
code computed what is taken over is kept beside the chunks and told in the results.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.written_files import MARKER
from cdpr_drake.analyses.sweeps.folder import (
    ARGUMENTS,
    KeptChunks,
    SweepFolder,
    differences,
    read_arguments,
)
from cdpr_drake.analyses.sweeps.workers import SweepTask
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.schema.json_text import load_json

EARLIER = "earlier_runs.json"
"""Which tasks of a folder were taken over, by the code that computed them."""

CODE = "cdpr_drake"
"""Key of the code's version in the arguments of a study."""

SAME = ("study", "quick")
"""Keys of arguments that have to be the same; it is another study otherwise."""

COUNTED = "runs"
"""Key of a case that says how often it is measured; more or fewer are no other runs."""


@dataclass(frozen=True)
class EarlierRuns:
    """Runs that were taken over.

    Attributes:
        codes: By task, the version of the code that computed it.
        of: How many tasks there are.
        why_not: Why none was, in words; empty: some were, or none was asked for.
    """

    codes: Mapping[str, str] = field(default_factory=dict)
    of: int = 0
    why_not: str = ""

    def counts(self) -> dict[str, int]:
        """How many tasks are of which code."""
        return dict(Counter(self.codes.values()))

    def words(self) -> str:
        """What to say of them; empty where there is nothing to say."""
        if self.why_not:
            return f"no earlier runs were taken over: {self.why_not}"
        told = [f"{count} of {self.of} by {code}" for code, count in self.counts().items()]
        return f"runs that earlier code computed: {', '.join(told)}" if told else ""


def read_taken(folder: Path, of: int) -> EarlierRuns:
    """What was taken over into a folder by this or an earlier session, of so many tasks."""
    try:
        content = load_json((folder / EARLIER).read_text(encoding="utf-8"))
        return EarlierRuns({str(task): str(code) for task, code in content.items()}, of)
    except (OSError, ValueError, AttributeError):
        return EarlierRuns()


def take_over(
    kept: SweepFolder,
    earlier: Path,
    tasks: Mapping[str, tuple[SweepTask, int]],
    chunk_size: int,
    arguments: Mapping[str, Any],
    *,
    case_of: Mapping[str, str],
    alone: Collection[str] = (),
) -> EarlierRuns:
    """Copies runs of an earlier folder of the same study whose cases are asked for alike.

    The arguments of a case and the study's parameters have to be the same to the last digit; the
    code need not. What measures times is never taken over.

    Args:
        kept: Where runs are kept now.
        earlier: Folder of the study that was run before; it is only read.
        tasks: Per name the task and its number of items.
        chunk_size: Items per chunk.
        arguments: All that the numbers depend on, of the study that is run now.
        case_of: By task the name of its case in `arguments["cases"]`.
        alone: Names of tasks that measure times.

    Raises:
        OutputFolderError: The earlier folder holds no such study, or `kept` cannot be written.
    """
    there = check_earlier(earlier, {key: arguments[key] for key in SAME})
    parameters = _plain(arguments["parameters"])
    other = list(differences(there.get("parameters"), parameters, "parameters"))
    if other:
        return EarlierRuns(of=len(tasks), why_not=other[0])
    source, codes = KeptChunks(earlier), dict(read_taken(kept.folder, len(tasks)).codes)
    before = read_taken(earlier, len(tasks)).codes
    alike = _alike(there["cases"], _plain(arguments["cases"]))
    wanted: dict[str, dict[tuple[int, int], dict[str, np.ndarray]]] = {}
    for name, (_, count) in tasks.items():
        if case_of[name] not in alike or name in alone:
            continue
        chunks = {
            (start, stop): source.load(name, start, stop)
            for start in range(0, count, chunk_size)
            if (stop := min(start + chunk_size, count))
        }
        if name not in codes and all(kept.load(name, *place) is not None for place in chunks):
            continue  # computed here before
        found = {place: arrays for place, arrays in chunks.items() if arrays is not None}
        if len(found) == len(chunks):
            wanted[name] = found
            codes[name] = before.get(name, str(there.get(CODE)))
    # Before the runs: killed meanwhile, they are not taken for those of this code.
    write_json(kept.folder / EARLIER, codes)
    for name, chunks_of in wanted.items():
        for place, arrays in chunks_of.items():
            if kept.load(name, *place) is None:
                kept.store(name, *place, arrays)
    lacking = "" if codes else "its cases are other ones, or are not finished"
    return EarlierRuns(codes, len(tasks), lacking)


def check_earlier(earlier: Path, wanted: Mapping[str, Any]) -> dict[str, Any]:
    """What an earlier study was asked for.

    Args:
        earlier: Its folder.
        wanted: What its arguments have to be: `study`, `quick`.

    Raises:
        OutputFolderError: It holds no such study.
    """
    path = earlier / ARGUMENTS
    if not (earlier / MARKER).is_file() or not path.is_file():
        raise OutputFolderError(f"{earlier}: found no study; accepted: a folder of cdpr study")
    try:
        found = read_arguments(path)
    except OSError as problem:
        raise OutputFolderError(f"{path}: cannot be read: {problem.strerror}") from problem
    cases = found.get("cases") if isinstance(found, dict) else None
    if not isinstance(cases, dict) or not all(isinstance(one, dict) for one in cases.values()):
        raise OutputFolderError(f"{path}: found no cases; accepted: a study of cases")
    for key, value in wanted.items():
        if found.get(key) != value:
            words = f"found {key} {json.dumps(found.get(key))}; accepted: {json.dumps(value)}"
            raise OutputFolderError(f"{earlier}: {words}")
    return found


def _alike(there: Mapping[str, Any], here: Mapping[str, Any]) -> set[str]:
    """Cases that are asked for alike, with those whose arrays they share."""

    def asked(cases: Mapping[str, Any], name: str) -> dict[str, Any]:
        return {key: value for key, value in cases[name].items() if key != COUNTED}

    return {name for name in here if name in there and asked(there, name) == asked(here, name)}


def _plain(value: Any) -> Any:
    """As JSON gives it back."""
    return load_json(json.dumps(value))

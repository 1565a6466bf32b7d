"""The store of Monte Carlo runs: each finished run is kept in a folder, by its seed.

Whatever ends the program loses no finished run. `RunRecord` is what is kept of one, `StoredRuns`
the folder.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.frame.folder import differences, load_arrays
from cdpr_drake.analyses.reporting.log_files import write_whole
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.reporting.written_files import (
    JOURNAL,
    MARKER,
    mark,
    whole_file,
    whole_name,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.models.robot_loader import robot_text
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.yaml_files import load_yaml, plain_values
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

CONVERGED = "converged"

ARGUMENTS, CHUNKS = "arguments.json", "chunks"
"""All that the runs of a folder depend on, and the folder of finished runs, a file each."""

NAMED_DIFFERENCES = 3
"""So many differences between arguments are named in an error."""


@dataclass(frozen=True, eq=False)
class RunRecord:
    """What is kept of a run.

    Attributes:
        index: Which of the scenarios it was.
        seed: Its seed.
        summary: Its summary, as `cdpr simulate` writes it.
        end: Last true pose of the platform in the frame of the desired one, as `pose_row`.
        traces: Arrays for figures, see `run_traces`; empty if they were not asked for.
    """

    index: int
    seed: int
    summary: dict[str, Any]
    end: Array
    traces: dict[str, Array]

    @property
    def converged(self) -> bool:
        """Whether the run reached its desired pose."""
        return bool(self.summary["outcome"] == CONVERGED)


_SUMMARY, _END, _TRACE = "summary", "end", "trace."


def repetition_arguments(scenario: Scenario) -> dict[str, Any]:
    """All that a run over a seed depends on but the seed, for JSON: scenario, robot, code."""
    wanted = plain_values(scenario)
    del wanted["seed"]
    robot = load_yaml(robot_text(scenario.robot))
    return {"cdpr_drake": code_version(), "scenario": wanted, "robot": robot}


def repetition_folder(scenario: Scenario) -> Path:
    """A folder below runs/ that repetitions of the same scenario find again."""
    words = json.dumps(repetition_arguments(scenario), sort_keys=True)
    return Path("runs") / f"{scenario.name}-{hashlib.sha256(words.encode()).hexdigest()[:8]}"


class StoredRuns:
    """Finished runs of one scenario in a folder, by their seeds; other seeds can follow later.

    The file of a run appears whole or not at all, so that what is there can be used, whatever ended
    the program.
    """

    def __init__(self, folder: Path, scenario: Scenario) -> None:
        """Opens the folder, or makes it.

        Raises:
            OutputFolderError: The folder belongs to other arguments, which are named, holds other
                files, is a file, or cannot be written.
        """
        self._folder = folder.absolute()
        arguments = json.dumps(repetition_arguments(scenario), indent=2, allow_nan=False)
        with self._writing():
            self._check(arguments)
            self._folder.mkdir(parents=True, exist_ok=True)
            mark(self._folder)
            for path in self._folder.iterdir():
                if whole_name(path.name) == ARGUMENTS:  # left by a killed process
                    path.unlink()
            if not (self._folder / ARGUMENTS).is_file():
                write_whole(self._folder / ARGUMENTS, arguments + "\n")

    def _check(self, arguments: str) -> None:
        stored = self._folder / ARGUMENTS
        if self._folder.exists() and not self._folder.is_dir():
            raise OutputFolderError(f"{self._folder}: found a file; accepted: a folder")
        if not stored.is_file():
            names = {path.name for path in self._folder.glob("*")}
            if any(
                whole_name(name) not in (ARGUMENTS, MARKER) for name in names - {MARKER, JOURNAL}
            ):
                raise OutputFolderError(
                    f"{self._folder}: holds files already, not those of repeated runs; name "
                    "another folder"
                )
            return
        try:
            there = load_json(stored.read_text(encoding="utf-8"))
        except ValueError as problem:
            raise OutputFolderError(
                f"{stored}: found no JSON; remove the folder or name another"
            ) from problem
        different = list(differences(there, load_json(arguments)))
        if different:
            more = len(different) - NAMED_DIFFERENCES
            raise OutputFolderError(
                f"{self._folder}: holds results of other arguments: "
                + "; ".join(different[:NAMED_DIFFERENCES])
                + (f"; and {more} more" if more > 0 else "")
                + "; name another folder"
            )

    def load(self, index: int, seed: int) -> RunRecord | None:
        """The run over a seed, as the given one of the scenarios; None if it is not there."""
        arrays = load_arrays(self._file(seed))
        if arrays is None:
            return None
        return RunRecord(
            index=index,
            seed=seed,
            summary=load_json(arrays[_SUMMARY].tobytes()),
            end=arrays[_END],
            traces={
                name.removeprefix(_TRACE): values
                for name, values in arrays.items()
                if name.startswith(_TRACE)
            },
        )

    def store(self, record: RunRecord) -> None:
        """Keeps a finished run.

        Raises:
            OutputFolderError: It cannot be written, for instance on a full disk.
        """
        words = json.dumps(record.summary).encode()
        arrays: dict[str, np.ndarray] = {
            _SUMMARY: np.frombuffer(words, np.uint8),
            _END: record.end,
            **{f"{_TRACE}{name}": values for name, values in record.traces.items()},
        }
        with self._writing():
            (self._folder / CHUNKS).mkdir(exist_ok=True)
            with whole_file(self._file(record.seed)) as part, part.open("wb") as file:
                np.savez_compressed(file, allow_pickle=False, **arrays)

    def _file(self, seed: int) -> Path:
        return self._folder / CHUNKS / f"seed-{seed}.npz"

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as problem:
            raise OutputFolderError(
                f"{self._folder}: cannot be written: {problem.strerror}; what was finished "
                "before is kept, and found by the same command"
            ) from problem

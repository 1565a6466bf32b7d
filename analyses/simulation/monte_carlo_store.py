"""The store of Monte Carlo runs: each finished run is kept in a folder, by its seed.

Whatever ends the program loses no finished run. `RunRecord` is what is kept of one, `StoredRuns`
the folder.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_loader import robot_text
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.yaml_files import load_yaml, plain_values
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

CONVERGED = "converged"


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
    """Finished runs of one scenario in a folder, by their seeds; other seeds can follow later."""

    def __init__(self, folder: Path, scenario: Scenario) -> None:
        """Opens the folder, or makes it; raises as `SweepFolder`."""
        self._folder = SweepFolder(folder, repetition_arguments(scenario))

    def load(self, index: int, seed: int) -> RunRecord | None:
        """The run over a seed, as the given one of the scenarios; None if it is not there."""
        arrays = self._folder.load(_task(seed), 0, 1)
        if arrays is None:
            return None
        return RunRecord(
            index=index,
            seed=seed,
            summary=load_json(arrays[_SUMMARY].tobytes()),
            end=arrays[_END][0],
            traces={
                name.removeprefix(_TRACE): values[0]
                for name, values in arrays.items()
                if name.startswith(_TRACE)
            },
        )

    def store(self, record: RunRecord) -> None:
        """Keeps a finished run; raises OutputFolderError where it cannot be written."""
        words = json.dumps(record.summary).encode()
        arrays: dict[str, np.ndarray] = {
            _SUMMARY: np.frombuffer(words, np.uint8)[np.newaxis],
            _END: record.end[np.newaxis],
            **{f"{_TRACE}{name}": values[np.newaxis] for name, values in record.traces.items()},
        }
        self._folder.store(_task(record.seed), 0, 1, arrays)


def _task(seed: int) -> str:
    return f"seed-{seed}"

"""Checkpoints: files from which a run continues whose program ended before it did."""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.frame.folder import differences
from cdpr_drake.analyses.reporting.log_on_disk import CHECKPOINT, UNWRITTEN_CHECKPOINT
from cdpr_drake.analyses.reporting.provenance import code_version, mechanism_arguments
from cdpr_drake.analyses.reporting.written_files import claim
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CheckpointError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.yaml_files import plain_values

_ABOUT, _STATE = "about", "state."
NAMED = 3
"""So many differences between what was simulated and what is to be are named in an error."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkpoint:
    """Where a run stood.

    Attributes:
        asked: All that the run depends on, for JSON: code, scenario, robot.
        state: State of its diagram, see `monitoring.context_state.state_arrays`.
        rows: Rows of the log on disk by then.
        wall_time: Time that the run had taken [s].
    """

    asked: dict[str, Any]
    state: dict[str, Array]
    rows: int
    wall_time: float


def run_arguments(scenario: Any) -> dict[str, Any]:
    """All that a run of a scenario of any kind depends on, for JSON: code, scenario, robot."""
    wanted = plain_values(scenario)
    if "mechanism" in wanted:  # by its contents, wherever its file is
        moved = mechanism_arguments(wanted.pop("mechanism"))
        return {"cdpr_drake": code_version(), "scenario": wanted, **moved}
    del wanted["robot"]  # by its contents, wherever its file is
    file = getattr(getattr(scenario, "trajectory", None), "file", None)
    if file is not None:
        wanted["trajectory"]["file"] = hashlib.sha256(Path(file).read_bytes()).hexdigest()
    robot = plain_values(load_robot(scenario.robot))
    return {"cdpr_drake": code_version(), "scenario": wanted, "robot": robot}


def write_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Writes a checkpoint beside a log in its folder, in the place of an older one, at once.

    The file is numpy's, of numbers and JSON. What the operating system has not written yet, of the
    log either, survives the end of the program, not that of the machine; a log that is shorter than
    its checkpoint is refused.

    Raises:
        OSError: It cannot be written.
    """
    about = {
        "asked": checkpoint.asked, "rows": checkpoint.rows, "wall_time": checkpoint.wall_time
    }  # fmt: skip
    arrays = {f"{_STATE}{name}": values for name, values in checkpoint.state.items()}
    arrays[_ABOUT] = np.frombuffer(json.dumps(about).encode(), np.uint8)
    final = folder / CHECKPOINT
    part = folder / UNWRITTEN_CHECKPOINT
    claim(final, part)
    part.unlink(missing_ok=True)
    with part.open("xb") as file:  # which follows no link
        np.savez(file, allow_pickle=False, **arrays)
        file.flush()
        os.fsync(file.fileno())
    part.replace(final)


def read_checkpoint(folder: Path, asked: dict[str, Any]) -> Checkpoint:
    """The checkpoint beside a log in its folder.

    Args:
        folder: The log's folder.
        asked: What the run that is to be continued depends on.

    Raises:
        CheckpointError: There is none, it cannot be read, or it is that of another run.
    """
    path = folder / CHECKPOINT
    if not path.is_file():
        raise CheckpointError(
            f"{folder.parent}: holds no checkpoint: the run was ended too soon after its start; "
            "finish_run makes results of its log"
        )
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            about = load_json(stored[_ABOUT].tobytes())
            found = Checkpoint(
                asked=about["asked"],
                state={
                    name.removeprefix(_STATE): stored[name]
                    for name in stored.files
                    if name.startswith(_STATE)
                },
                rows=int(about["rows"]),
                wall_time=float(about["wall_time"]),
            )
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile, zlib.error) as problem:
        raise CheckpointError(f"{path}: no checkpoint that can be read: {problem}") from problem
    different = list(differences(found.asked, load_json(json.dumps(asked))))
    if different:
        more = len(different) - NAMED
        raise CheckpointError(
            f"{path}: is that of another run: "
            + "; ".join(different[:NAMED])
            + (f"; and {more} more" if more > 0 else "")
            + "; finish_run makes results of what there is"
        )
    return found

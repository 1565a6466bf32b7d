"""Verb: the stability criterion along the run of a folder."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import figure_writers
from cdpr_drake.analyses.frame.folder import Folder, read_marker
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS, Formats, OutFolder, words
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.runs.log import PARTS, DiskLog, Log, StoredLog
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.stability import Stability, stability_along, stability_figure
from cdpr_drake.errors import CdprError, OutputFolderError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

QUANTITIES = ("time", "X_WP", "X_WP_estimated", "tensions", "slack")
"""Quantities of a log from which the criterion is computed, beside joints of a camera."""


@dataclass(frozen=True, eq=False, repr=False)
class RunStability(Result):
    """Stability along the run of a folder.

    Attributes:
        run: The run's folder.
        title: What the run was.
        threshold: Tension from which a cable counts as taut [N]; None: by the log's "slack".
        along: Cables, rank and margin over time.
        folder: Where it was written.
        failed: Files that could not be written, and why.
    """

    run: Path
    title: str
    threshold: float | None
    along: Stability
    folder: Path
    failed: dict[str, str] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Its numbers, for JSON."""
        along = self.along
        below = np.diff(along.time) * (along.rank[:-1] < along.freedom)
        numbers: dict[str, Any] = finite({
            "run": str(self.run),
            "threshold_n": self.threshold,
            "rows": len(along.time),
            "freedom": along.freedom,
            "taut_cables": {"min": int(np.min(along.taut)), "end": int(along.taut[-1])},
            **along.numbers(),
            "underactuated_s": float(np.sum(below)),
        })  # fmt: skip
        return numbers

    def tables(self) -> list[Table]:
        """Least numbers of cables, rank and margin, and times."""
        numbers = self.as_dict()
        margin, taut = numbers["least_stability_margin"], numbers["taut_cables"]
        return [Table(f"{self.run}: stability along the run", rows=[
            ("cables that pull", f"at least {taut['min']}, {taut['end']} at the end"),
            ("rank of the Jacobian", f"at least {numbers['least_jacobian_rank']}"),
            (f"rank below {numbers['freedom']}", f"{numbers['underactuated_s']:.2f} s"),
            ("least eigenvalue of sym(Pi)", "unknown" if margin is None else f"{margin:.3f}"),
            ("not stable", f"{numbers['unstable_s']:.2f} s"),
            ("results", str(self.folder)),
        ])]  # fmt: skip

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Cables that pull, rank and margin over time."""
        title = f"Cables that pull, and stability of the servo\n{self.title}"
        return {"stability": partial(stability_figure, title, self.along)}

    def write(self, folder: Folder) -> None:
        """Writes `stability.json` and `stability.npz`.

        Raises:
            OutputFolderError: The folder cannot be written.
        """
        along = self.along
        folder.write_json("stability.json", self.as_dict())
        folder.write_arrays("stability.npz", {
            "time": along.time, "taut_cables": along.taut, "jacobian_rank": along.rank,
            "stability_margin": along.margin,
        })  # fmt: skip


@verb()
def assess_run(
    *, along: Annotated[Path, words(Path, "the folder of a run", "RUN", name="--along")],
    threshold: float | None = None, folder: OutFolder = None, formats: Formats = DEFAULT_FORMATS,
) -> RunStability:  # fmt: skip
    """Judges the stability of a visual servo along a run, with slack cables left out.

    Args:
        along: Folder that cdpr simulate wrote, or what a killed run left.
        threshold: Tension from which a cable counts as taut [N]; default: one that is not slack.
        folder: Folder of the results; default: the run's.
        formats: Formats of the figure's files.

    Raises:
        OutputFolderError: The run's folder holds no log of a visual servo, or results cannot be
            written.
        ScenarioError: Its scenario is not accepted.
    """
    if threshold is not None and not (math.isfinite(threshold) and threshold >= 0.0):
        raise CdprError(f"threshold: found {threshold:g}; accepted: >= 0 [N]")
    path = Path(along)
    log = _log_of(path)
    scenario = load_scenario(path / "scenario.yaml")
    if not isinstance(scenario, Scenario):
        raise OutputFolderError(
            f"{path}: found a run of kind {scenario.kind}; accepted: one of a visual servo"
        )
    scenario.camera.kind = "projected"  # poses and tensions of the log count: nothing is rendered
    run = ServoRun(scenario)
    run.log = log
    title = f"{scenario.title}\n({scenario.name}, seed {scenario.seed})"
    marker = read_marker(path) if folder is None else None
    arguments: Mapping[str, Any] = {"along": str(path.resolve()), "threshold": threshold}
    if marker is not None:
        arguments = marker["arguments"]
    with Folder(Path(folder or path), arguments, grows=True) as results:
        judged = stability_along(run, threshold)
        result = RunStability(path, title, threshold, judged, results.path)
        result.write(results)
        result.failed.update(results.write_all(figure_writers(result.figures(), formats)))
        if marker is None or marker["complete"]:
            results.complete()
    return result


def _log_of(folder: Path) -> Log:
    """The log of a folder, or that which a killed run left."""
    accepted = "accepted: a folder of a visual servo that cdpr simulate wrote"
    if (folder / PARTS).is_dir():
        stored: Log = DiskLog(folder / PARTS)
    elif (folder / "log.npz").is_file() and (folder / "scenario.yaml").is_file():
        try:
            stored = StoredLog(folder / "log.npz")
        except (OSError, ValueError, EOFError, zipfile.BadZipFile) as problem:
            raise OutputFolderError(f"{folder}: log.npz cannot be read: {problem}") from problem
    else:
        raise OutputFolderError(f"{folder}: found no log; {accepted}")
    missing = [name for name in QUANTITIES if name not in stored]
    if missing:
        raise OutputFolderError(f"{folder}: found a log without {', '.join(missing)}; {accepted}")
    return stored

"""Stability along a run: its figure, and the same from the log in a folder of a run."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    draw_curve,
    line_style,
    new_figure,
    shade,
    write_figures,
)
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS, Formats, OutFolder, words
from cdpr_drake.analyses.reporting.left_folders import holds_log
from cdpr_drake.analyses.reporting.log_files import finite, write_json
from cdpr_drake.analyses.reporting.log_on_disk import PARTS, Log, LogOnDisk
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.analyses.simulation.run_stability import StabilityAlong, stability_along
from cdpr_drake.analyses.simulation.visual_servo_run import unfinished_run
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, OutputFolderError, why_not_read
from cdpr_drake.palette import BOUND, DISTANCE, LOST, PLATFORM
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

DEEPEST = -1.5
"""Least margin that is drawn to scale [-]: nearly singular rows make it as low as one likes."""


def stability_figure(title: str, along: StabilityAlong) -> Figure:
    """Number of cables that pull, rank of the Jacobian and margin of the criterion over time; red
    and hatched where the rank is less than the platform's degrees of freedom."""
    figure, axes = new_figure(3, 1, (10.0, 9.0), title)
    lost = along.rank < along.freedom
    needed = f"holds the platform: {along.freedom}"
    most = max(float(np.max(along.taut)), along.freedom) + 0.5
    for panel, values, label in (
        (axes[0], along.taut, "cables that pull [-]"),
        (axes[1], along.rank, "rank of the Jacobian [-]"),
    ):
        draw_steps(panel, along.time, values, lost)
        panel.axhline(along.freedom, label=needed, **line_style(BOUND))
        panel.set(ylabel=label, ylim=(-0.2, most), yticks=range(int(most) + 1))
    shown = np.maximum(along.margin, DEEPEST)
    draw_curve(axes[2], along.time, shown, DISTANCE, "margin")
    axes[2].axhline(0.0, label="stable above 0", **line_style(BOUND))
    axes[2].set(ylabel="least eigenvalue of sym(Pi) [-]")
    if np.nanmin(along.margin, initial=np.inf) < DEEPEST:
        axes[2].set_title(
            f"least {np.nanmin(along.margin):.2f}, cut off at {DEEPEST:g}", fontsize=9
        )
    for panel in axes:
        shade(panel, along.time, lost, f"rank below {along.freedom}", LOST)
        panel.set(xlim=(along.time[0], along.time[-1]))
        panel.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    axes[-1].set(xlabel="time [s]")
    return figure


def draw_steps(axes: Any, times: Array, values: Array, lost: np.ndarray) -> None:
    """A whole number over time, shape (n,), thick and red where the rank is lost."""
    axes.step(times, values, where="post", **line_style(PLATFORM) | {"marker": ""})
    red = np.where(lost, values, np.nan)
    axes.step(times, red, where="post", color=LOST.color, linewidth=3.0)


NEEDED = ("time", "X_WP", "X_WP_estimated", "tensions", "slack")
"""Quantities of a log that tell how stable the servo was."""


@dataclass(frozen=True, eq=False, repr=False)
class RunStability(Result):
    """Stability along the run of a folder.

    Attributes:
        run: The run's folder.
        title: What the run was.
        threshold: Tension from which a cable counts as taut [N]; None: one that was not slack.
        along: Cables, rank and margin over time.
        folder: Where it was written.
        failed: Why figures were not written, by file.
    """

    run: Path
    title: str
    threshold: float | None
    along: StabilityAlong
    folder: Path
    failed: Mapping[str, str] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Its numbers, for JSON."""
        along = self.along
        numbers: dict[str, Any] = finite({
            "run": str(self.run),
            "threshold_n": self.threshold,
            "rows": len(along.time),
            "freedom": along.freedom,
            "taut_cables": {"min": int(np.min(along.taut)), "end": int(along.taut[-1])},
            "least_jacobian_rank": int(np.min(along.rank)),
            "underactuated_s": along.underactuated_time(),
            "least_stability_margin": along.least_margin(),
            "unstable_s": along.unstable_time(),
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

    def write(self, formats: Sequence[str] = DEFAULT_FORMATS) -> dict[str, str]:
        """Writes `stability.json`, `stability.npz`, then the figure.

        Returns:
            Why figures were not written, by file.

        Raises:
            OutputFolderError: The folder cannot be written.
        """
        along = self.along
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_json(self.folder / "stability.json", self.as_dict())
            with whole_file(self.folder / "stability.npz") as part:
                np.savez_compressed(
                    part, time=along.time, taut_cables=along.taut, jacobian_rank=along.rank,
                    stability_margin=along.margin,
                )  # fmt: skip
            return write_figures(self.folder, self.figures(), formats)
        except OSError as problem:
            raise OutputFolderError(
                f"{self.folder}: cannot be written: {why_not_read(problem)}"
            ) from problem


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
    run = Path(along)
    log = _needed(run)
    # Only poses and tensions of the log count: nothing is rendered.
    scenario = load_scenario(str(run / "scenario.yaml"), ())
    if not isinstance(scenario, Scenario):
        raise OutputFolderError(
            f"{run}: found a run of kind {scenario.kind}; accepted: one of a visual servo"
        )
    scenario.camera.kind = "projected"
    judged = stability_along(unfinished_run(scenario, log), threshold)
    title = f"{scenario.title}\n({scenario.name}, seed {scenario.seed})"
    result = RunStability(run, title, threshold, judged, run if folder is None else Path(folder))
    return replace(result, failed=result.write(formats))


def _needed(folder: Path) -> Log:
    """Those quantities of a folder's log."""
    accepted = "accepted: a folder of a visual servo that cdpr simulate wrote"
    if holds_log(folder):
        stored: Log = LogOnDisk.open(folder / PARTS)
    elif (folder / "log.npz").is_file() and (folder / "scenario.yaml").is_file():
        try:
            with np.load(folder / "log.npz", allow_pickle=False) as arrays:
                stored = {name: arrays[name] for name in NEEDED if name in arrays}
        except (OSError, ValueError, EOFError) as problem:
            raise OutputFolderError(f"{folder}: log.npz cannot be read: {problem}") from problem
    else:
        raise OutputFolderError(f"{folder}: found no log; {accepted}")
    missing = [name for name in NEEDED if name not in stored]
    if missing:
        raise OutputFolderError(f"{folder}: found a log without {', '.join(missing)}; {accepted}")
    return stored

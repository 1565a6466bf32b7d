"""Identification from free motion, as one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.calibration.free_motion import (
    FreeMotion,
    FreeMotionTask,
    FreeSigmas,
    fit_free_motion,
)
from cdpr_drake.analyses.calibration.free_motion_report import free_motion_fit
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.front.fitted_robots import FittedRobot, Keeping, kept_fit
from cdpr_drake.analyses.front.session import Say, Session
from cdpr_drake.analyses.logs.measurements import Measurements, read_measurements
from cdpr_drake.errors import IdentificationError, accepted_names
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import as_kind

Spans = Sequence[tuple[float, float]]
"""First and last instants of stretches of a log [s]."""

MOST_PARAMETERS = 7
"""So many are shown where an identification shows itself."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class RobotFreeMotion(FittedRobot, FreeMotion):
    """A `FreeMotion` that shows and draws itself."""

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: parameters, and how held-out stretches were predicted."""
        rows = [
            (u.name, f"{x:.5g} +- {s:.2g} {u.unit}, believed {u.before:.5g}")
            for u, x, s in zip(self.unknowns, self.values, self.std, strict=True)
            if u.group not in ("", "sensor")
        ]
        for one in self.held_out:
            place = one.position_rms()
            mm = "" if place is None else f", {1e3 * place:.3g} mm"
            rows.append(
                (f"held out from {one.stretch.time[0]:.6g} s",
                 f"predicted to {np.degrees(one.turn_rms()):.3g} deg{mm} rms")
            )  # fmt: skip
        return f"Free motion of {self.task.robot.name}: {self.status}", [
            ("residuals", f"{self.spread:.3g} sigma"), *rows,
            *(("remark", words) for words in self.remarks),
        ]  # fmt: skip


KEPT = ("folder", "overwrite", "formats", "say", "session")
"""Arguments on what is written, and who follows."""


@verb()
def identify_free_motion(
    robot: Robot | str | Path,
    log: Measurements | Path | str,
    unknown: str | Sequence[str] | None = None,
    *,
    stretches: Spans = (),
    held_out: Spans = (),
    start: Any = None,
    sigmas: FreeSigmas | Mapping[str, float] | None = None,
    priors: Mapping[str, float] | None = None,
    tracker: bool = False,
    lead: float = 1.0,
    **kept: Any,
) -> RobotFreeMotion:
    """Finds a robot's dynamics in a log of a platform that swings on standing winches.

    Args:
        robot: The robot as it is believed, or its name or path.
        log: The log, or its file: times; poses, or roll, pitch, yaw; tensions, without which the
            mass is not told.
        unknown: Groups of `FREE_GROUPS` and `ASKED_GROUPS` of
            `analyses.calibration.free_motion_model`; None: of the first all that the log can tell.
        stretches: Stretches to fit; none: the first half of the log.
        held_out: Stretches to predict; none: the second half, where no stretches are given.
        start: A pose near which the platform hangs; None: it is searched for.
        sigmas: Standard deviations: `FreeSigmas`, or some of its fields by name.
        priors: Standard deviations of what is known beforehand, as {"mass": 0.1} [kg]; groups of
            `analyses.calibration.free_motion_model.PRIOR_UNITS`. What is left out of `unknown` is
            held.
        tracker: Whether the frame of a tracker is unknown.
        lead: From so much of a held-out stretch its first state is told [s].
        kept: `folder`: where identification.json, robot.yaml and figures are written; None:
            nowhere; `overwrite`: whether results in the folder may be replaced; `formats`: endings
            of the files of figures; `say`: told what is done now; `session`: in the place of it,
            who follows the identification.

    Raises:
        IdentificationError: The log does not hold, or does not tell, what is asked; names it.
        DataFileError: A file cannot be read.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    loaded = as_robot(robot, "identify")
    for name in kept:
        if name not in KEPT:
            raise IdentificationError(f"{name!r} is unknown; {closest(name, KEPT)}")
    if isinstance(log, str | Path):
        log = read_measurements(Path(log), [cable.name for cable in loaded.cables])
    if isinstance(unknown, str):
        unknown = (unknown,)
    if not 0.0 < lead < np.inf:
        raise IdentificationError(f"lead: found {lead:g}; accepted: > 0 [s]")
    task = FreeMotionTask(
        robot=loaded, unknown=None if unknown is None else tuple(unknown),
        stretches=tuple(stretches), held_out=tuple(held_out), sigmas=_sigmas(sigmas),
        start=None if start is None else as_pose(loaded, start), tracker=tracker, lead=lead,
        priors=dict(priors or {}),
    )  # fmt: skip

    def work(folder: Path | None, say: Say) -> RobotFreeMotion:
        found = fit_free_motion(task, log, say)
        fit = free_motion_fit(found)
        if folder is not None:
            fit.write(folder)
        return as_kind(RobotFreeMotion, found, fit=fit)

    keeping = Keeping(
        kept.get("folder"), kept.get("overwrite", False), kept.get("formats", DEFAULT_FORMATS)
    )
    session = kept.get("session") or Session(say=kept.get("say"))
    return kept_fit(keeping, session, f"Identifying {loaded.name}", work)


def _sigmas(given: FreeSigmas | Mapping[str, float] | None) -> FreeSigmas:
    if isinstance(given, FreeSigmas):
        return given
    known = [field.name for field in fields(FreeSigmas)]
    for name, value in (given or {}).items():
        if name not in known:
            raise IdentificationError(f"sigmas: found {name!r}; {accepted_names(name, known)}")
        if not 0.0 < value < np.inf:
            raise IdentificationError(f"sigmas: {name}: found {value:g}; accepted: > 0")
    return replace(FreeSigmas(), **(given or {}))

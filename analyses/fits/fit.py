"""A fit of a model to measurements: one class for geometry, dynamics, swings and cameras."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder, results_folder, shown_path, write_result
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.words import comma_words, named_values
from cdpr_drake.analyses.logs.measurements import Measurements, read_measurements
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CalibrationError, CdprError, IdentificationError
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.time_shift import WORSE
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.typed_yaml import dump_typed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESULTS, ROBOT, CAMERA = "results.json", "robot.yaml", "camera.yaml"
"""Files of a results folder: all numbers, and the robot or camera as it is believed now."""

SHOWN = "shown.json"
"""Last file that is written but figures: what the command shows of the fit, in words."""

MISFIT, MISFIT_CODE = "misfit", 6
"""Status of a fit that does not explain what was measured, and the exit code of its command."""

MISFIT_FACTOR = 3.0
"""Residuals of so many sigmas, root mean square, are no fit."""

LATE = 0.25
"""A clock is off by more than this share of the time between rows."""


Groups = Annotated[str | Sequence[str], comma_words()]
"""Groups of parameters, and names."""

Priors = Annotated[Mapping[str, float] | None, named_values(name="--prior")]
"""Standard deviations known beforehand, by group or name."""


@dataclass(frozen=True)
class Unknown:
    """A parameter that was fitted.

    Attributes:
        name: Its name, such as C3.exit_point.z.
        unit: Its unit.
        std: Standard deviation; not finite if the measurements do not tell it.
        value: Its value; None where `change` is.
        change: Its change.
        before: As it was believed before; None if nothing was.
        true: As it truly is, in a simulation; None if that is unknown.
    """

    name: str
    unit: str
    std: float
    value: float | None = None
    change: float | None = None
    before: float | None = None
    true: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """For JSON, without what is None."""
        return {key: finite(value) for key, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Fit(Result):
    """A model that was fitted to measurements.

    Attributes:
        title: What was fitted, such as "Calibration of acrobot_small".
        model: The fitted `Robot` or `Camera`.
        status: How the search ended, or `MISFIT`.
        unknowns: The fitted parameters.
        spread: Residuals over sigma, root mean square; None if the residuals tell sigma.
        residuals: Numbers by kind of measurement, such as `count` and `rms_sigmas`.
        misfit: Reasons why it is no fit, in words; empty if it is one.
        covariance: Of the unknowns, shape (f, f); None if it is not computed.
        held_out: Measurements that were predicted and not fitted; None if all were fitted.
        remarks: Sentences that a user should know.
        details: Further numbers for JSON, under their keys.
        shown: Its tables.
        words: Lines below them.
        drawings: Functions that draw its figures, by name; the most telling one is first.
        texts: Further files of its results folder, by name.
        writer: Writes further files into a folder; None if there are none.
        model_file: Name of the model's file there.
        result: Solution of the room of mathematics, such as a `CalibrationResult`.
        source: What the fit is made of, for verbs that go on with it.
        folder: Its results folder; None if nothing is kept.
        failed: Of each file that could not be written, its name and why.
    """

    title: str
    model: Any
    status: str
    unknowns: tuple[Unknown, ...]
    spread: float | None
    residuals: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    misfit: tuple[str, ...] = ()
    covariance: Array | None = None
    held_out: Any = None
    remarks: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    shown: tuple[Table, ...] = ()
    words: tuple[str, ...] = ()
    drawings: Mapping[str, Callable[[], Figure]] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    writer: Callable[[Path], None] | None = None
    model_file: str = ROBOT
    result: Any = None
    source: Any = None
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def fits(self) -> bool:
        """True if the model explains the measurements."""
        return self.status != MISFIT

    @property
    def exit_code(self) -> int:
        """Of a command; `MISFIT_CODE` for a misfit."""
        return 0 if self.fits else MISFIT_CODE

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns, as `cdpr_drake.ParameterCovariance` has them."""
        return tuple(unknown.name for unknown in self.unknowns)

    @cached_property
    def correlation(self) -> Array | None:
        """Correlation of the unknowns, shape (f, f); None without a covariance."""
        if self.covariance is None:
            return None
        root = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        scale = np.where(root > 0.0, root, np.inf)
        return np.asarray(self.covariance / np.outer(scale, scale))

    def as_dict(self) -> dict[str, Any]:
        """All numbers for JSON."""
        numbers: dict[str, Any] = {
            "status": self.status,
            "parameters": [unknown.as_dict() for unknown in self.unknowns],
            "remarks": list(self.remarks),
            "versions": package_versions(),
        }
        if self.spread is not None:
            numbers["residuals_over_sigma"] = finite(self.spread)
            numbers["misfit_factor"] = MISFIT_FACTOR
        if self.covariance is not None and self.correlation is not None:
            numbers["covariance"] = finite(self.covariance.tolist())
            numbers["correlation"] = finite(self.correlation.tolist())
        return {**numbers, **self.details}

    def tables(self) -> Sequence[Table]:
        """Its tables."""
        return self.shown

    def lines(self) -> list[str]:
        """Its words, and where the results are."""
        place = [] if self.folder is None else [f"results: {shown_path(self.folder)}"]
        return [*self.words, *place]

    def notes(self) -> list[str]:
        """That only figures are missing."""
        if self.folder is None or not self.failed:
            return []
        return [f"The data is complete in {shown_path(self.folder)}"]

    def figures(self) -> Mapping[str, Callable[[], Figure]]:
        """Functions that draw its figures, by name."""
        return self.drawings

    def write(self, folder: Folder) -> None:
        """Writes numbers, the fitted model and further files, and last what `read_fit` needs."""
        folder.write_json(RESULTS, self.as_dict())
        folder.write_text(self.model_file, dump_typed(self.model))
        for name, words in self.texts.items():
            folder.write_text(name, words)
        if self.writer is not None:
            with folder.files() as stage:
                self.writer(stage)
        folder.write_json(SHOWN, {
            "title": self.title, "model_file": self.model_file, "misfit": self.misfit,
            "figures": list(self.drawings), "words": self.words,
            "tables": [asdict(table) for table in self.shown],
        })  # fmt: skip

    def with_more(
        self, tables: Sequence[Table] = (), *, details: Mapping[str, Any] | None = None,
        drawings: Mapping[str, Callable[[], Figure]] | None = None,
        texts: Mapping[str, str] | None = None,
    ) -> Fit:  # fmt: skip
        """The same fit with further tables, numbers, figures and files."""
        return replace(
            self, shown=(*self.shown, *tables), details={**self.details, **(details or {})},
            drawings={**self.drawings, **(drawings or {})}, texts={**self.texts, **(texts or {})},
        )  # fmt: skip


def kept_fit(
    name: str, arguments: Mapping[str, Any], work: Callable[[], Fit],
    folder: Path | str | None, overwrite: bool, formats: Sequence[str], follow: Follow,
) -> Fit:  # fmt: skip
    """A fit in its results folder, if one is kept.

    A command whose folder holds the complete fit of the same arguments reads it, and draws figures
    that are missing. Python computes it again, since a folder holds no `Fit.result`.

    Args:
        name: Name of a new folder below runs/, if none is given and `follow` keeps results.
        arguments: All that the results depend on: logs, and what `plain` takes.
        work: Computes the fit.
        folder, overwrite, formats, follow: As of each verb.

    Raises:
        OutputFolderError: The folder holds other results or files, or cannot be written.
        StoppedError: It was stopped.
    """
    name, again, compute = f"runs/{name}", folder is not None, cache(work)
    arguments = {"cdpr_drake": code_version(), **{k: _content(v) for k, v in arguments.items()}}
    with results_folder(name, arguments, folder, overwrite, follow.results, again) as results:
        if results is None:
            return compute()
        there = read_fit(results.path, compute)
        fit = compute() if there is None or follow.results is None else there
        fit = replace(fit, folder=results.path)
        if there is not None:
            follow.say(f"reused the fit of {shown_path(results.path)}")
        write_result(fit, results, formats, follow, complete=there is not None)
        return fit


def read_fit(folder: Path, compute: Callable[[], Fit]) -> Fit | None:
    """The fit whose numbers a folder holds, without its result; None if a file is missing.

    Args:
        folder: A results folder.
        compute: Computes the fit, once a figure of it is drawn.
    """
    try:
        numbers, shown = (
            load_json((folder / name).read_text(encoding="utf-8")) for name in (RESULTS, SHOWN)
        )
        load: Callable[[str], Any] = load_camera if shown["model_file"] == CAMERA else load_robot
        model = load(str(folder / shown["model_file"]))
    except (OSError, ValueError, KeyError, CdprError):
        return None

    def drawn(name: str) -> Callable[[], Figure]:
        return lambda: compute().drawings[name]()

    covariance = numbers.get("covariance")
    return Fit(
        title=shown["title"], model=model, model_file=shown["model_file"],
        status=numbers["status"], spread=numbers.get("residuals_over_sigma"),
        unknowns=tuple(
            Unknown(**{**row, "std": math.nan if row["std"] is None else row["std"]})
            for row in numbers["parameters"]
        ),
        residuals=numbers.get("residuals", numbers.get("terms", {})),
        misfit=tuple(shown["misfit"]), remarks=tuple(numbers["remarks"]),
        covariance=None if covariance is None else np.array(covariance, float),
        held_out=numbers.get("held_out", numbers.get("log_not_fitted")), details=numbers,
        shown=tuple(Table(**table) for table in shown["tables"]), words=tuple(shown["words"]),
        drawings={name: drawn(name) for name in shown["figures"]},
    )  # fmt: skip


def _content(value: Any) -> Any:
    """An argument as JSON has it; a log by its path and a hash of what it holds."""
    if not isinstance(value, Measurements):
        return plain(value)
    held = json.dumps(plain(vars(value)), default=str).encode()
    return {"path": str(value.path), "sha256": hashlib.sha256(held).hexdigest()}


def log_of(robot: Robot, log: Any, late: float | None = None) -> Measurements:
    """A robot's log, or what is read of a file, without the delay of its tracker [s]."""
    if isinstance(log, str | Path):
        log = read_measurements(log, [cable.name for cable in robot.cables])
    return log if late is None else log.shifted(late)


def group_names(groups: str | Sequence[str]) -> tuple[str, ...]:
    """Names of groups as a tuple."""
    return (groups,) if isinstance(groups, str) else tuple(groups)


def notes_table(remarks: Sequence[str], notes: Sequence[tuple[str, str]] = ()) -> list[Table]:
    """A table of notes, each with a word for what it is, and of remarks; none without either."""
    rows = [*notes, *(("remark", words) for words in remarks)]
    return [Table("To know", ("what", "which"), rows)] if rows else []


def fitted_robot(
    robot: Robot, done: str, status: str, unknowns: Sequence[Any], **changes: Any
) -> Robot:
    """A robot with changed fields, and what was done with it among what its file assumes."""
    words = f"{done}: {status}, {len(unknowns)} parameters."
    return replace(robot, **changes, assumptions=f"{robot.assumptions} {words}".strip())


def refuse_late_tracker(
    log: Measurements, against: str, found: tuple[float, float], step: float,
    error: type[CalibrationError] | type[IdentificationError],
) -> None:  # fmt: skip
    """Refuses a tracker that is out of sync.

    Args:
        log: The log with its poses.
        against: What they were compared with.
        found: By how much they are late [s], and how many times better they fit with that shift.
        step: Time between rows [s].
        error: What is raised.

    Raises:
        CalibrationError: It is, or an IdentificationError; says by how much.
    """
    shift, better = found
    if better > WORSE and abs(shift) > LATE * step:
        late = "late" if shift > 0.0 else "early"
        raise error(
            f"{log.path}: tracker: found it {abs(shift):.4g} s {late} against the {against}, "
            f"which fit {better:.2g} times better with that shift; accepted: the same clock, or "
            f"tracker_late {shift:.4g}"
        )

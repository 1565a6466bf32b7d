"""Robots drawn from what is known of one: its parameters, and how sure they are."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError
from cdpr_drake.models.robot_parameters import (
    belongs_to_a_log,
    changed_robot,
    check_parameters,
    impossible_parameter,
)
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.json_text import load_json

FILE = "results.json"
"""File with a covariance in folders of `cdpr calibrate` and `cdpr identify`."""

ROUNDED = 1e-8
"""How far below zero eigenvalues of a correlation matrix may lie, by rounding in its file."""

MOST_DRAWS = 1000
"""Draws for one robot, of which none is possible, after which there is no use in more."""


class Fitted(Protocol):
    """What `cdpr_drake.calibration` and `identification` find: names and their covariance."""

    @property
    def names(self) -> Sequence[str]:
        """Names of the parameters."""

    @property
    def covariance(self) -> Array:
        """Covariance of the parameters, shape (f, f), in SI units."""


@dataclass(frozen=True)
class ParameterCovariance:
    """How sure parameters of a robot are.

    Attributes:
        names: Of the parameters, f of them, as `robot_parameters` says.
        covariance: Shape (f, f), in SI units.
    """

    names: tuple[str, ...]
    covariance: Array

    def __post_init__(self) -> None:
        """Checks it.

        Raises:
            DataFileError: It is not the covariance of these parameters.
        """
        f, C = len(self.names), np.asarray(self.covariance)
        if C.shape != (f, f):
            raise DataFileError(f"covariance: found shape {C.shape}; accepted: ({f}, {f})")
        if len(set(self.names)) < f:
            raise DataFileError("names: found one twice; accepted: each once")
        if not np.isfinite(C).all():
            k = int(np.argmax(~np.isfinite(C).all(axis=1)))
            raise DataFileError(
                f"covariance: found an entry of {self.names[k]} that is not finite; accepted: "
                "finite ones"
            )
        if not np.allclose(C, C.T, rtol=1e-9, atol=0.0) or np.any(np.diag(C) < 0.0):
            raise DataFileError(
                "covariance: found one that is not symmetric, or a variance below zero; accepted: "
                "a covariance"
            )

    @staticmethod
    def independent(deviations: dict[str, float]) -> ParameterCovariance:
        """Of parameters that know nothing of each other, by their standard deviations [SI]."""
        return ParameterCovariance(
            tuple(deviations), np.diag(np.square(np.array(list(deviations.values()), float)))
        )

    @staticmethod
    def of(found: Fitted | ParameterCovariance | Path | str) -> ParameterCovariance:
        """From a result, or from the folder or the file that `calibrate` or `identify` wrote.

        Raises:
            DataFileError: There is no such file, or no covariance in it.
        """
        if isinstance(found, ParameterCovariance):
            return found
        if isinstance(found, Path | str):
            return _read(Path(found))
        return ParameterCovariance(tuple(found.names), np.asarray(found.covariance, float))

    def of_the_robot(self) -> ParameterCovariance:
        """The same without parameters of a log, whatever these are."""
        kept = [k for k, name in enumerate(self.names) if not belongs_to_a_log(name)]
        C = np.asarray(self.covariance)[np.ix_(kept, kept)]
        return ParameterCovariance(tuple(self.names[k] for k in kept), C)

    def factor(self) -> Array:
        """F with F F' the covariance, shape (f, f).

        Raises:
            DataFileError: Some combination of the parameters has a variance below zero.
        """
        C = np.asarray(self.covariance)
        std = np.sqrt(np.diag(C))
        scale = np.where(std > 0.0, std, 1.0)  # metres, newtons and kilograms become comparable
        values, V = np.linalg.eigh(0.5 * (C + C.T) / np.outer(scale, scale))
        if values.size and values[0] < -ROUNDED * max(values[-1], 1.0):
            raise DataFileError(
                f"covariance: found a combination with variance {values[0]:.3g} of its "
                "correlations; accepted: none below zero"
            )
        return np.asarray(scale[:, None] * V * np.sqrt(np.maximum(values, 0.0)))


def drawn_robots(
    robot: Robot,
    count: int,
    covariance: Fitted | ParameterCovariance | Path | str,
    seed: int = 0,
) -> list[Robot]:
    """Robots whose parameters are drawn about those of one, from a normal distribution.

    Robot k is the same whatever the count. A draw that no robot can be, as one without mass, is
    drawn again: where parameters are hardly known, the distribution is a truncated one.

    Args:
        robot: The robot in the middle, as `robot.yaml` of a fit.
        count: How many.
        covariance: What `ParameterCovariance.of` takes.
        seed: Of the random numbers.

    Raises:
        DataFileError: There is no covariance, or hardly any draw is a possible robot.
        RobotFileError: It names what the robot does not have.
    """
    doubt = ParameterCovariance.of(covariance)
    check_parameters(robot, doubt.names)
    doubt = doubt.of_the_robot()
    F = doubt.factor()
    return [_drawn(robot, doubt.names, F, np.random.default_rng([seed, k])) for k in range(count)]


def _drawn(robot: Robot, names: tuple[str, ...], F: Array, random: np.random.Generator) -> Robot:
    wrong = ""
    for _ in range(MOST_DRAWS):
        change = F @ random.standard_normal(len(names))
        one = changed_robot(robot, dict(zip(names, change.tolist(), strict=True)))
        wrong = impossible_parameter(one)
        if not wrong:
            return one
    raise DataFileError(
        f"covariance: found none possible of {MOST_DRAWS} robots that were drawn, for "
        f"{wrong}; accepted: parameters that are better known"
    )


def _read(path: Path) -> ParameterCovariance:
    file = path / FILE if path.is_dir() else path
    if not file.is_file():
        raise DataFileError(
            f"{path}: found no such file; accepted: {FILE} of cdpr calibrate or cdpr identify, or "
            "its folder"
        )
    try:
        content: Any = load_json(file.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError) as problem:
        raise DataFileError(f"{file}: found no JSON: {problem}") from None
    try:
        names = tuple(str(row["name"]) for row in content["parameters"])
        table = np.array(content["covariance"], float)
    except (KeyError, TypeError, ValueError):
        raise DataFileError(
            f"{file}: found no parameters with a covariance; accepted: {FILE} of cdpr calibrate or "
            "cdpr identify"
        ) from None
    try:
        return ParameterCovariance(names, table)
    except DataFileError as problem:
        raise DataFileError(f"{file}: {problem}") from None

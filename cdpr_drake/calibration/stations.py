"""The poses at which something was measured, and what all residuals need of a model there."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.parameters import (
    CalibrationModel,
    ParameterLayout,
    moved_model,
    parameter_layout,
)
from cdpr_drake.calibration.station_kernel import cable_terms, rotation_vectors

POSE = 6
"""Coordinates of a pose: turn about the axes of W [rad], then translation [m]."""


@dataclass(frozen=True, eq=False)
class Stations:
    """What is unknown of each pose itself.

    Attributes:
        R: Rotations of the platform in W, shape (k, 3, 3).
        p: Positions of Po in W, shape (k, 3) [m].
        tensions: Tensions there, shape (k, m) [N]; None where nothing depends on them.
    """

    R: Array
    p: Array
    tensions: Array | None = None

    @staticmethod
    def at(poses: Sequence[RigidTransform], tensions: Array | None = None) -> Stations:
        """Stations at these poses X_WP."""
        R = np.array([X.rotation().matrix() for X in poses]).reshape(-1, 3, 3)
        p = np.array([X.translation() for X in poses]).reshape(-1, 3)
        return Stations(R, p, tensions)

    @property
    def count(self) -> int:
        """Number of poses k."""
        return len(self.p)

    @property
    def width(self) -> int:
        """Unknowns of a pose: its six coordinates, then its tensions."""
        return POSE + (0 if self.tensions is None else self.tensions.shape[1])

    def poses(self) -> list[RigidTransform]:
        """The poses X_WP [m]."""
        return [
            RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), p)
            for R, p in zip(self.R, self.p, strict=True)
        ]

    def moved(self, steps: Array) -> Stations:
        """Stations after a step of each, shape (k, width)."""
        tensions = None if self.tensions is None else self.tensions + steps[:, POSE:]
        return Stations(
            turns_of_vectors(steps[:, :3]) @ self.R, self.p + steps[:, 3:POSE], tensions
        )

    def put(self, which: npt.NDArray[np.intp], other: Stations) -> Stations:
        """With other stations in the place of some."""
        R, p, tensions = self.R.copy(), self.p.copy(), self.tensions
        R[which], p[which] = other.R, other.p
        if tensions is not None and other.tensions is not None:
            tensions = tensions.copy()
            tensions[which] = other.tensions
        return Stations(R, p, tensions)

    def only(self, which: npt.NDArray[np.generic] | slice) -> Stations:
        """Some of the stations."""
        tensions = None if self.tensions is None else self.tensions[which]
        return replace(self, R=self.R[which], p=self.p[which], tensions=tensions)


class Point:
    """A model and its stations, with the cables' lengths, directions and derivatives there.

    Attributes:
        model: The model.
        layout: Its parameters.
        stations: The poses.
        numbers, vectors, hessians: What `cable_terms` writes.
    """

    def __init__(
        self, model: CalibrationModel, stations: Stations, layout: ParameterLayout | None = None
    ) -> None:
        """With the layout, if it is known."""
        self.model, self.stations = model, stations
        self.layout = parameter_layout(model) if layout is None else layout
        k, m = stations.count, model.cables.count
        self.numbers, self.vectors = np.empty((k, m, 3)), np.empty((k, m, 12))
        self.hessians = np.empty((k, m, 3, 3))
        cable_terms(
            np.ascontiguousarray(stations.R), np.ascontiguousarray(stations.p),
            model.cables.packed(), self.numbers, self.vectors, self.hessians,
        )  # fmt: skip

    def vector(self, begin: int) -> Array:
        """One of the vectors of each cable at each pose, shape (k, m, 3)."""
        return self.vectors[:, :, begin : begin + 3]

    def blank(self, rows: int) -> Array:
        """Zero derivatives by stations, shape (k, rows, width)."""
        return np.zeros((self.stations.count, rows, self.stations.width))

    def only(self, which: npt.NDArray[np.generic] | slice) -> Point:
        """The model and some of the poses."""
        some = copy(self)
        some.stations = self.stations.only(which)
        for name in ("numbers", "vectors", "hessians"):
            setattr(some, name, getattr(self, name)[which])
        return some

    def moved(self, step: Array, steps: Array) -> Point:
        """After a step of all parameters, shape (n,), and of all stations, shape (k, width)."""
        return Point(
            moved_model(self.model, step, self.layout), self.stations.moved(steps), self.layout
        )


def crosses(v: Array) -> Array:
    """[v]x of many vectors, shape (..., 3) to (..., 3, 3)."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def turns_of_vectors(turns: Array) -> Array:
    """Rotations by many rotation vectors, shape (k, 3) [rad] to (k, 3, 3). Source: Rodrigues."""
    angle = np.linalg.norm(turns, axis=1)
    half = np.sinc(0.5 * angle / np.pi)
    K = crosses(turns)
    by_one, by_two = np.sinc(angle / np.pi), 0.5 * half**2
    return np.asarray(np.eye(3) + by_one[:, None, None] * K + by_two[:, None, None] * (K @ K))


def turn_vectors(R: Array) -> Array:
    """Rotation vectors of many rotations, shape (k, 3, 3) to (k, 3) [rad]."""
    vectors = np.empty((len(R), 3))
    rotation_vectors(np.ascontiguousarray(R), vectors)
    return vectors


def inverse_turn_slope(turns: Array) -> Array:
    """How the rotation vector of exp(w) R grows with w, from that of R; (k, 3) to (k, 3, 3).

    The inverse of the left Jacobian of SO(3). Source: Sola, A micro Lie theory, 2018, (146).
    """
    K, angle = crosses(turns), np.linalg.norm(turns, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        c = 1.0 / angle**2 - (1.0 + np.cos(angle)) / (2.0 * angle * np.sin(angle))
    c = np.where(angle < 1e-4, 1.0 / 12.0, c)
    return np.asarray(np.eye(3) - 0.5 * K + c[..., None, None] * (K @ K))


def turn_slope(turns: Array) -> Array:
    """The left Jacobian of SO(3), inverse of `inverse_turn_slope`; (k, 3) to (k, 3, 3)."""
    return np.asarray(np.linalg.inv(inverse_turn_slope(turns)), float)

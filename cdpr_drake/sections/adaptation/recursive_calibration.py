"""Calibration while a robot works: an information filter over the poses that it comes through.

What is learnt are exit points, anchor points and where winches began to count. What an image of a
tag that rests and the lengths at the same instant tell is a station, with residuals and derivatives
of the room `calibration`; its pose is eliminated. The stations of a window are linearised
anew with each that comes, and the oldest goes, as it is linearised then, into an information
matrix that stays: beyond the window this is the extended information filter, which is then too
sure of itself, as what is linearised at an early estimate tells of directions that nothing excites.

Where the platform was when it was first seen, points, offsets and the camera's place are known
beforehand by standard deviations. The tag's pose is not. So no gauge is free, but what only the
prior tells is not learnt: in sizes of the prior, a direction counts as excited where measurements
tell at least as much as the prior. Along others the estimate stays where it was, with the prior's
deviation.

Source: Triggs et al., Bundle adjustment, a modern synthesis, 2000, 6.1 (elimination); Sibley,
Matthies, Sukhatme, Sliding window filter with application to planetary landing, 2010 (what leaves
the window); Baarda, A testing procedure for use in geodetic networks, 1968 (tests of single
measurements).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform
from scipy.linalg import null_space
from scipy.special import chdtri, ndtri

from cdpr_drake.arrays import Array
from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.calibration.elimination import LeastSquares, Prior
from cdpr_drake.calibration.identifiability import frame_motions
from cdpr_drake.calibration.parameters import (
    CalibrationModel,
    model_difference,
    moved_model,
    parameter_layout,
)
from cdpr_drake.calibration.sensor_terms import TagCorners, TrackedPoses
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.calibration.terms import Lengths
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import place_error, pose_error, pose_from_row, pose_row
from cdpr_drake.numerics.packed_record import PackedRecord
from cdpr_drake.vision.pinhole import Pinhole

TAG = 0
"""Number of the tag in the model of what is learnt."""

CORNER_ROWS = 8

EXCITED = 0.5
"""Share of its prior variance that a direction may have left to count as excited."""

ROW_GATE = 1e-4
"""Probability that a good measurement fails the test of it alone."""

STATION_GATE = 1e-5
"""Probability that the measurements of a good pose fail the test of all of them."""

DOUBT = 1e-3
"""Probability with which a doubt is told although nothing is wrong."""

FORGET = 0.9
"""Share that the scatter keeps of what it was at each station."""

MOST_STEPS = 4
SETTLED = 1e-3
"""A step of Gauss-Newton ends it where no parameter moves by more of its standard deviation."""

UNIT_CAMERA = Pinhole(1, 1, 1.0, 1.0, 0.0, 0.0)
"""Images at unit focal length."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Beforehand:
    """Standard deviations of what is known before the first measurement.

    Attributes:
        exit_points, anchor_points: Of a coordinate [m].
        offsets: Of the length of a cable where counting began [m].
        camera_place, camera_turn: Of the camera on the platform [m, rad]; 0: it is exact.
        pose_place, pose_turn: Of the platform's pose where it is first seen [m, rad].
        tag_place, tag_turn: Of the tag as the first image and that pose show it [m, rad]; so large
            that they tell nothing.
    """

    exit_points: float = 0.01
    anchor_points: float = 0.01
    offsets: float = 0.2
    camera_place: float = 0.0
    camera_turn: float = 0.0
    pose_place: float = 0.001
    pose_turn: float = 0.002
    tag_place: float = 0.5
    tag_turn: float = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class LearningRules:
    """How measurements become stations.

    Attributes:
        length_sigma: Standard deviation of a counted length [m].
        corner_sigma: Of a coordinate of a corner at unit focal length [-].
        spacing, turn: How far the platform moves or turns from one station to the next [m, rad].
        window: Stations that are linearised anew.
        slack_below: Cables that pull less tell no length [N].
    """

    length_sigma: float = 2e-4
    corner_sigma: float = 2e-4
    spacing: float = 0.005
    turn: float = 0.03
    window: int = 100
    slack_below: float = 0.2


@dataclass(frozen=True, eq=False)
class Look:
    """What is measured at an instant.

    Attributes:
        X_CO: Pose of the tag in the camera [m].
        xy: Its corners at unit focal length, shape (4, 2) [-].
        lengths: Unstrained lengths that winches count, shape (m,) [m].
        tensions: Measured tensions, shape (m,) [N].
    """

    X_CO: RigidTransform
    xy: Array
    lengths: Array
    tensions: Array


@dataclass(frozen=True, eq=False)
class Learnt:
    """What is known now.

    Attributes:
        p_WA: Exit points, shape (3, m) [m].
        p_PB: Anchor points, shape (3, m) [m].
        offsets: Length of each cable where counting began beyond that of the model that was
            believed then, shape (m,) [m].
        mean: All of it as differences from that model: exit points cable by cable, anchor points,
            offsets; shape (7 m,) [m].
        covariance: Of that, shape (7 m, 7 m) [m^2].
        excited: Directions that were excited, of 7 m.
        scatter: Squares of innovations over what they should be [-]; more than 1 is in
            `covariance`.
    """

    p_WA: Array
    p_PB: Array
    offsets: Array
    mean: Array
    covariance: Array
    excited: int
    scatter: float

    @property
    def sigma(self) -> Array:
        """Standard deviations, shape (7 m,) [m]."""
        return np.sqrt(np.diag(self.covariance))


class RecursiveCalibration:
    """Learns a robot's points while it moves.

    All that it remembers is a vector, `start()` and what `take` makes of it, so that it can be the
    discrete state of a block.

    Attributes:
        count: Number of cables m.
        memory_size: Numbers in the vector.
    """

    def __init__(
        self,
        cables: CableSet,
        X_PC: RigidTransform,
        X_WP0: RigidTransform,
        corners: Array,
        beforehand: Beforehand,
        rules: LearningRules,
    ) -> None:
        """With the robot as it is believed at the start.

        Args:
            cables: Its cables.
            X_PC: Camera on the platform [m].
            X_WP0: Pose of the platform where it is first seen [m].
            corners: Corners of the tag in its frame, shape (3, 4) [m].
            beforehand: How well all of this is known.
            rules: How measurements become stations.

        Raises:
            CalibrationError: A cable has a pulley at the platform.
        """
        m = self.count = cables.count
        self.rules, self._X_WP0, self._corners = rules, X_WP0, np.asarray(corners, float)
        names = tuple(f"cable {i + 1}" for i in range(m))
        self._base = CalibrationModel(names, cables, X_PC, {TAG: RigidTransform()})
        self._layout = layout = parameter_layout(self._base)
        std = np.zeros(layout.size)
        turns, places = [True] * 3 + [False] * 3, beforehand
        for group, values in (
            ("exit_points", places.exit_points), ("anchor_points", places.anchor_points),
            ("length_offsets", places.offsets),
            ("camera", np.where(turns, places.camera_turn, places.camera_place)),
            ("tags", np.where(turns, places.tag_turn, places.tag_place)),
        ):  # fmt: skip
            std[layout.slices[group]] = values
        self._free: npt.NDArray[np.bool_] = std > 0.0
        learnt = np.zeros(layout.size, bool)
        for group in ("exit_points", "anchor_points", "length_offsets"):
            learnt[layout.slices[group]] = True
        self._std = np.where(std > 0.0, std, np.inf)
        self._mine = learnt[self._free]
        self._pose_sigma = (beforehand.pose_turn, beforehand.pose_place)
        f, w = int(np.sum(self._free)), rules.window
        self._record = PackedRecord({
            "begun": (), "tag": (7,), "start": (m,), "theta": (layout.size,), "count": (),
            "poses": (w, 7), "readings": (w, m), "strains": (w, m), "bends": (w, m),
            "corners": (w, CORNER_ROWS), "first": (w,), "gone_S": (f, f), "gone_h": (f,),
            "mean": (7 * m,), "covariance": (7 * m, 7 * m), "excited": (), "squares": (),
            "freedoms": (), "looks": (), "stations": (), "refused": (),
            "dropped": (m + CORNER_ROWS,),
            "surprise": (), "frames": (12,), "hessians": (m, 3, 3),
        })  # fmt: skip
        self.memory_size = self._record.size
        self._prior_std = self._std[learnt]

    def start(self) -> Array:
        """What it remembers before the first look, shape (memory_size,)."""
        memory = np.zeros(self.memory_size)
        self._record.views(memory)["covariance"][:] = np.diag(self._prior_std**2)
        return memory

    def take(self, memory: Array, look: Look) -> tuple[Array, bool]:
        """What it remembers after a look, and whether that became a station.

        Args:
            memory: As `start` or the look before left it; it is not changed.
            look: What is measured.
        """
        memory = np.array(memory)
        now = self._record.views(memory)
        strain = np.maximum(look.tensions, 0.0) / self._base.cables.stiffness
        if now["begun"] == 0.0:
            self._begin(now, look)
        now["looks"] += 1.0
        model = self._model(now)
        X_WP = model.tags[TAG] @ (model.X_PC @ look.X_CO).inverse()
        count = int(now["count"])
        if count and not self._is_apart(pose_from_row(now["poses"][count - 1]), X_WP):
            return memory, False
        readings = look.lengths - now["start"]
        taut = look.tensions >= self.rules.slack_below
        station: dict[str, Any] = {
            "poses": pose_row(X_WP), "readings": np.where(taut, readings, np.nan),
            "strains": strain, "bends": np.zeros(self.count), "corners": look.xy.ravel(),
            "first": float(now["stations"] == 0.0),
        }  # fmt: skip
        if not self._tested(now, model, station):
            now["refused"] += 1.0
            return memory, False
        if count == self.rules.window:
            self._absorb_oldest(now)
            count -= 1
        for name, value in station.items():
            now[name][count] = value
        now["count"][()] = count + 1
        now["stations"] += 1.0
        self._solve(now)
        return memory, True

    def learnt(self, memory: Array) -> Learnt:
        """What a memory knows."""
        now, m = self._record.views(memory), self.count
        mean = np.array(now["mean"])
        points = mean[: 6 * m].reshape(2, m, 3)
        return Learnt(
            self._base.cables.p_WA + points[0].T, self._base.cables.p_PB + points[1].T,
            mean[6 * m :], mean, np.array(now["covariance"]), int(now["excited"]),
            self._scatter(now),
        )  # fmt: skip

    def pose(self, memory: Array, X_CO: RigidTransform) -> RigidTransform:
        """Pose of the platform that an image shows by what is known, X_WP [m]."""
        model = self._model(self._record.views(memory))
        return model.tags[TAG] @ (model.X_PC @ X_CO).inverse()

    def tag(self, memory: Array) -> RigidTransform:
        """Pose of the tag in W [m]."""
        return self._model(self._record.views(memory)).tags[TAG]

    def camera(self, memory: Array) -> RigidTransform:
        """Pose of the camera on the platform [m]."""
        return self._model(self._record.views(memory)).X_PC

    def counts(self, memory: Array) -> Array:
        """Stations, poses that were refused, and measurements that were dropped, of each length and
        each coordinate of a corner; shape (2 + m + 8,)."""
        now = self._record.views(memory)
        return np.array([now["stations"], now["refused"], *now["dropped"]])

    def surprise(self, memory: Array) -> float:
        """Squared distance of what was learnt from the prior, over the bound that it passes with
        probability `DOUBT`; above 1 the points are farther off than they were said to be."""
        return float(self._record.views(memory)["surprise"])

    def open_frames(self, memory: Array) -> Array:
        """Share of each motion of `FRAMES`, in sizes of the prior, that was not excited, (12,)."""
        return np.array(self._record.views(memory)["frames"])

    def _begin(self, now: dict[str, Array], look: Look) -> None:
        """Says where the tag is, and that lengths count from here."""
        now["begun"][()] = 1.0
        now["tag"][:] = pose_row(self._X_WP0 @ self._base.X_PC @ look.X_CO)
        lengths = cable_paths(self._X_WP0, self._base.cables).lengths
        tensions = np.maximum(look.tensions, 0.0)
        unstrained = unstrained_lengths(lengths, tensions, self._base.cables.stiffness)
        # Readings are told from here on as lengths of the believed model at this pose.
        now["start"][:] = look.lengths - unstrained

    def _base_model(self, now: dict[str, Array]) -> CalibrationModel:
        return replace(self._base, tags={TAG: pose_from_row(now["tag"])})

    def _model(self, now: dict[str, Array]) -> CalibrationModel:
        return moved_model(self._base_model(now), now["theta"], self._layout)

    def _is_apart(self, X: RigidTransform, other: RigidTransform) -> bool:
        _, angle = pose_error(X, other)
        return place_error(X, other) >= self.rules.spacing or angle >= self.rules.turn

    def _problem(self, now: dict[str, Array], some: dict[str, Array]) -> LeastSquares:
        """Least squares over stations; arrays of `some` have a row for each."""
        rules, k = self.rules, len(some["first"])
        first = some["first"] > 0.0
        R, p = np.full((k, 3, 3), np.nan), np.full((k, 3), np.nan)
        R[first], p[first] = self._X_WP0.rotation().matrix(), self._X_WP0.translation()
        terms = (
            Lengths(
                some["readings"], np.hypot(rules.length_sigma, some["bends"]),
                np.zeros(self.count), some["strains"],
            ),
            TagCorners(
                (TAG,), self._corners[np.newaxis], some["corners"].reshape(k, 1, 4, 2),
                rules.corner_sigma, UNIT_CAMERA,
            ),
            TrackedPoses(R, p, *self._pose_sigma),
        )  # fmt: skip
        return LeastSquares(terms, self._free, Prior(self._base_model(now), self._std))

    def _window(self, now: dict[str, Array], part: slice) -> dict[str, Array]:
        names = ("poses", "readings", "strains", "bends", "corners", "first")
        return {name: np.array(now[name][part]) for name in names}

    def _bends(self, now: dict[str, Array], at: Point, hessians: Array) -> Array:
        """What lengths miss by being linearised, shape (k, m) [m]: root mean square of their second
        order in what is not known of the points.

        With d the error of an anchor point as its exit point sees it, D its covariance and H the
        Hessian of the length, d' H d / 2 has the mean tr(H D) / 2 and the variance tr(H D H D) / 2.

        Args:
            now: What is remembered.
            at: The model and poses.
            hessians: H there, or by how much they differ from their mean, shape (k, m, 3, 3) [1/m].
        """
        m = self.count
        blocks = now["covariance"][: 6 * m, : 6 * m].reshape(2, m, 3, 2, m, 3)
        i = np.arange(m)
        C = blocks[:, i, :, :, i]  # (m, 2, 3, 2, 3), as an index array comes first
        R = at.stations.R[:, np.newaxis]
        cross = C[:, 0, :, 1] @ np.swapaxes(R, 2, 3)
        D = C[:, 0, :, 0] + R @ C[:, 1, :, 1] @ np.swapaxes(R, 2, 3)
        D = D - cross - np.swapaxes(cross, 2, 3)
        HD = hessians @ D
        mean = 0.5 * np.trace(HD, axis1=2, axis2=3)
        return np.asarray(np.sqrt(mean**2 + 0.5 * np.trace(HD @ HD, axis1=2, axis2=3)))

    def _tested(
        self, now: dict[str, Array], model: CalibrationModel, station: dict[str, Any]
    ) -> bool:
        """Whether a station is believed; measurements of it that contradict it are dropped.

        The innovation is what of the residuals no step of the pose explains. Its covariance is
        that of the measurements and of the parameters. Each measurement is tested against all
        others; the worst is dropped and the rest tested again, up to as many as leave the rest
        something to be tested by.
        """
        some = {name: np.array([value]) for name, value in station.items()}
        at = Point(model, Stations.at([pose_from_row(station["poses"])]), self._layout)
        known = now["hessians"] if now["stations"] > 0.0 else at.hessians[0]
        station["bends"] = self._bends(now, at, at.hessians - known)[0]
        some["bends"] = station["bends"][np.newaxis]
        r, A, B = (part[0] for part in self._problem(now, some).evaluate(at))
        S = self._information(now, model)
        rows = np.flatnonzero(np.any(B != 0.0, axis=1))
        most = min(4, self.count // 2)
        for _ in range(most + 1):
            N = null_space(B[rows].T)
            if N.shape[1] < 1:
                return False
            a = A[rows].T @ N
            spread = np.eye(N.shape[1]) + a.T @ np.linalg.solve(S, a)
            weight = N @ np.linalg.solve(spread, N.T)
            pulled = weight @ r[rows]
            squares, freedoms = float(r[rows] @ pulled), N.shape[1]
            if squares <= chdtri(freedoms, STATION_GATE):
                self._note(now, squares, freedoms)
                return True
            alone = np.abs(pulled) / np.sqrt(np.maximum(np.diag(weight), 1e-12))
            worst = int(np.argmax(alone))
            row = int(rows[worst])
            if alone[worst] <= -ndtri(0.5 * ROW_GATE) or row >= self.count + CORNER_ROWS:
                break
            rows = np.setdiff1d(rows, self._drop(now, station, row))
        self._note(now, squares, freedoms)
        return False

    def _drop(self, now: dict[str, Array], station: dict[str, Any], row: int) -> list[int]:
        """Takes a measurement out of a station, a whole corner with either coordinate; its rows."""
        now["dropped"][row] += 1.0
        if row < self.count:
            station["readings"][row] = np.nan
            return [row]
        first = (row - self.count) // 2 * 2
        station["corners"] = np.array(station["corners"])
        station["corners"][first : first + 2] = np.nan
        return [self.count + first, self.count + first + 1]

    def _note(self, now: dict[str, Array], squares: float, freedoms: int) -> None:
        """Adds the innovation of a station to the scatter; a wild one as far as the gate."""
        now["squares"] *= FORGET
        now["freedoms"] *= FORGET
        now["squares"] += min(squares, float(chdtri(freedoms, STATION_GATE)))
        now["freedoms"] += freedoms

    def _scatter(self, now: dict[str, Array]) -> float:
        return float(now["squares"] / now["freedoms"]) if now["freedoms"] > 0.0 else 1.0

    def _information(self, now: dict[str, Array], model: CalibrationModel) -> Array:
        """On the free parameters in typical sizes, of prior, window and what is gone, (f, f)."""
        count = int(now["count"])
        weight = self._layout.typical[self._free] / self._std[self._free]
        S = np.diag(weight**2) + now["gone_S"]
        if count:
            some = self._window(now, slice(count))
            at = self._point(model, some)
            S = S + self._problem(now, some).normal_equations(at, 0.0).S_data
        return S

    def _point(self, model: CalibrationModel, some: dict[str, Array]) -> Point:
        return Point(
            model, Stations.at([pose_from_row(row) for row in some["poses"]]), self._layout
        )

    def _absorb_oldest(self, now: dict[str, Array]) -> None:
        """The oldest station leaves the window: what it tells stays, linearised here."""
        some = self._window(now, slice(1))
        at = self._point(self._model(now), some)
        problem = replace(
            self._problem(now, some), prior=Prior(at.model, np.full(self._layout.size, np.inf))
        )
        equations = problem.normal_equations(at, 0.0)
        x = now["theta"][self._free] / self._layout.typical[self._free]
        now["gone_S"] += equations.S
        now["gone_h"] += equations.rhs + equations.S @ x
        for name in some:
            now[name][:-1] = now[name][1:].copy()

    def _solve(self, now: dict[str, Array]) -> None:
        """The most likely parameters and poses, and what of them was excited."""
        count = int(now["count"])
        some = self._window(now, slice(count))
        at = self._point(self._model(now), some)
        now["hessians"] += (at.hessians[-1] - now["hessians"]) / now["stations"]
        # What bends alike at all stations is taken for an offset; what differs is noise.
        differs = self._bends(now, at, at.hessians - now["hessians"])
        some["bends"] = now["bends"][:count] = differs
        alike = self._bends(now, at, np.broadcast_to(now["hessians"], at.hessians.shape))[-1]
        base, problem = self._base_model(now), self._problem(now, some)
        typical = self._layout.typical
        for _ in range(MOST_STEPS):
            equations = problem.normal_equations(at, 0.0)
            x = model_difference(at.model, base)[self._free] / typical[self._free]
            S = equations.S + now["gone_S"]
            told = np.linalg.solve(S, equations.rhs + now["gone_h"] - now["gone_S"] @ x)
            theta = np.zeros(self._layout.size)
            theta[self._free] = told * typical[self._free]
            moved = -(equations.alone + equations.back @ told) * problem.station_scale(at)
            at = at.moved(theta, moved)
            if np.max(np.abs(told) * np.sqrt(np.diag(S))) < SETTLED:
                break
        now["theta"][:] = model_difference(at.model, base)
        now["poses"][:count] = [pose_row(X) for X in at.stations.poses()]
        C = np.linalg.inv(S)[np.ix_(self._mine, self._mine)]
        size = (typical[self._free])[self._mine]
        covariance = size[:, None] * C * size
        offsets = np.arange(6 * self.count, 7 * self.count)
        covariance[offsets, offsets] += alike**2 + self.rules.length_sigma**2
        frames = frame_motions(at)[self._free][self._mine] * size[:, None]
        self._tell(now, covariance, now["theta"][self._free][self._mine], frames)

    def _tell(self, now: dict[str, Array], covariance: Array, mean: Array, frames: Array) -> None:
        """Keeps what was excited, and the prior of the rest.

        Args:
            now: Written.
            covariance: Of points and offsets by all that is known, shape (7 m, 7 m) [m^2].
            mean: Their most likely differences from what was believed at the start, (7 m,) [m].
            frames: How they change as frames move, shape (7 m, 12).
        """
        std = self._prior_std
        left, V = np.linalg.eigh(covariance / np.outer(std, std))
        excited = left <= EXCITED
        z = (V.T @ (mean / std)) * excited
        squares = float(np.sum(z[excited] ** 2 / (1.0 - left[excited])))
        scatter = max(self._scatter(now), 1.0)
        left = np.where(excited, np.minimum(left * scatter, 1.0), 1.0)
        now["mean"][:] = std * (V @ z)
        now["covariance"][:] = (std[:, None] * V * left) @ (V.T * std)
        now["excited"][()] = np.sum(excited)
        moved = V.T @ (frames / std[:, None])
        now["frames"][:] = np.linalg.norm(moved[~excited], axis=0) / np.linalg.norm(moved, axis=0)
        bound = chdtri(max(int(np.sum(excited)), 1), DOUBT)
        now["surprise"][()] = squares / bound

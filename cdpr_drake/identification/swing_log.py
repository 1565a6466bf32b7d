"""Stretches of a log in which a platform moves freely on standing winches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, IdentificationError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.identification.samples import one_side
from cdpr_drake.identification.swing_model import SwingingRobot

RATE = 50.0
"""Instants at which motions are compared, of logs that are as fast [1/s]."""

STANDS = 1e-3
"""Lengths may change by so much while winches count, and the winches stand still [m]."""

SHORTEST = 0.5
"""A stretch [s]; shorter ones have not half of a swing."""

MISSED = 4.0
"""An instant farther than so many usual steps from all readings has no reading."""

HEIGHTS = 200
"""At which the weight is compared with what tensions carry."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SwingLog:
    """What was measured of a swing.

    Attributes:
        name: Name for messages.
        time: Of rows of tensions and lengths, shape (k,) [s].
        turn_time: Of turns and positions, shape (j,) [s].
        quaternions: wxyz, each near the one before, shape (j, 4).
        positions: Of P, shape (j, 3) [m]; None: a sensor of turns alone.
        tensions: Shape (k, m) [N], NaN where not measured; None.
        lengths: Unstrained, as winches count, shape (k, m) [m], NaN where not measured; None.
    """

    name: str
    time: Array
    turn_time: Array
    quaternions: Array
    positions: Array | None
    tensions: Array | None
    lengths: Array | None

    @staticmethod
    def of(
        name: str, time: Array, poses: Array, tensions: Array | None, lengths: Array | None
    ) -> SwingLog:
        """From rows of a log.

        Args:
            name, time, tensions, lengths: The attributes.
            poses: Quaternions wxyz, of a tracker with positions after them, shape (k, 4) or
                (k, 7), NaN where not measured.

        Raises:
            IdentificationError: Fewer than two rows have turns.
        """
        rows = np.flatnonzero(np.isfinite(poses).all(axis=1))
        if len(rows) < 2:
            raise IdentificationError(f"{name}: turns: found {len(rows)} rows; accepted: 2 or more")
        x = one_side(poses)[rows]
        # Sensors that are slower than the log repeat their rows: the first of them is the reading.
        new = np.concatenate([[True], np.any(x[1:] != x[:-1], axis=1)])
        return SwingLog(
            name=name, time=time, turn_time=time[rows][new], quaternions=x[new, :4],
            positions=x[new, 4:] if x.shape[1] > 4 else None, tensions=tensions, lengths=lengths,
        )  # fmt: skip

    def turns_at(self, time: Array) -> Rotation:
        """Rotations at times, between rows on the way of their quaternions."""
        return Rotation.from_quat(self._between(time, self.quaternions)[:, [1, 2, 3, 0]])

    def positions_at(self, time: Array) -> Array | None:
        """Positions at times, shape (n, 3) [m]."""
        return None if self.positions is None else self._between(time, self.positions)

    def _between(self, time: Array, table: Array) -> Array:
        return np.column_stack([np.interp(time, self.turn_time, column) for column in table.T])


@dataclass(frozen=True, kw_only=True, eq=False)
class Stretch:
    """A part of a log, at even instants.

    Attributes:
        time: Shape (n,) [s].
        log: The whole log.
        covered: True near a reading of turns, shape (n,).
        tensions: Between rows, not means, which would damp them; shape (n, m) [N], NaN: none.
    """

    time: Array
    log: SwingLog
    covered: np.typing.NDArray[np.bool_]
    tensions: Array = field(repr=False)

    @property
    def count(self) -> int:
        """Instants n."""
        return len(self.time)

    @property
    def step(self) -> float:
        """Between instants [s]."""
        return float(self.time[1] - self.time[0])

    @property
    def turns(self) -> Rotation:
        """Measured rotations."""
        return self.log.turns_at(self.time)

    @property
    def positions(self) -> Array | None:
        """Measured positions, shape (n, 3) [m]."""
        return self.log.positions_at(self.time)

    def first(self, duration: float) -> Stretch:
        """The beginning of it."""
        n = max(min(self.count, round(duration / self.step) + 1), 2)
        return replace(
            self, time=self.time[:n], covered=self.covered[:n], tensions=self.tensions[:n]
        )


def cut(robot: SwingingRobot, log: SwingLog, spans: Sequence[tuple[float, float]]) -> list[Stretch]:
    """Stretches of a log, by first and last instant of each [s].

    Raises:
        IdentificationError: One is too short or not in the log, or winches turn in it.
    """
    time, m = log.time, robot.cables.count
    usual = float(np.median(np.diff(log.turn_time)))
    rate = min(RATE, 1.0 / usual)
    stretches = []
    for start, end in spans:
        words = f"{log.name}: stretch {start:g}:{end:g}"
        if not (time[0] <= start and end <= time[-1] and end - start >= SHORTEST):
            raise IdentificationError(
                f"{log.name}: stretch: found {start:g}:{end:g}; accepted: {SHORTEST:g} s or more "
                f"within {time[0]:g} to {time[-1]:g} s"
            )
        if log.lengths is not None:
            inside = (time >= start) & (time <= end)
            for name, values in zip(robot.dynamics.names, log.lengths[inside].T, strict=True):
                counted = values[np.isfinite(values)]
                if len(counted) and np.ptp(counted) > STANDS:
                    raise IdentificationError(
                        f"{words}: {name}: found its length changing by {np.ptp(counted):.3g} m; "
                        "accepted of a free motion: winches that stand still, "
                        f"{STANDS:g} m at most"
                    )
        t = start + np.arange(int((end - start) * rate) + 1) / rate
        after = np.searchsorted(log.turn_time, t).clip(1, len(log.turn_time) - 1)
        away = np.minimum(np.abs(log.turn_time[after] - t), np.abs(log.turn_time[after - 1] - t))
        covered = away < MISSED * usual
        if not covered.any():
            raise IdentificationError(f"{words}: found no turns in it; accepted: a part with some")
        tensions = np.full((len(t), m), np.nan)
        for i, column in enumerate([] if log.tensions is None else log.tensions.T):
            good = np.isfinite(column)
            if good.any():
                tensions[:, i] = np.interp(t, time[good], column[good])
        stretches.append(Stretch(time=t, log=log, covered=covered, tensions=tensions))
    return stretches


def mean_pose(stretches: Sequence[Stretch]) -> tuple[Rotation, Array | None]:
    """Mean turn, and mean position, shape (3,) [m], of a tracker's readings."""
    turn = Rotation.concatenate([s.turns for s in stretches]).mean()
    rows = [p for s in stretches if (p := s.positions) is not None]
    return turn, np.mean(np.concatenate(rows), axis=0) if rows else None


def start_pose(robot: SwingingRobot, stretches: Sequence[Stretch], tracked: bool) -> RigidTransform:
    """A pose near which the platform hangs.

    The mean of the tracker's if it is `tracked` in W; else below or above the home pose, where
    tensions that carry the weight are nearest to those measured; else the home pose.
    """
    home, cables, platform = robot.home, robot.cables, robot.platform
    if tracked:
        turn, p = mean_pose(stretches)
        return RigidTransform(RotationMatrix(turn.as_matrix()), p)
    tensions = np.concatenate([s.tensions for s in stretches])
    if not np.isfinite(tensions).all(axis=1).any():
        return home
    measured = np.nanmean(tensions, axis=0)
    gravity = platform.acceleration()
    weight, down = platform.mass * gravity, gravity / np.linalg.norm(gravity)
    span = float(np.max(np.ptp(cables.p_WA, axis=1)))
    least, best = np.inf, home
    for along in np.linspace(-span, span, HEIGHTS):
        X = RigidTransform(home.rotation(), home.translation() + along * down)
        try:
            J = cable_paths(X, cables).J
        except CableGeometryError:
            continue  # no platform is where a cable cannot run
        arm = X.rotation().matrix() @ platform.p_PCo
        wrench = np.concatenate([np.cross(arm, weight), weight])
        t = np.linalg.lstsq(J.T, wrench, rcond=None)[0]
        off = float(np.sum((t - measured) ** 2))
        if np.all(t > 0.0) and off < least:
            least, best = off, X
    return best

"""Motions of which a log is expected to tell most: D-optimal stretches within a robot's limits.

The platform goes from pose to pose, from rest to rest by quintic time laws, each as fast as
tensions, winches and the smoothing allow. Poses are exchanged one by one while the determinant of
the information per time grows; information is a sum over stretches, so that an exchange asks for
two of them alone.

Source: Swevers et al., Optimal robot excitation and identification, 1997; Fedorov, Theory of
optimal experiments, 1972.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.geometry.rotation_kernel import rotations_of_quaternions
from cdpr_drake.identification.regressor import SIZE, inertia_regressor
from cdpr_drake.identification.samples import wrench_matrices
from cdpr_drake.tensions.control_step_kernel import TensionStep, update_tensions_at
from cdpr_drake.tensions.methods import method_for
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, workspace_shape
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

POINTS = 16
"""Instants of a stretch at which limits are kept and information is counted."""

SLOWER = 1.2
LONGEST = 6.0
"""A stretch that asks for too much takes so many times as long, until this much [s]."""

DRAWS = 200
"""Poses that are drawn for one that can be gone to."""

METHOD = "quadratic_program"
"""Its verdicts are exact: where it finds no tensions within the limits there are none."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ExcitationTask:
    """What an excitation may do, and of what it shall tell.

    Attributes:
        cables: The cables as they are believed to be.
        inertial: The ten inertial parameters as believed.
        gravity: Acceleration of a falling body in W, shape (3,) [m/s^2].
        start: Where it begins and ends.
        lower: Corner of the box of Po [m].
        upper: The other one [m].
        turn: Largest turn about each axis from the start's rotation [rad].
        tensions: Smallest and largest tension, with what feedback needs left out [N].
        cable_speed: Largest speed of a cable [m/s].
        cable_acceleration: Largest acceleration of a cable [m/s^2].
        shortest: Least time of a stretch, which the smoothing can follow [s].
        size: Length scale of the platform [m].
    """

    cables: CableSet
    inertial: Array
    gravity: Array
    start: RigidTransform
    lower: Array
    upper: Array
    turn: float
    tensions: tuple[float, float]
    cable_speed: float
    cable_acceleration: float
    shortest: float
    size: float

    def __post_init__(self) -> None:
        """Checks the numbers.

        Raises:
            IdentificationError: A limit is not accepted.
        """
        for name in ("turn", "cable_speed", "cable_acceleration", "shortest", "size"):
            value = getattr(self, name)
            if not value > 0.0:
                raise IdentificationError(f"excitation: {name}: found {value:g}; accepted: > 0")
        if not np.all(self.lower <= self.upper):
            raise IdentificationError("excitation: box: found corners that cross; accepted: others")


@dataclass(frozen=True, eq=False)
class Excitation:
    """A motion, and what is expected of it.

    Attributes:
        trajectory: The motion.
        score: Logarithm of the determinant of the information per time, in typical sizes.
        first_score: The same of the random poses from which the search started.
        condition: Condition number of the equations in typical sizes.
    """

    trajectory: PoseTrajectory
    score: float
    first_score: float
    condition: float


def design_excitation(
    task: ExcitationTask,
    count: int,
    random: np.random.Generator,
    *,
    rounds: int = 2,
    candidates: int = 6,
    pause: float = 0.2,
    say: Callable[[str], None] = lambda words: None,
) -> Excitation:
    """Poses between start and start of which a log tells most, and how fast to go.

    Args:
        task: Limits and belief.
        count: Poses beside the start.
        random: Where candidates come from.
        rounds: Times that each pose is tried to be exchanged; 0: random poses.
        candidates: Tried for each.
        pause: Rest at the start [s].
        say: Told what is done now.

    Raises:
        IdentificationError: Hardly any pose can be gone to within the limits.
    """
    search = _Search(task, random)
    poses = [task.start]
    pieces: list[_Piece] = []
    while len(poses) <= count:
        last = len(poses) == count
        pose, found = search.drawn(poses[-1], task.start if last else None)
        poses.append(pose)
        pieces += found
    poses.append(task.start)
    first = _score(pieces)
    for number in range(rounds):
        say(f"Choosing the excitation, round {number + 1} of {rounds}")
        for k in range(1, count + 1):
            for _ in range(candidates):
                try:
                    pose, found = search.drawn(poses[k - 1], poses[k + 1])
                except IdentificationError:
                    continue
                tried = [*pieces[: k - 1], *found, *pieces[k + 1 :]]
                if _score(tried) > _score(pieces):
                    poses[k], pieces = pose, tried
    H = np.asarray(sum(piece.information for piece in pieces))
    trajectory = PoseTrajectory(tuple(poses), tuple(p.duration for p in pieces), pause)
    return Excitation(trajectory, _score(pieces), first, float(np.sqrt(np.linalg.cond(H))))


@dataclass(frozen=True, eq=False)
class _Piece:
    """A stretch: how long it takes, and what it tells."""

    duration: float
    information: Array


def _score(pieces: list[_Piece]) -> float:
    """Logarithm of the determinant of the information per time."""
    total = sum(piece.duration for piece in pieces)
    H = sum(piece.information for piece in pieces) / total
    sign, value = np.linalg.slogdet(H)
    return float(value) if sign > 0.0 else -np.inf


class _Search:
    """Stretches that a robot can go along."""

    def __init__(self, task: ExcitationTask, random: np.random.Generator) -> None:
        self.task, self.random = task, random
        m = task.cables.count
        if m < 6:
            raise IdentificationError(
                f"excitation: found {m} cables; accepted: at least 6, which can follow a motion"
            )
        low, high = task.tensions
        bounds = np.vstack([np.full(m, low), np.full(m, high), np.zeros(m)])
        scale = np.array([task.size] * 3 + [1.0] * 3)
        chosen = method_for(METHOD, m - 6, False)
        self.step = TensionStep(
            chosen.compiled(m - 6), task.cables.packed(), 0.0, bounds, scale,
            room=workspace_shape(6, m), starts=chosen.starts,
        )  # fmt: skip
        self.packed = task.cables.packed()
        self.held, self.verdict = np.empty(m), np.empty(1)
        L, mass = task.size, float(task.inertial[0])
        self.typical = np.array([mass] + [mass * L] * 3 + [mass * L * L] * 6)

    def drawn(
        self, before: RigidTransform, after: RigidTransform | None
    ) -> tuple[RigidTransform, list[_Piece]]:
        """A pose that can be gone to, and from there on, with the stretches."""
        task = self.task
        for _ in range(DRAWS):
            place = self.random.uniform(task.lower, task.upper)
            turn = task.turn * self.random.uniform(-1.0, 1.0, 3)
            X = RigidTransform(task.start.rotation() @ rotation_from_vector(turn), place)
            first = self.piece(before, X)
            if first is None:
                continue
            if after is None:
                return X, [first]
            second = self.piece(X, after)
            if second is not None:
                return X, [first, second]
        raise IdentificationError(
            f"excitation: found no pose that can be gone to among {DRAWS} drawn in "
            f"{np.round(task.lower, 3).tolist()} to {np.round(task.upper, 3).tolist()} m with "
            f"turns of {np.degrees(task.turn):.3g} deg; accepted: a smaller box, smaller turns or "
            "wider limits of tensions"
        )

    def piece(self, X: RigidTransform, Y: RigidTransform) -> _Piece | None:
        """The fastest stretch between two poses that keeps the limits; None: none does."""
        ends = _rows(PoseTrajectory((X, Y), (1.0,)), 1.0)[[0, -1]]  # at rest, however long it takes
        if not self._pulls(ends, self._regressor(ends) @ self.task.inertial):
            return None
        duration = self.task.shortest
        while duration <= LONGEST:
            rows = _rows(PoseTrajectory((X, Y), (duration,)), duration)
            if self._moves(rows, duration):
                W = wrench_matrices(rows[:, :13], self.task.cables)
                if not np.isfinite(W).all():
                    return None
                Y_ = self._regressor(rows)
                if self._pulls(rows, Y_ @ self.task.inertial):
                    return _Piece(duration, self._information(Y_, W) * duration)
            duration *= SLOWER
        return None

    def _regressor(self, rows: Array) -> Array:
        R = rotations_of_quaternions(np.ascontiguousarray(rows[:, :4]))
        return inertia_regressor(R, rows[:, 7:13], rows[:, 13:], self.task.gravity)

    def _moves(self, rows: Array, duration: float) -> bool:
        """Whether winches are fast enough; accelerations by differences of cable speeds."""
        out, rates = np.empty((2, len(self.packed))), []
        for row in rows:
            cable_motions(row[:13], self.packed, 0.0, out)
            rates.append(out[1].copy())
        speeds = np.array(rates)
        if not np.isfinite(speeds).all() or np.max(np.abs(speeds)) > self.task.cable_speed:
            return False
        bends = np.gradient(speeds, duration / (POINTS - 1), axis=0)
        return bool(np.max(np.abs(bends)) <= self.task.cable_acceleration)

    def _pulls(self, rows: Array, wrenches: Array) -> bool:
        """Whether tensions within the limits give the wrenches, by the exact kernel."""
        for row, wrench in zip(rows, wrenches, strict=True):
            code = update_tensions_at(
                self.step.table, np.ascontiguousarray(row[:13]), wrench, self.held, self.verdict
            )
            if code != FEASIBLE:
                return False
        return True

    def _information(self, Y: Array, W: Array) -> Array:
        """Mean over the points, of tensions with unit variance, in typical sizes."""
        H = np.zeros((SIZE, SIZE))
        for A, each in zip(Y * self.typical, W, strict=True):
            H += A.T @ np.linalg.solve(each @ each.T, A)
        return H / len(Y)


def _rows(trajectory: PoseTrajectory, duration: float) -> Array:
    """Motion rows at `POINTS` instants of a trajectory of one stretch, shape (n, 19)."""
    return np.array([trajectory.motion(t) for t in np.linspace(0.0, duration, POINTS)])

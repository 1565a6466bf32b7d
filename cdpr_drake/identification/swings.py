"""Identification from free motion: a platform swings on cables whose winches stand still.

The whole motion is predicted from its state at the beginning of each stretch, and compared with
measured turns, positions and tensions (output error, Ljung, System identification, 1999, 3.3).
First its beginning is fitted, then longer parts: a wrong frequency only shows as a phase that runs
away. Held-out stretches are predicted by the fitted model, from a state by their own beginning.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_drake.arrays import Array
from cdpr_drake.errors import EquilibriumError, IdentificationError
from cdpr_drake.identification.parameters import AXES, MASS_GROUP
from cdpr_drake.identification.result import MISFIT, MISFIT_FACTOR, OPTIMAL
from cdpr_drake.identification.swing_log import Stretch, SwingLog, cut, mean_pose, start_pose
from cdpr_drake.identification.swing_model import (
    FREE_GROUPS,
    SENSOR,
    START,
    SwingingRobot,
    SwingModel,
    Unknown,
)
from cdpr_drake.identification.swing_prediction import PredictedStretch, predicted, pulled
from cdpr_drake.identification.swing_states import StartCoordinates, first_state, moved_sizes

HORIZONS = ((0.6, 12), (1.5, 12), (1e9, 40))
"""So much of each stretch is fitted [s], with so many steps at most: first what belongs to sensors
and to the beginning, then all."""

SMALL = 1e-5
"""Differences to either side, in sizes of unknowns: slopes are right to some 1e-6. To one side they
are off by 1e-4, and what singular values 4e4 apart tell of the mass was lost in that."""

INSIDE = 0.03
"""So far from its bounds an unknown starts, in sizes: at a bound the search takes small steps."""

LOST = 1e3
"""Residuals of a motion that cannot go on [sigma]."""

OUTLYING = 3.0
"""Residuals beyond so many sigmas count linearly [sigma]."""

CLOSE = 1e-5
"""The search ends where the cost changes by less than this share: of some thousand residuals, less
than a tenth of a standard error."""


@dataclass(frozen=True)
class SwingSigmas:
    """Standard deviations of a log.

    Attributes:
        turn: Of turns about each axis [rad].
        position: Of each coordinate [m].
        tension: Of each cable [N].
    """

    turn: float = 0.0175
    position: float = 0.003
    tension: float = 5.0


@dataclass(frozen=True, kw_only=True, eq=False)
class SwingTask:
    """What is identified of a log of free motion.

    Attributes:
        unknown: Groups of `FREE_GROUPS` and `NAMED_GROUPS`; None: all of the first that the log
            can tell.
        stretches: First and last instants of stretches to fit [s]; none: the first half of the
            log.
        held_out: The same of stretches to predict; none: the second half of the log, where
            stretches are not given either.
        start: A pose near which the platform hangs; None: see `start_pose`.
        tracker: True if the frame of a tracker of poses is unknown; else it is W.
        lead: The first state of a held-out stretch is estimated from so much of it [s].
        priors: Standard deviations known beforehand, by groups of `PRIOR_UNITS`.
    """

    robot: SwingingRobot
    unknown: tuple[str, ...] | None = None
    stretches: tuple[tuple[float, float], ...] = ()
    held_out: tuple[tuple[float, float], ...] = ()
    sigmas: SwingSigmas = field(default_factory=SwingSigmas)
    start: RigidTransform | None = None
    tracker: bool = False
    lead: float = 1.0
    priors: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class SwingFit:
    """A robot's dynamics by a log of free motion.

    Attributes:
        status: `OPTIMAL`, or `MISFIT` where residuals are more than `MISFIT_FACTOR` sigmas.
        model: The robot as a function of the unknowns.
        values: The most likely unknowns, shape (f,).
        std: Their standard errors, shape (f,), infinite where the log does not tell: residuals are
            correlated in time, and count as their correlation allows.
        spread: Residuals over sigma, root mean square.
        correlation_time: Residuals are correlated over so many instants.
        fitted: Stretches that were fitted.
        held_out: Stretches that were predicted.
        modes: Frequencies about rest, identified and believed, shapes (6,) [Hz].
        steps: Steps of the search.
        wall_time: [s].
        remarks: What should be known, in words.
    """

    task: SwingTask
    log: SwingLog
    status: str
    model: SwingModel
    values: Array
    std: Array
    spread: float
    correlation_time: float
    fitted: tuple[PredictedStretch, ...]
    held_out: tuple[PredictedStretch, ...]
    modes: tuple[Array, Array]
    steps: int
    wall_time: float
    remarks: tuple[str, ...]

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The unknowns."""
        return self.model.unknowns


def fit_swings(
    task: SwingTask, log: SwingLog, say: Callable[[str], object] = lambda _: None
) -> SwingFit:
    """Finds a robot's dynamics in a log of free motion; `say` gets a line on what is done now.

    Raises:
        IdentificationError: The log does not hold what is unknown, or no motion follows from it.
    """
    began = clock.monotonic()
    spans, held_spans = task.stretches, task.held_out
    if not spans:
        first, last = float(log.time[0]), float(log.time[-1])
        middle = 0.5 * (first + last)
        spans, held_spans = ((first, middle),), held_spans or ((middle, last),)
    stretches, held = cut(task.robot, log, spans), cut(task.robot, log, held_spans)
    tracked = log.positions is not None
    start = task.start
    if start is None:
        start = start_pose(task.robot, stretches, tracked and not task.tracker)
    groups = _groups(task, log, stretches)
    model = SwingModel.of(task.robot, start, groups, not tracked, tracked and task.tracker)
    model = _sensor_believed(model.knowing(task.priors), stretches)
    z, steps = model.first(), 0
    everything = np.ones(len(z), bool)
    sensor = np.array([u.group in ("", SENSOR) for u in model.unknowns])
    vector = model.before() + model.sizes() * z
    moved = [first_state(model, vector, s) for s in stretches]
    for n, (horizon, most) in enumerate(HORIZONS):
        stage = f"{'first ' + str(horizon) + ' s' if horizon < 1e3 else 'whole'} of each stretch"
        say(stage)
        parts = [s.first(horizon) for s in stretches]
        free = sensor if n == 0 else everything
        search = _Search(model, task.sigmas, parts, free, partial(say, stage))
        z, moved, solution = search.solve(z, moved, most)
        steps += int(solution.nfev)
    if not np.isfinite(solution.cost) or solution.cost > 0.1 * LOST**2 * len(solution.fun):
        raise IdentificationError(
            f"{log.name}: found no motion of {task.robot.name} that goes on as measured; accepted: "
            "stretches in which nothing but cables and weight acts, or a start pose"
        )
    vector = search.vector(z)
    spread, together = search.spread(z, moved)
    std = search.errors(solution, spread, together)
    say("held-out stretches")
    fitted = tuple(
        predicted(model, vector, s, x, np.inf) for s, x in zip(stretches, moved, strict=True)
    )
    held_out = []
    for s in held:
        beginning = _Search(model, task.sigmas, [s.first(task.lead)], ~everything)
        x = first_state(model, vector, beginning.stretches[0])
        _, (x,), _ = beginning.solve(z, [x], HORIZONS[-1][1])
        held_out.append(predicted(model, vector, s, x, task.lead))
    remarks = (*_remarks(model, std, spread, vector), *pulled(model, vector, (*fitted, *held_out)))
    if solution.status == 0:
        unsettled = (
            f"the search ended after {HORIZONS[-1][1]} steps before it settled: values may be off "
            "by more than their standard errors; a start pose nearer to where it hangs helps"
        )
        remarks = (unsettled, *remarks)
    return SwingFit(
        task=task, log=log, status=MISFIT if spread > MISFIT_FACTOR else OPTIMAL, model=model,
        values=vector, std=std, spread=spread, correlation_time=together, fitted=fitted,
        held_out=tuple(held_out), modes=(_modes(model, vector), _modes(model, model.before())),
        steps=steps, wall_time=clock.monotonic() - began, remarks=remarks,
    )  # fmt: skip


def _groups(task: SwingTask, log: SwingLog, stretches: Sequence[Stretch]) -> tuple[str, ...]:
    """Groups that are unknown: a mass needs tensions."""
    weighed = any(np.isfinite(s.tensions).any() for s in stretches)
    if task.unknown is None:
        return FREE_GROUPS if weighed else tuple(g for g in FREE_GROUPS if g != MASS_GROUP)
    if MASS_GROUP in task.unknown and not weighed:
        raise IdentificationError(
            f"{log.name}: tensions: found none; accepted: columns such as C1_tension_n, without "
            "which a free motion does not tell the mass"
        )
    return task.unknown


def _sensor_believed(model: SwingModel, stretches: Sequence[Stretch]) -> SwingModel:
    """Heading, mount or frame of a sensor such that its mean is the start pose."""
    mean, p = mean_pose(stretches)
    R_start = Rotation.from_matrix(model.start.rotation().matrix())
    before: dict[str, float] = {}
    if "sensor.heading" in model.names:
        heading = mean.as_euler("ZYX")[0] - RollPitchYaw(model.start.rotation()).yaw_angle()
        upright = Rotation.from_rotvec([0.0, 0.0, heading]) * R_start
        before["sensor.heading"] = float(np.angle(np.exp(1j * heading)))
        mount = (upright.inv() * mean).as_rotvec()
        before |= {f"sensor.mount_{a}": float(x) for a, x in zip(AXES, mount, strict=True)}
    if "tracker.x" in model.names:
        turn = mean * R_start.inv()
        offset = p - turn.apply(model.start.translation())
        for what, row in (("tracker.turn_", turn.as_rotvec()), ("tracker.", offset)):
            before |= {f"{what}{a}": float(x) for a, x in zip(AXES, row, strict=True)}
    unknowns = tuple(replace(u, before=before.get(u.name, u.before)) for u in model.unknowns)
    return replace(model, unknowns=unknowns)


def steps_within(x: Array, least: Array, largest: Array) -> tuple[Array, Array]:
    """Steps down and up for slopes at x, `SMALL` each, or less where a bound is nearer."""
    return np.minimum(SMALL, x - least), np.minimum(SMALL, largest - x)


@dataclass(frozen=True, eq=False)
class _Search:
    """The unknowns in sizes, and what moves the first state of each stretch, in sizes."""

    model: SwingModel
    sigmas: SwingSigmas
    stretches: Sequence[Stretch]
    free: np.typing.NDArray[np.bool_]
    step: Callable[[], object] = lambda: None
    """Called before each step; may raise to stop the search."""

    def vector(self, z: Array) -> Array:
        """Unknowns from sizes."""
        return self.model.before() + self.model.sizes() * z

    def measured(self, z: Array, moved: Array, stretch: Stretch) -> Array:
        """Residuals of what was measured in a stretch [sigma], shape (n, 6 + m)."""
        model, vector, n = self.model, self.vector(z), stretch.count
        states, tensions = model.run(vector, moved, n, stretch.step)
        out = np.zeros((n, 6 + model.robot.cables.count))
        if not np.isfinite(states).all():
            return np.full_like(out, LOST)
        turns, p = model.sensed(vector, states, stretch.step)
        out[:, :3] = (turns.inv() * stretch.turns).as_rotvec() / self.sigmas.turn
        positions = stretch.positions
        if positions is not None:
            out[:, 3:6] = (positions - p) / self.sigmas.position
        out[:, :6] *= stretch.covered[:, None]
        off = (stretch.tensions - model.sensed_tensions(vector, tensions)) / self.sigmas.tension
        out[:, 6:] = np.where(np.isfinite(off), off, 0.0)
        return np.clip(out, -LOST, LOST)

    def part(self, z: Array, y: Array, at: StartCoordinates, stretch: Stretch) -> Array:
        """All residuals of a stretch, with its first state of coordinates y."""
        moved = at.moved(self.vector(z), y)
        if not np.isfinite(moved).all():
            return np.full(stretch.count * (6 + self.model.robot.cables.count) + len(y), LOST)
        rest = moved / moved_sizes(moved)
        return np.concatenate([self.measured(z, moved, stretch).ravel(), rest])

    def solve(self, z: Array, moved: list[Array], most: int) -> tuple[Array, list[Array], Any]:
        """Least squares from here; the unknowns, first states, and scipy's result."""
        model, f, base = self.model, np.flatnonzero(self.free), z.copy()
        one = START + model.memory  # numbers of a first state
        starts = [StartCoordinates.about(model, each) for each in moved]

        def parts(x: Array) -> tuple[Array, list[tuple[Array, StartCoordinates, Stretch]]]:
            z = base.copy()
            z[f] = x[: len(f)]
            states = x[len(f) :].reshape(len(starts), one)
            return z, list(zip(states, starts, self.stretches, strict=True))

        def residuals(x: Array) -> Array:
            z, each = parts(x)
            return np.concatenate([*(self.part(z, *state) for state in each), x[: len(f)]])

        def jacobian(x: Array) -> Array:
            self.step()
            (z, each), (down, up) = parts(x), steps_within(x, least, largest)
            rows = []
            for j, (y, at, s) in enumerate(each):
                J = np.zeros((s.count * (6 + model.robot.cables.count) + one, len(x)))
                for k in range(len(f)):
                    unit = np.eye(len(z))[f[k]]
                    ahead, back = (self.part(z + d * unit, y, at, s) for d in (up[k], -down[k]))
                    J[:, k] = (ahead - back) / (up[k] + down[k])
                for k in range(one):
                    unit, c = np.eye(one)[k], len(f) + one * j + k
                    ahead, back = (self.part(z, y + d * unit, at, s) for d in (up[c], -down[c]))
                    J[:, c] = (ahead - back) / (up[c] + down[c])
                rows.append(J)
            return np.vstack([*rows, np.eye(len(f), len(x))])

        first = [at.of(self.vector(z), m) for at, m in zip(starts, moved, strict=True)]
        x = np.concatenate([z[f], *first])
        least, largest = np.full(len(x), -np.inf), np.full(len(x), np.inf)
        for k, u in enumerate(np.array(model.unknowns, object)[f]):
            least[k] = (u.least - u.before) / u.size
            largest[k] = (u.most - u.before) / u.size
        for rim, side in ((-1.0, least), (1.0, largest)):
            side[len(f) :].reshape(-1, one)[:, START:] = rim  # contacts bend no farther
        room = INSIDE * np.minimum(1.0, largest - least)
        x = np.clip(x, least + room, largest - room)
        solution = least_squares(
            residuals, x, jac=jacobian, bounds=(least, largest), loss="huber", f_scale=OUTLYING,
            x_scale="jac", max_nfev=most, ftol=CLOSE, xtol=1e-9,
        )  # fmt: skip
        z, each = parts(solution.x)
        vector = self.vector(z)
        return z, [at.moved(vector, y) for y, at, _ in each], solution

    def spread(self, z: Array, moved: Sequence[Array]) -> tuple[float, float]:
        """Root mean square of residuals [sigma], and over how many instants they go together."""
        tables = [self.measured(z, x, s) for x, s in zip(moved, self.stretches, strict=True)]
        rests = np.concatenate([t.ravel() for t in tables])
        rests = rests[rests != 0.0]
        spread = float(np.sqrt(np.mean(rests**2))) if len(rests) else 0.0
        top, bottom = 0.0, 0.0
        for table in tables:
            for column in table.T:
                power = float(column @ column)
                if power > 0.0:
                    top += power * _together(column)
                    bottom += power
        return spread, max(top / bottom, 1.0) if bottom else 1.0

    def errors(self, solution: Any, spread: float, together: float) -> Array:
        """Standard errors of the unknowns; infinite where the log tells no more than the prior."""
        n = int(np.count_nonzero(self.free))
        J = solution.jac[: -n or None]  # without the priors of the unknowns
        information = J.T @ J / (max(spread, 1.0) ** 2 * together)
        information[n:, n:] += np.eye(len(information) - n) * 1e-6
        beforehand = [1.0 if u.prior else 1e-4 for u in self.model.unknowns]
        whole = information + np.diag(np.r_[beforehand, np.zeros(len(information) - n)])
        variance = np.diag(np.linalg.pinv(whole, hermitian=True))[:n]
        std = self.model.sizes() * np.sqrt(np.maximum(variance, 0.0))
        # A prior as wide as 100 sizes keeps the matrix regular; what it tells alone is nothing.
        return np.where(variance > 25.0, np.inf, std)


def _together(column: Array) -> float:
    """Integrated autocorrelation, up to where it first falls to nothing, at least 1."""
    n = len(column)
    spectrum = np.abs(np.fft.rfft(column, 2 * n)) ** 2
    rho = np.fft.irfft(spectrum)[:n]
    rho = rho / rho[0]
    below = np.flatnonzero(rho <= 0.0)
    last = int(below[0]) if len(below) else n
    return float(max(1.0 + 2.0 * np.sum(rho[1:last]), 1.0))


def _modes(model: SwingModel, vector: Array) -> Array:
    try:
        return model.frequencies(vector)
    except EquilibriumError:
        return np.full(6, np.nan)


def _remarks(model: SwingModel, std: Array, spread: float, vector: Array) -> tuple[str, ...]:
    remarks = []
    untold = [u.name for u, s in zip(model.unknowns, std, strict=True) if not np.isfinite(s)]
    if untold:
        remarks.append(f"not told by these stretches: {', '.join(untold)}")
    edge = [
        u.name for u, x in zip(model.unknowns, vector, strict=True)
        if min(x - u.least, u.most - x) < 1e-6 * u.size and np.isfinite(u.least)
    ]  # fmt: skip
    if edge:
        remarks.append(f"at a bound: {', '.join(edge)}")
    if model.memory:
        remarks.append(
            "with hysteresis the platform rests beside its pose by as much as contacts hold; modes "
            "are those of swings that slip"
        )
    if spread > 1.0:
        remarks.append(
            f"residuals are {spread:.3g} sigma: standard errors are as much larger, and for "
            "correlation in time"
        )
    return tuple(remarks)

"""Identification from free motion: a platform swings on cables whose winches stand still.

The whole motion is predicted from its state at the beginning of each stretch, and compared with
turns, positions and tensions that were measured (output error, Ljung, System identification, 1999,
3.3). First its beginning is fitted, then longer parts: a wrong frequency only shows as a phase that
runs away. What was held out is predicted by what was fitted, from a state that its own beginning
tells.
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

from cdpr_drake.analyses.calibration.free_motion_balance import (
    PULL,
    PULLED,
    Unexplained,
    unexplained,
)
from cdpr_drake.analyses.calibration.free_motion_model import (
    FREE_GROUPS,
    HYSTERESIS,
    START,
    FreeMotionModel,
    Unknown,
)
from cdpr_drake.analyses.calibration.free_motion_samples import (
    Stretch,
    cut,
    recorded_turns,
    start_pose,
)
from cdpr_drake.analyses.calibration.free_motion_sensor import (
    earlier,
    first_state,
    places_by_lengths,
    sensed,
    sensed_tensions,
    unsensed,
    unsensed_tensions,
)
from cdpr_drake.analyses.calibration.free_motion_start import StartCoordinates, moved_sizes
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.arrays import Array
from cdpr_drake.errors import EquilibriumError, IdentificationError
from cdpr_drake.identification.parameters import MASS_GROUP
from cdpr_drake.identification.result import MISFIT, MISFIT_FACTOR, OPTIMAL
from cdpr_drake.models.robot_schema import Robot

HORIZONS = ((0.6, 12), (1.5, 12), (1e9, 40))
"""So much of each stretch is fitted, with so many steps at most: first what belongs to sensors and
to the beginning, then all."""

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
class FreeSigmas:
    """Standard deviations of what is compared.

    Attributes:
        turn: Of turns about each axis [rad].
        position: Of each coordinate [m].
        tension: Of each cable's [N].
    """

    turn: float = 0.0175
    position: float = 0.003
    tension: float = 5.0


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeMotionTask:
    """What is asked of a log of free motion.

    Attributes:
        robot: As it is believed.
        unknown: Groups of `FREE_GROUPS` and `ASKED_GROUPS`; None: all of the first that the log
            can tell.
        stretches: First and last instants of stretches that are fitted [s]; none: the first half
            of the log.
        held_out: Of those that are predicted; none: the second half of the log, where stretches
            are not given either.
        sigmas: Standard deviations.
        start: A pose near which the platform hangs; None: see `start_pose`.
        tracker: Whether the frame of a tracker of poses is unknown; else it is W.
        lead: From so much of a held-out stretch its first state is told [s].
        priors: Standard deviations of what is known beforehand, by groups of `PRIOR_UNITS`.
    """

    robot: Robot
    unknown: tuple[str, ...] | None = None
    stretches: tuple[tuple[float, float], ...] = ()
    held_out: tuple[tuple[float, float], ...] = ()
    sigmas: FreeSigmas = field(default_factory=FreeSigmas)
    start: RigidTransform | None = None
    tracker: bool = False
    lead: float = 1.0
    priors: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class FollowedStretch:
    """A stretch beside what was predicted of it.

    Attributes:
        stretch: What was measured.
        lead: From so much of it the first state was told [s]; all of it where it was fitted.
        states: Of the platform, shape (n, 13).
        tensions: As load cells would tell them, shape (n, m) [N].
        turned: Rotation vectors from predicted to measured turns, in the sensor's frame, shape
            (n, 3) [rad].
        measured_turns: Rotation vectors from the mean measured turn, shape (n, 3) [rad].
        predicted_turns: The same of what the sensor would have told.
        positions: Measured in W, or where the measured turns and the cables' lengths put Po,
            shape (n, 3) [m]; NaN where neither does.
        places: Predicted for the times at which those were measured, shape (n, 3) [m].
        unexplained: What pulls beside cables and weight; None: it is not told.
    """

    stretch: Stretch
    lead: float
    states: Array
    tensions: Array
    turned: Array
    measured_turns: Array
    predicted_turns: Array
    positions: Array
    places: Array
    unexplained: Unexplained | None = None

    def after_lead(self) -> np.typing.NDArray[np.bool_]:
        """Instants that are predicted, or all, shape (n,)."""
        time = self.stretch.time
        if self.lead >= time[-1] - time[0]:
            return np.ones(len(time), bool)
        return np.asarray(time - time[0] > self.lead)

    def turn_rms(self) -> float:
        """Angle between predicted and measured turns, root mean square [rad]."""
        rows = self.turned[self.after_lead() & (self.stretch.known > 0.0)]
        return float(np.sqrt(np.mean(np.sum(rows**2, axis=1))))

    def position_rms(self) -> float | None:
        """Distance of predicted and measured positions, root mean square [m]."""
        off = np.sum((self.places - self.positions) ** 2, axis=1)
        rows = off[self.after_lead() & np.isfinite(off) & (self.stretch.known > 0.0)]
        return float(np.sqrt(np.mean(rows))) if len(rows) else None

    def tension_rms(self) -> float | None:
        """Of all cables [N]."""
        off = (self.tensions - self.stretch.tensions)[self.after_lead()]
        off = off[np.isfinite(off)]
        return float(np.sqrt(np.mean(off**2))) if off.size else None


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeMotion:
    """What a log of free motion told of a robot.

    Attributes:
        task: What was asked.
        log: The log.
        status: `OPTIMAL`, or `MISFIT` where residuals are more than `MISFIT_FACTOR` sigmas.
        model: The robot as a function of the unknowns.
        unknowns: The unknowns.
        values: Found, shape (f,).
        std: Their standard errors, shape (f,), infinite where the log does not tell: residuals are
            correlated in time, and count as their correlation allows.
        spread: Residuals over sigma, root mean square.
        correlation_time: Residuals are correlated over so many instants.
        fitted: Stretches that were fitted.
        held_out: Stretches that were predicted.
        modes: Frequencies about rest, of what was found and as believed, shapes (6,) [Hz].
        steps: Of the search.
        wall_time: [s].
        remarks: What should be known, in words.
    """

    task: FreeMotionTask
    log: Measurements
    status: str
    model: FreeMotionModel
    unknowns: tuple[Unknown, ...]
    values: Array
    std: Array
    spread: float
    correlation_time: float
    fitted: tuple[FollowedStretch, ...]
    held_out: tuple[FollowedStretch, ...]
    modes: tuple[Array, Array]
    steps: int
    wall_time: float
    remarks: tuple[str, ...]


def fit_free_motion(
    task: FreeMotionTask, log: Measurements, say: Callable[[str], object] = lambda _: None
) -> FreeMotion:
    """Finds a robot's dynamics in a log of free motion.

    Args:
        task: What is asked.
        log: The log.
        say: Told what is done now.

    Raises:
        IdentificationError: The log does not hold what is asked, or no motion follows from it.
    """
    began, recorded = clock.monotonic(), recorded_turns(log)
    fitted_spans, held_spans = _spans(task, recorded.time)
    fitted = cut(task.robot, log, recorded, fitted_spans)
    held = cut(task.robot, log, recorded, held_spans)
    tracked = recorded.positions is not None
    start = start_pose(task.robot, fitted, tracked and not task.tracker, task.start)
    groups = _groups(task, log, fitted)
    model = FreeMotionModel.of(task.robot, start, groups, not tracked, tracked and task.tracker)
    model = _sensor_believed(model.knowing(task.priors), fitted)
    z, steps = model.first(), 0
    begun = _Search(model, task.sigmas, fitted, np.ones(len(z), bool)).vector(z)
    moved = [first_state(model, begun, s) for s in fitted]
    sensor = np.array([one.group in ("", "sensor") for one in model.unknowns])
    for n, (horizon, most) in enumerate(HORIZONS):
        stage = f"{'first ' + str(horizon) + ' s' if horizon < 1e3 else 'whole'} of each stretch"
        say(stage)
        free = sensor if n == 0 else np.ones(len(z), bool)
        parts = [s.first(horizon) for s in fitted]
        search = _Search(model, task.sigmas, parts, free, partial(say, stage))
        z, moved, found = search.solve(z, moved, most)
        steps += int(found.nfev)
    if not np.isfinite(found.cost) or found.cost > 0.1 * LOST**2 * len(found.fun):
        raise IdentificationError(
            f"{log.path}: found no motion of {task.robot.name} that goes on as measured; accepted: "
            "stretches in which nothing but cables and weight acts, or a start pose"
        )
    vector = search.vector(z)
    spread, together = search.spread(z, moved)
    std = search.errors(found, spread, together)
    say("held-out stretches")
    followed = [_followed(model, vector, s, x, None) for s, x in zip(fitted, moved, strict=True)]
    predicted = [
        _followed(model, vector, s, lead_state(model, task, z, s), task.lead) for s in held
    ]
    remarks = (
        *_remarks(model, std, spread, vector), *_pulled(model, vector, (*followed, *predicted))
    )  # fmt: skip
    if found.status == 0:
        remarks = (
            f"the search ended after {HORIZONS[-1][1]} steps before it settled: values may be off "
            "by more than their standard errors; a start pose nearer to where it hangs helps",
            *remarks,
        )  # fmt: skip
    return FreeMotion(
        task=task, log=log, status=MISFIT if spread > MISFIT_FACTOR else OPTIMAL, model=model,
        unknowns=model.unknowns, values=vector, std=std, spread=spread,
        correlation_time=together, fitted=tuple(followed), held_out=tuple(predicted),
        modes=(_modes(model, vector), _modes(model, model.before())), steps=steps,
        wall_time=clock.monotonic() - began, remarks=remarks,
    )  # fmt: skip


def _spans(
    task: FreeMotionTask, time: Array
) -> tuple[tuple[tuple[float, float], ...], tuple[tuple[float, float], ...]]:
    """Stretches that are fitted, and held out; halves of the log where none are given."""
    start, end = float(time[0]), float(time[-1])
    if task.stretches:
        return task.stretches, task.held_out
    middle = 0.5 * (start + end)
    return ((start, middle),), task.held_out or ((middle, end),)


def _groups(
    task: FreeMotionTask, log: Measurements, stretches: Sequence[Stretch]
) -> tuple[str, ...]:
    """Groups that are unknown: a mass needs tensions."""
    told = any(np.isfinite(s.tensions).any() for s in stretches)
    if task.unknown is None:
        return FREE_GROUPS if told else tuple(g for g in FREE_GROUPS if g != MASS_GROUP)
    if MASS_GROUP in task.unknown and not told:
        raise IdentificationError(
            f"{log.path}: tensions: found none; accepted: columns such as C1_tension_n, without "
            "which a free motion does not tell the mass"
        )
    return task.unknown


def _sensor_believed(model: FreeMotionModel, stretches: Sequence[Stretch]) -> FreeMotionModel:
    """Heading, mount or frame of a sensor such that its mean is the start pose."""
    mean = Rotation.concatenate([s.recorded.turns_at(s.time) for s in stretches]).mean()
    R_start = model.start.rotation().matrix()
    before: dict[str, float] = {}
    names = model.names
    if "sensor.heading" in names:
        heading = mean.as_euler("ZYX")[0] - RollPitchYaw(model.start.rotation()).yaw_angle()
        upright = Rotation.from_rotvec([0.0, 0.0, heading]) * Rotation.from_matrix(R_start)
        mount = (upright.inv() * mean).as_rotvec()
        before["sensor.heading"] = float(np.angle(np.exp(1j * heading)))
        before |= {f"sensor.mount_{a}": float(x) for a, x in zip("xyz", mount, strict=True)}
    if "tracker.x" in names:
        turn = mean * Rotation.from_matrix(R_start).inv()
        rows = [s.recorded.positions_at(s.time) for s in stretches]
        p = np.mean(np.concatenate([row for row in rows if row is not None]), axis=0)
        offset = p - turn.apply(model.start.translation())
        before |= {
            f"tracker.turn_{a}": float(x) for a, x in zip("xyz", turn.as_rotvec(), strict=True)
        }
        before |= {f"tracker.{a}": float(x) for a, x in zip("xyz", offset, strict=True)}
    changed = tuple(replace(one, before=before.get(one.name, one.before)) for one in model.unknowns)
    return replace(model, unknowns=changed)


def steps_within(x: Array, least: Array, largest: Array) -> tuple[Array, Array]:
    """Steps down and up for slopes at x, `SMALL` each, or less where a bound is nearer."""
    return np.minimum(SMALL, x - least), np.minimum(SMALL, largest - x)


@dataclass(frozen=True, eq=False)
class _Search:
    """The unknowns in sizes, and of each stretch what moves its first state, in sizes."""

    model: FreeMotionModel
    sigmas: FreeSigmas
    stretches: Sequence[Stretch]
    free: np.typing.NDArray[np.bool_]
    step: Callable[[], object] = lambda: None
    """Called before each step; may raise to stop the search."""

    def vector(self, z: Array) -> Array:
        """Unknowns from sizes."""
        sizes = np.array([one.size for one in self.model.unknowns])
        return self.model.before() + sizes * z

    def measured(self, z: Array, moved: Array, stretch: Stretch) -> Array:
        """Residuals of what was measured in a stretch [sigma], shape (n, 6 + m)."""
        vector, m = self.vector(z), len(self.model.robot.cables)
        states, tensions = self.model.run(vector, moved, stretch.count, stretch.step)
        if not np.isfinite(states).all():
            return np.full((stretch.count, 6 + m), LOST)
        at = stretch.time
        turns, p = sensed(self.model, vector, states, stretch.step)
        out = np.zeros((stretch.count, 6 + m))
        out[:, :3] = (turns.inv() * stretch.recorded.turns_at(at)).as_rotvec() / self.sigmas.turn
        measured = stretch.recorded.positions_at(at)
        if measured is not None:
            out[:, 3:6] = (measured - p) / self.sigmas.position
        out[:, :6] *= stretch.known[:, None]
        told = sensed_tensions(self.model, vector, tensions)
        off = (stretch.tensions - told) / self.sigmas.tension
        out[:, 6:] = np.where(np.isfinite(off), off, 0.0)
        return np.clip(out, -LOST, LOST)

    def part(self, z: Array, y: Array, at: StartCoordinates, stretch: Stretch) -> Array:
        """All residuals that a stretch's first state, of coordinates y, belongs to."""
        moved = at.moved(self.vector(z), y)
        if not np.isfinite(moved).all():
            return np.full(stretch.count * (6 + len(self.model.robot.cables)) + len(y), LOST)
        return np.concatenate(
            [self.measured(z, moved, stretch).ravel(), moved / moved_sizes(moved)]
        )

    def solve(self, z: Array, moved: list[Array], most: int) -> tuple[Array, list[Array], Any]:
        """Least squares from here; the unknowns, first states, and scipy's result."""
        f, base = np.flatnonzero(self.free), z.copy()
        one = START + self.model.memory  # numbers of a first state

        def parts(x: Array) -> tuple[Array, list[Array]]:
            z = base.copy()
            z[f] = x[: len(f)]
            return z, [x[len(f) + one * j :][:one] for j in range(len(self.stretches))]

        def residuals(x: Array) -> Array:
            z, states = parts(x)
            each = zip(states, starts, self.stretches, strict=True)
            return np.concatenate([self.part(z, y, at, s) for y, at, s in each] + [x[: len(f)]])

        def jacobian(x: Array) -> Array:
            self.step()
            z, states = parts(x)
            rows, (down, up) = [], steps_within(x, least, largest)
            each = zip(states, starts, self.stretches, strict=True)
            for j, (y, at, s) in enumerate(each):
                J = np.zeros((s.count * (6 + len(self.model.robot.cables)) + one, len(x)))
                for k in range(len(f)):
                    unit = np.eye(len(z))[f[k]]
                    ahead, back = (self.part(z + d * unit, y, at, s) for d in (up[k], -down[k]))
                    J[:, k] = (ahead - back) / (up[k] + down[k])
                for k in range(one):
                    unit, c = np.eye(one)[k], len(f) + one * j + k
                    ahead, back = (self.part(z, y + d * unit, at, s) for d in (up[c], -down[c]))
                    J[:, c] = (ahead - back) / (up[c] + down[c])
                rows.append(J)
            rows.append(np.eye(len(f), len(x)))
            return np.vstack(rows)

        starts = [StartCoordinates.about(self.model, each) for each in moved]
        first = [at.of(self.vector(z), m) for at, m in zip(starts, moved, strict=True)]
        x = np.concatenate([z[f], *first])
        least, largest = np.full(len(x), -np.inf), np.full(len(x), np.inf)
        for k, u in enumerate(np.array(self.model.unknowns, object)[f]):
            least[k] = (u.least - u.before) / u.size
            largest[k] = (u.most - u.before) / u.size
        for j in range(len(self.stretches) if self.model.memory else 0):
            bent = slice(len(f) + one * j + START, len(f) + one * (j + 1))
            least[bent], largest[bent] = -1.0, 1.0
        room = INSIDE * np.minimum(1.0, largest - least)
        x = np.clip(x, least + room, largest - room)
        found = least_squares(
            residuals, x, jac=jacobian, bounds=(least, largest), loss="huber", f_scale=OUTLYING,
            x_scale="jac", max_nfev=most, ftol=CLOSE, xtol=1e-9,
        )  # fmt: skip
        z, states = parts(found.x)
        vector = self.vector(z)
        return z, [at.moved(vector, y) for at, y in zip(starts, states, strict=True)], found

    def spread(self, z: Array, moved: Sequence[Array]) -> tuple[float, float]:
        """Root mean square of residuals [sigma], and over how many instants they go together."""
        tables = [self.measured(z, x, s) for x, s in zip(moved, self.stretches, strict=True)]
        told = np.concatenate([t.ravel() for t in tables])
        told = told[told != 0.0]
        spread = float(np.sqrt(np.mean(told**2))) if len(told) else 0.0
        top, bottom = 0.0, 0.0
        for table in tables:
            for column in table.T:
                power = float(column @ column)
                if power > 0.0:
                    top += power * _together(column)
                    bottom += power
        return spread, max(top / bottom, 1.0) if bottom else 1.0

    def errors(self, found: Any, spread: float, together: float) -> Array:
        """Standard errors of the unknowns; infinite where the log tells no more than the prior."""
        count = int(np.count_nonzero(self.free))
        J = found.jac[: -count or None]  # without the priors of the unknowns
        n = count
        information = J.T @ J / (max(spread, 1.0) ** 2 * together)
        information[n:, n:] += np.eye(len(information) - n) * 1e-6
        beforehand = [1.0 if u.known else 1e-4 for u in self.model.unknowns]
        whole = information + np.diag(np.r_[beforehand, np.zeros(len(information) - n)])
        variance = np.diag(np.linalg.pinv(whole, hermitian=True))[:n]
        sizes = np.array([one.size for one in self.model.unknowns])
        std = sizes * np.sqrt(np.maximum(variance, 0.0))
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


def lead_state(model: FreeMotionModel, task: FreeMotionTask, z: Array, stretch: Stretch) -> Array:
    """The first state of a stretch by its beginning, with the robot known."""
    search = _Search(model, task.sigmas, [stretch.first(task.lead)], np.zeros(len(z), bool))
    first = first_state(model, search.vector(z), stretch)
    _, moved, _ = search.solve(z, [first], HORIZONS[-1][1])
    return moved[0]


def _followed(
    model: FreeMotionModel, vector: Array, stretch: Stretch, moved: Array, lead: float | None
) -> FollowedStretch:
    states, tensions = model.run(vector, moved, stretch.count, stretch.step)
    if not np.isfinite(states).all():
        raise IdentificationError(
            f"stretch from {stretch.time[0]:g} s: found no motion that goes on to its end"
        )
    turns, _ = sensed(model, vector, states, stretch.step)
    _, places = earlier(states, stretch.step, model.by_name(vector)["sensor.late"])
    measured = stretch.recorded.turns_at(stretch.time)
    R_WP, p = unsensed(model, vector, measured, stretch.recorded.positions_at(stretch.time))
    if p is None:
        told = unsensed_tensions(model, vector, stretch.tensions)
        pulled = np.where(np.isfinite(told), told, tensions)
        p = places_by_lengths(model, vector, R_WP, pulled, places)
    middle = measured.mean().inv()
    return FollowedStretch(
        stretch=stretch, lead=np.inf if lead is None else lead, states=states,
        tensions=sensed_tensions(model, vector, tensions),
        turned=(turns.inv() * measured).as_rotvec(), positions=p, places=places,
        measured_turns=(middle * measured).as_rotvec(),
        predicted_turns=(middle * turns).as_rotvec(),
        unexplained=unexplained(model, vector, stretch, places),
    )  # fmt: skip


def _pulled(
    model: FreeMotionModel, vector: Array, ones: Sequence[FollowedStretch]
) -> tuple[str, ...]:
    """Of stretches in which something else than cables and weight pulls."""
    weight = model.by_name(vector)["mass"] * float(np.linalg.norm(model.robot.gravity_vector()))
    said = []
    for one in ones:
        if one.unexplained is None:
            continue
        force, at = one.unexplained.largest(one.unexplained.force)
        if force > PULLED * weight:
            time = one.stretch.time
            said.append(
                f"stretch {time[0]:.6g}:{time[-1]:.6g}: about {at:.4g} s neither cables nor weight "
                f"explain {force:.3g} N, the mean over {PULL:g} s: a hand, or a wire?"
            )
    return tuple(said)


def _modes(model: FreeMotionModel, vector: Array) -> Array:
    try:
        return model.frequencies(vector)
    except EquilibriumError:
        return np.full(6, np.nan)


def _remarks(model: FreeMotionModel, std: Array, spread: float, vector: Array) -> tuple[str, ...]:
    said = []
    unsaid = [u.name for u, s in zip(model.unknowns, std, strict=True) if not np.isfinite(s)]
    if unsaid:
        said.append(f"not told by these stretches: {', '.join(unsaid)}")
    edge = [
        u.name for u, x in zip(model.unknowns, vector, strict=True)
        if min(x - u.least, u.most - x) < 1e-6 * u.size and np.isfinite(u.least)
    ]  # fmt: skip
    if edge:
        said.append(f"at a bound: {', '.join(edge)}")
    if any(one.group == HYSTERESIS for one in model.unknowns):
        said.append(
            "with hysteresis the platform rests beside its pose by as much as contacts hold; modes "
            "are those of swings that slip"
        )
    if spread > 1.0:
        said.append(
            f"residuals are {spread:.3g} sigma: standard errors are as much larger, and for "
            "correlation in time"
        )
    return tuple(said)

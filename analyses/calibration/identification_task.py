"""From logs and what is asked to a program, to what it found, and to what another log says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from cdpr_drake.analyses.calibration.identified_robots import dynamic_model, platform_size
from cdpr_drake.analyses.calibration.log_fit import refuse_late_tracker
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.arrays import Array
from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.identification.program import IdentificationProgram
from cdpr_drake.identification.regressor import inertia_regressor
from cdpr_drake.identification.result import MISFIT, MISFIT_FACTOR, IdentificationResult
from cdpr_drake.identification.samples import (
    LEAST_POSE,
    LEAST_TENSION,
    LoggedMotion,
    pose_shift,
    sample_motion,
    sample_winches,
)
from cdpr_drake.identification.smoothing import Smoother
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.time_shift import tracker_shift

UNKNOWN = ("mass", "center_of_mass", "inertia")
"""What is asked for where nothing else is said."""

USUAL_BANDWIDTH = 8.0
"""Of the smoothing, where nobody says and the log is fast enough [Hz]."""

SLOWEST_WINCH = 1.0
"""Motors that turn slower tell nothing of their friction [rad/s]."""

SLACK_SHARE = 0.01
"""Cables with less tension than this share of the weight tell nothing of their stiffness."""

WORTH_A_WORD = 2.0
"""Residuals beyond this many sigmas are worth a remark; beyond `MISFIT_FACTOR` nothing fits."""


@dataclass(frozen=True, kw_only=True, eq=False)
class IdentificationTask:
    """What is asked of a log.

    Attributes:
        robot: The robot as it is believed.
        unknown: Groups of parameters, see `identification.parameters.GROUPS`.
        common: Groups that are one for all cables or winches.
        priors: Standard deviations by group.
        bandwidth: Of the smoothing [Hz]; None: `USUAL_BANDWIDTH`, less for slow logs.
        sigma_lengths: Of lengths that winches count, and of the geometry [m].
        pulleys: Whether the cables run over the robot's pulleys.
        outliers: Whether outliers count less.
        check_clock: Whether poses that are out of sync are refused.
    """

    robot: Robot
    unknown: tuple[str, ...] = UNKNOWN
    common: tuple[str, ...] = ()
    priors: dict[str, float] = field(default_factory=dict)
    bandwidth: float | None = None
    sigma_lengths: float = 5e-5
    pulleys: bool = True
    outliers: bool = True
    check_clock: bool = True

    def cables(self) -> CableSet:
        """The cables as they are believed to run."""
        cables = self.robot.cable_set()
        return cables if self.pulleys else cables.without_pulleys()


@dataclass(frozen=True, eq=False)
class Validation:
    """How well a motion is explained that was, or was not, fitted.

    Attributes:
        log: Which.
        samples: The motion.
        predicted: Wrenches by what was found and by what was believed, shape (2, s, 6) [N m, N].
        misfit: Root mean square of what is not explained by either, by quantity with its unit.
    """

    log: Measurements
    samples: LoggedMotion
    predicted: Array
    misfit: dict[str, dict[str, float]]


@dataclass(frozen=True, eq=False)
class Identification:
    """What a log told of a robot.

    Attributes:
        task: What was asked.
        bandwidth: Of the smoothing [Hz].
        result: What was found.
        fitted: The log that was fitted.
        validated: Another one; None: none was given.
        remarks: What should be known of it, in words.
    """

    task: IdentificationTask
    bandwidth: float
    result: IdentificationResult
    fitted: Validation
    validated: Validation | None
    remarks: tuple[str, ...]


def identify(
    task: IdentificationTask,
    log: Measurements,
    validate: Measurements | None = None,
    say: Callable[[str], None] = lambda words: None,
) -> Identification:
    """Identifies a robot.

    Args:
        task: What is asked.
        log: What was measured during a motion.
        validate: The same of another motion, which is predicted and not fitted.
        say: Told what is done now.

    Raises:
        IdentificationError: A log does not hold, or does not tell, what is asked; names it.
    """
    robot = task.robot
    model = dynamic_model(robot)
    say("Smoothing the log")
    bandwidth = _usual_bandwidth(log) if task.bandwidth is None else task.bandwidth
    samples = _samples(task, log, bandwidth)
    if task.check_clock:
        _check_clock(task, log, samples)
    program = IdentificationProgram(
        model, task.unknown, common=task.common, gravity=robot.gravity_vector(),
        size=platform_size(robot),
    )  # fmt: skip
    _measure(program, task, log, samples, bandwidth)
    for name, std in task.priors.items():
        program.AddPrior(name, std)
    say("Identifying")
    found = program.Solve(task.outliers)
    _check_strain(found)
    fitted = _compared(program, task, log, samples, found, bandwidth)
    validated = None
    if validate is not None:
        say("Validating")
        other = _samples(task, validate, bandwidth)
        validated = _compared(program, task, validate, other, found, bandwidth)
    remarks = [*log.remarks, *(f"{words}; found at its bound" for words in found.active)]
    if samples.dropped:
        remarks.append(f"{samples.dropped} rows were left out as outliers of poses or tensions")
    if samples.raised:
        remarks.append(
            "the log is smoother than sensors are: its noise counts as at least "
            f"{LEAST_POSE:g} m and rad of poses, {LEAST_TENSION:g} of the largest tension"
        )
    remarks += found.remarks
    if found.spread > WORTH_A_WORD:
        remarks.append(_misfit_words(found))
    return Identification(task, bandwidth, found, fitted, validated, tuple(remarks))


def _misfit_words(found: IdentificationResult) -> str:
    """That residuals are larger than noise, and where most."""
    words = (
        f"residuals are {found.spread:.3g} times what noise says: something that was not asked "
        "for is off; "
        + (
            f"equations are weighted as if poses were off by {found.pose_error:.2g} m, and "
            "standard errors include that"
            if found.pose_error
            else "standard errors are as much larger"
        )
    )
    if found.status != MISFIT:
        return words
    most = found.largest[0]
    return (
        f"misfit: {words}. More than {MISFIT_FACTOR:g} times is no fit: poses, geometry, units, or "
        f"clocks are off; most at {most.time:.4g} s, {most.equation}, by {most.value:.3g} "
        f"{most.unit}"
    )


def _usual_bandwidth(log: Measurements) -> float:
    time = _time(log)
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    return min(USUAL_BANDWIDTH, 0.2 / step)


def _time(log: Measurements) -> Array:
    if log.time is None:
        raise IdentificationError(f"{log.path}: time: found none; accepted: a column time_s")
    return log.time


def _pose_rows(log: Measurements) -> Array:
    if log.poses is None:
        lacking = "none" if log.points is None else "x, y, z without a rotation"
        raise IdentificationError(
            f"{log.path}: poses: found {lacking}; accepted: x_m, y_m, z_m with qw, qx, qy, qz, "
            "or angles"
        )
    nothing = np.full(7, np.nan)
    return np.array([nothing if X is None else pose_row(X) for X in log.poses])


def _samples(task: IdentificationTask, log: Measurements, bandwidth: float) -> LoggedMotion:
    """A log's motion, smoothed."""
    time, rows = _time(log), _pose_rows(log)
    if log.tensions is None:
        raise IdentificationError(
            f"{log.path}: tensions: found none; accepted: columns such as C1_tension_n"
        )
    names = [cable.name for cable in task.robot.cables]
    missing = [n for n, t in zip(names, log.tensions.T, strict=True) if not np.isfinite(t).any()]
    if missing:
        raise IdentificationError(
            f"{log.path}: tensions: found none of {', '.join(missing)[:100]}; accepted: those of "
            f"all {len(names)} cables of {task.robot.name}"
        )
    try:
        return sample_motion(time, rows, log.tensions, task.cables(), bandwidth)
    except IdentificationError as problem:
        raise IdentificationError(f"{log.path}: {problem}") from problem


def _counted(task: IdentificationTask, log: Measurements) -> Array:
    """Unstrained lengths as the winches count them, shape (k, m) [m]."""
    lengths = log.wound(task.robot)
    if lengths is None:
        raise IdentificationError(
            f"{log.path}: cable lengths: found none; accepted: what winches count, in columns such "
            "as C1_length_m or C1_motor_angle_rad"
        )
    return lengths


def _measure(
    program: IdentificationProgram,
    task: IdentificationTask,
    log: Measurements,
    samples: LoggedMotion,
    bandwidth: float,
) -> None:
    """Adds what the unknowns need of a log."""
    unknown, robot, time = task.unknown, task.robot, _time(log)
    if any(group in unknown for group in UNKNOWN):
        program.AddMotion(samples)
    if any(group in unknown for group in ("stiffness", "damping")):
        counted = Smoother.over(time, bandwidth).fit(_counted(task, log), robust=False)
        slack = SLACK_SHARE * robot.platform.mass * robot.gravity
        program.AddCableLengths(
            samples, counted.at(samples.time), task.sigma_lengths, max(slack, 1e-3)
        )
    if any(group in unknown for group in ("friction", "static_friction")):
        if log.torques is None or log.tensions is None:
            raise IdentificationError(
                f"{log.path}: motor torques: found none; accepted: columns such as "
                "C1_motor_torque_nm, which friction needs"
            )
        law = robot.winch_law()
        counted_lengths = _counted(task, log)
        try:
            turning = sample_winches(
                time, counted_lengths, log.tensions, log.torques,
                ratio=law.drum.radii(len(robot.cables)), inertia=law.inertia, bandwidth=bandwidth,
                least_speed=SLOWEST_WINCH, stribeck_speed=law.friction.stribeck_speed,
            )  # fmt: skip
        except IdentificationError as problem:
            raise IdentificationError(f"{log.path}: {problem}") from problem
        program.AddWinches(turning)


def _compared(
    program: IdentificationProgram,
    task: IdentificationTask,
    log: Measurements,
    samples: LoggedMotion,
    found: IdentificationResult,
    bandwidth: float,
) -> Validation:
    """A log beside what was found and what was believed, of all that was asked for."""
    apart = IdentificationProgram(
        program.layout.model, task.unknown, common=task.common, gravity=program.gravity,
        size=program.layout.size,
    )  # fmt: skip
    _measure(apart, task, log, samples, bandwidth)
    misfit: dict[str, dict[str, float]] = {}
    vectors = {"identified": found.model.vector(), "believed": found.believed.vector()}
    for who, theta in vectors.items():
        misfit[who] = {}
        for term in apart.terms:
            misfit[who] |= term.misfit(theta)
    Y = inertia_regressor(samples.R_WP, samples.V_WP, samples.A_WP, program.gravity)
    predicted = np.array([Y @ theta[:10] for theta in vectors.values()])
    return Validation(log, samples, predicted, misfit)


def _check_strain(found: IdentificationResult) -> None:
    """Refuses cables that no tension lengthens, as lengths under load are.

    Raises:
        IdentificationError: There is one.
    """
    bad = ~(np.isfinite(found.model.stiffness) & (found.model.stiffness > 0.0))
    if np.any(bad):
        name = found.model.names[int(np.argmax(bad))]
        raise IdentificationError(
            f"stiffness of {name}: found no length that grows with its tension; accepted: lengths "
            "that winches count, which are those of the cable without load"
        )


def _check_clock(task: IdentificationTask, log: Measurements, samples: LoggedMotion) -> None:
    """Refuses poses that are out of sync with lengths or tensions.

    Raises:
        IdentificationError: They are; says by how much.
    """
    time = _time(log)
    step = float(np.median(np.diff(time)))
    if log.lengths is not None or log.angles is not None:
        rows = _pose_rows(log)
        states, cables = np.hstack([rows, np.zeros((len(rows), 6))]), task.cables().packed()
        tracked, out = np.full((len(rows), task.cables().count), np.nan), None
        for k in np.flatnonzero(np.isfinite(rows).all(axis=1)):
            out = np.empty((2, tracked.shape[1]))
            cable_motions(states[k], cables, 0.0, out)
            tracked[k] = out[0]
        found = tracker_shift(time, _counted(task, log), tracked)
        refuse_late_tracker(log, "cable lengths", found, step, IdentificationError)
    found = pose_shift(samples, task.cables(), task.robot.gravity_vector())
    refuse_late_tracker(log, "tensions", found, step, IdentificationError)

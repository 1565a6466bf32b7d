"""From logs of motions to a robot's dynamics, and to a robot file that has them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from cdpr_drake.analyses.fits.fit import fitted_robot, refuse_late_tracker
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.arrays import Array
from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.identification.parameters import DynamicModel
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
from cdpr_drake.models.cable_schema import OwnMaterial
from cdpr_drake.models.robot_dynamics import dynamic_model, platform_size
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.time_shift import tracker_shift

UNKNOWN = ("mass", "center_of_mass", "inertia")
"""Groups that are unknown by default."""

USUAL_BANDWIDTH = 8.0
"""Default bandwidth of the smoothing, if the log is fast enough [Hz]."""

SLOWEST_WINCH = 1.0
"""Motors that turn slower tell nothing of their friction [rad/s]."""

SLACK_SHARE = 0.01
"""Cables with less tension than this share of the weight tell nothing of their stiffness."""

WORTH_A_WORD = 2.0
"""Residuals beyond this many sigmas are worth a remark; beyond `MISFIT_FACTOR` nothing fits."""


@dataclass(frozen=True, kw_only=True, eq=False)
class IdentificationTask:
    """What is identified of a robot, and how.

    Attributes:
        robot: The robot as it is believed.
        unknown: Groups of parameters, see `identification.parameters.GROUPS`.
        common: Groups with one value for all cables or winches.
        priors: Standard deviations by group.
        sigma_lengths: Of lengths that winches count, and of the geometry [m].
        pulleys: True if the cables run over the robot's pulleys.
        outliers: True if outliers count less.
        check_clock: True if poses that are out of sync are refused.
    """

    robot: Robot
    unknown: tuple[str, ...] = UNKNOWN
    common: tuple[str, ...] = ()
    priors: Mapping[str, float] = field(default_factory=dict)
    sigma_lengths: float = 5e-5
    pulleys: bool = True
    outliers: bool = True
    check_clock: bool = True

    def cables(self) -> CableSet:
        """The cables as they are believed to run."""
        cables = self.robot.cable_set()
        return cables if self.pulleys else cables.without_pulleys()

    def program(self, model: DynamicModel) -> IdentificationProgram:
        """A program without measurements."""
        return IdentificationProgram(
            model, self.unknown, common=self.common, gravity=self.robot.gravity_vector(),
            size=platform_size(self.robot),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Validation:
    """How well a motion is explained, fitted or not.

    Attributes:
        log: The log of the motion.
        samples: The motion.
        predicted: Wrenches by the identified and by the believed model, shape (2, s, 6) [N m, N].
        misfit: Root mean square of what neither explains, by model and quantity with its unit.
    """

    log: Measurements
    samples: LoggedMotion
    predicted: Array
    misfit: dict[str, dict[str, float]]


@dataclass(frozen=True, eq=False)
class Identification:
    """An identification of a robot.

    Attributes:
        task: What was identified.
        bandwidth: Of the smoothing [Hz].
        result: The identified dynamics.
        fitted: The log that was fitted.
        validated: Another log; None without one.
        remarks: Sentences that a user should know.
    """

    task: IdentificationTask
    bandwidth: float
    result: IdentificationResult
    fitted: Validation
    validated: Validation | None
    remarks: tuple[str, ...]


def fit_dynamics(
    task: IdentificationTask, log: Measurements, validate: Measurements | None = None,
    say: Callable[[str], None] = lambda words: None, bandwidth: float | None = None,
) -> Identification:  # fmt: skip
    """Identifies a robot from the log of a motion.

    Args:
        task: What is identified.
        log: The log.
        validate: The log of another motion, which is predicted and not fitted.
        say: Called with a line on what is done now.
        bandwidth: Of the smoothing [Hz]; None: `USUAL_BANDWIDTH`, less for slow logs.

    Raises:
        IdentificationError: A log does not hold, or does not tell, what is unknown; names it.
    """
    model = dynamic_model(task.robot)
    say("Smoothing the log")
    if bandwidth is None:
        time = _time(log)
        step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
        bandwidth = min(USUAL_BANDWIDTH, 0.2 / step)
    motion = _Motion(task, log, bandwidth)
    if task.check_clock:
        motion.check_clock()
    program = task.program(model)
    motion.measure(program)
    for name, std in task.priors.items():
        program.AddPrior(name, std)
    say("Identifying")
    result = program.Solve(task.outliers)
    _check_strain(result)
    fitted, validated = motion.compared(program, result), None
    if validate is not None:
        say("Validating")
        validated = _Motion(task, validate, bandwidth).compared(program, result)
    remarks = [*log.remarks, *(f"{bound}; found at its bound" for bound in result.active)]
    if motion.samples.dropped:
        remarks.append(
            f"{motion.samples.dropped} rows were left out as outliers of poses or tensions"
        )
    if motion.samples.raised:
        remarks.append(
            "the log is smoother than sensors are: its noise counts as at least "
            f"{LEAST_POSE:g} m and rad of poses, {LEAST_TENSION:g} of the largest tension"
        )
    remarks += result.remarks
    if result.spread > WORTH_A_WORD:
        remarks.append(_misfit_words(result))
    return Identification(task, bandwidth, result, fitted, validated, tuple(remarks))


class _Motion:
    """A log of a motion of a robot, smoothed."""

    def __init__(self, task: IdentificationTask, log: Measurements, bandwidth: float) -> None:
        self.task, self.log, self.bandwidth = task, log, bandwidth
        self.time, self.poses = _time(log), _pose_rows(log)
        if log.tensions is None:
            raise IdentificationError(
                f"{log.path}: tensions: found none; accepted: columns such as C1_tension_n"
            )
        names = [cable.name for cable in task.robot.cables]
        missing = [
            name for name, tensions in zip(names, log.tensions.T, strict=True)
            if not np.isfinite(tensions).any()
        ]  # fmt: skip
        if missing:
            raise IdentificationError(
                f"{log.path}: tensions: found none of {', '.join(missing)[:100]}; accepted: those "
                f"of all {len(names)} cables of {task.robot.name}"
            )
        self.tensions = log.tensions
        with self._named():
            self.samples = sample_motion(
                self.time, self.poses, self.tensions, task.cables(), bandwidth
            )

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Refusals in the block begin with the log's path."""
        try:
            yield
        except IdentificationError as problem:
            raise IdentificationError(f"{self.log.path}: {problem}") from problem

    def counted(self) -> Array:
        """Unstrained lengths as the winches count them, shape (k, m) [m]."""
        lengths = self.log.wound(self.task.robot)
        if lengths is None:
            raise IdentificationError(
                f"{self.log.path}: cable lengths: found none; accepted: what winches count, in "
                "columns such as C1_length_m or C1_motor_angle_rad"
            )
        return lengths

    def measure(self, program: IdentificationProgram) -> None:
        """Adds what the unknowns need of the log."""
        task, robot, unknown = self.task, self.task.robot, set(self.task.unknown)
        if unknown & {*UNKNOWN}:
            program.AddMotion(self.samples)
        if unknown & {"stiffness", "damping"}:
            smoother = Smoother.over(self.time, self.bandwidth)
            lengths = smoother.fit(self.counted(), robust=False).at(self.samples.time)
            slack = max(SLACK_SHARE * robot.platform.mass * robot.gravity, 1e-3)
            program.AddCableLengths(self.samples, lengths, task.sigma_lengths, slack)
        if unknown & {"friction", "static_friction"}:
            if self.log.torques is None:
                raise IdentificationError(
                    f"{self.log.path}: motor torques: found none; accepted: columns such as "
                    "C1_motor_torque_nm, which friction needs"
                )
            law, lengths = robot.winch_law(), self.counted()
            with self._named():
                winches = sample_winches(
                    self.time, lengths, self.tensions, self.log.torques,
                    ratio=law.drum.radii(len(robot.cables)), inertia=law.inertia,
                    bandwidth=self.bandwidth, least_speed=SLOWEST_WINCH,
                    stribeck_speed=law.friction.stribeck_speed,
                )  # fmt: skip
            program.AddWinches(winches)

    def compared(self, program: IdentificationProgram, result: IdentificationResult) -> Validation:
        """The motion beside what was identified and what was believed."""
        apart, samples = self.task.program(program.layout.model), self.samples
        self.measure(apart)
        vectors = {"identified": result.model.vector(), "believed": result.believed.vector()}
        misfit: dict[str, dict[str, float]] = {
            who: {what: value for term in apart.terms for what, value in term.misfit(theta).items()}
            for who, theta in vectors.items()
        }
        Y = inertia_regressor(samples.R_WP, samples.V_WP, samples.A_WP, program.gravity)
        predicted = np.array([Y @ theta[:10] for theta in vectors.values()])
        return Validation(self.log, samples, predicted, misfit)

    def check_clock(self) -> None:
        """Refuses poses that are out of sync with lengths or tensions."""
        task, rows, cables = self.task, self.poses, self.task.cables()
        step = float(np.median(np.diff(self.time)))
        if self.log.lengths is not None or self.log.angles is not None:
            states, packed = np.hstack([rows, np.zeros((len(rows), 6))]), cables.packed()
            tracked = np.full((len(rows), cables.count), np.nan)
            for k in np.flatnonzero(np.isfinite(rows).all(axis=1)):
                out = np.empty((2, cables.count))
                cable_motions(states[k], packed, 0.0, out)
                tracked[k] = out[0]
            shift = tracker_shift(self.time, self.counted(), tracked)
            refuse_late_tracker(self.log, "cable lengths", shift, step, IdentificationError)
        shift = pose_shift(self.samples, cables, task.robot.gravity_vector())
        refuse_late_tracker(self.log, "tensions", shift, step, IdentificationError)


def _time(log: Measurements) -> Array:
    if log.time is None:
        raise IdentificationError(f"{log.path}: time: found none; accepted: a column time_s")
    return log.time


def _pose_rows(log: Measurements) -> Array:
    """Poses as rows, shape (k, 7); NaN where none was measured."""
    if log.poses is None:
        lacking = "none" if log.points is None else "x, y, z without a rotation"
        raise IdentificationError(
            f"{log.path}: poses: found {lacking}; accepted: x_m, y_m, z_m with qw, qx, qy, qz, "
            "or angles"
        )
    nothing = np.full(7, np.nan)
    return np.array([nothing if X is None else pose_row(X) for X in log.poses])


def _misfit_words(result: IdentificationResult) -> str:
    """That residuals are larger than noise, and where most."""
    effect = "standard errors are as much larger"
    if result.pose_error:
        effect = (
            f"equations are weighted as if poses were off by {result.pose_error:.2g} m, and "
            "standard errors include that"
        )
    line = (
        f"residuals are {result.spread:.3g} times what noise says: something that was not asked "
        f"for is off; {effect}"
    )
    if result.status != MISFIT:
        return line
    most = result.largest[0]
    return (
        f"misfit: {line}. More than {MISFIT_FACTOR:g} times is no fit: poses, geometry, units, or "
        f"clocks are off; most at {most.time:.4g} s, {most.equation}, by {most.value:.3g} "
        f"{most.unit}"
    )


def _check_strain(result: IdentificationResult) -> None:
    """Refuses cables that no tension lengthens, as lengths under load are."""
    bad = ~(np.isfinite(result.model.stiffness) & (result.model.stiffness > 0.0))
    if np.any(bad):
        name = result.model.names[int(np.argmax(bad))]
        raise IdentificationError(
            f"stiffness of {name}: found no length that grows with its tension; accepted: lengths "
            "that winches count, which are those of the cable without load"
        )


def identified_robot(robot: Robot, result: IdentificationResult) -> tuple[Robot, tuple[str, ...]]:
    """A robot with its identified dynamics, and in words what its file has no place for.

    Raises:
        IdentificationError: Friction was identified, and the file has no law of friction.
    """
    model, left = result.model, []
    platform = replace(
        robot.platform, mass=model.mass, center_of_mass=np.array(model.center_of_mass),
        inertia=np.array(model.inertia),
    )  # fmt: skip
    kinds = {name.rpartition(".")[2] for name in result.names}
    cables, winch = list(robot.cables), robot.winch
    if kinds & {"stiffness", "retardation_time"}:
        for k, (cable, material) in enumerate(zip(robot.cables, robot.materials(), strict=True)):
            own = cable.material or OwnMaterial()
            area = 0.25 * np.pi * material.diameter**2
            if "stiffness" in kinds:
                own = replace(own, youngs_modulus=float(model.stiffness[k] / area))
            if "retardation_time" in kinds:
                own = replace(own, retardation_time=float(model.retardation[k]))
            cables[k] = replace(cable, material=own)
        left.append("length offsets belong to the log; they are in results.json")
    if kinds & {"coulomb", "static"}:
        if winch.friction is None:
            raise IdentificationError(
                f"robot {robot.name}: winch.friction: found null; accepted: a section, whose "
                "stribeck_speed says over which speed static fades to Coulomb friction"
            )
        means = {
            key: float(np.mean(getattr(model, key))) for key in ("coulomb", "static", "viscous")
        }
        winch = replace(winch, friction=replace(winch.friction, **means))
        if np.ptp(model.coulomb) > 0.0 or np.ptp(model.viscous) > 0.0:
            left.append(
                "friction: the file has one law for all winches, their mean; each is in "
                "results.json"
            )
    changes = {"platform": platform, "cables": cables, "winch": winch}
    return fitted_robot(robot, "Identified", result.status, result.names, **changes), tuple(left)

"""Section `wrench_estimation` of a scenario, and its block: what pushes, by tensions and lengths.

Lengths, stretched by tensions, tell the pose (forward kinematics from the pose before), and that
and tensions the wrench, by one of `estimation.wrench_observers.OBSERVERS`, which says what each is
worth.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.errors import CableGeometryError, ForwardKinematicsError
from cdpr_drake.estimation.wrench_observer_kernel import MEMORY_SIZE
from cdpr_drake.estimation.wrench_observers import (
    MOMENTUM,
    OBSERVERS,
    ObserverResponse,
    WrenchError,
    WrenchObserver,
    observer_response,
    packed_body,
    tension_at_platform,
    tension_before_pulley,
)
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, Refusal, Scope, settings
from cdpr_drake.statics.forward_kinematics import ForwardKinematics, tautest_cables
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths
from cdpr_drake.systems.sections import Section
from cdpr_drake.systems.sensors.sensor_kinds import SensorSettings

ESTIMATED, SIGMA = "wrench_estimated", "wrench_sigma"
"""Outputs: the estimate, and the standard deviation of each of its components."""

SKIPPED = "wrench_skipped"
"""Output: how many samples so far fitted no pose, and in how many a cable had no direction."""

PARTS = ("mx_nm", "my_nm", "mz_nm", "fx_n", "fy_n", "fz_n")
"""Names of the components of a wrench in the log."""

MISFIT = 0.02
"""Lengths that fit a pose this badly [m] tell none: the pose before stays."""


@settings
class WrenchEstimation(Section):
    """An estimate of what pushes the platform beside its cables and its weight."""

    words = "An estimate of what pushes the platform, which is logged"
    columns: ClassVar = {ESTIMATED: PARTS, SIGMA: PARTS, SKIPPED: ("no_pose", "no_direction")}
    report = "cdpr_drake.sections.wrench_estimation.report:SUBJECTS"

    kind: Annotated[
        str,
        OneOf(OBSERVERS),
        "static: what balances cables and weight, which takes acceleration for a wrench; "
        "momentum: from the change of momentum; extended: a state of an observer of the "
        "motion.",
    ] = MOMENTUM
    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Samples per second."] = 200.0
    bandwidth: Annotated[
        float,
        In("Hz", gt=0.0),
        "Of the estimate, over 2 pi: it is late by a time constant, by three of kind extended.",
    ] = 2.0
    slack_below: Annotated[
        float,
        In("N", ge=0.0),
        "Cables that pull less tell nothing of the pose, while there are enough others.",
    ] = 0.5
    pulley_friction: Annotated[
        float,
        In("-", ge=0.0, le=0.5),
        "Share of a tension that pulleys take between the sensors and the platform; 0: "
        "sensors are at the platform.",
    ] = 0.0
    believed_pulley_friction: Annotated[
        float | None, In("-", ge=0.0, le=0.5), "The share that is reckoned with; null: what it is."
    ] = None
    fading_speed: Annotated[
        float, In("m/s", gt=0.0), "Cable speed below which that friction fades."
    ] = 0.001

    def believed_share(self) -> float:
        """Share of a tension that pulleys are believed to take."""
        given = self.believed_pulley_friction
        return self.pulley_friction if given is None else given

    def response(self) -> ObserverResponse:
        """How the estimate follows a wrench."""
        return observer_response(self.kind, 2.0 * np.pi * self.bandwidth, 1.0 / self.rate)

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Robots of which cables and lengths do not tell all of a wrench."""
        robot = scope.robot
        if not robot.motion_type().is_free or len(robot.cables) < 6:
            found = f"a section for {robot.name}, {robot.motion} with {len(robot.cables)} cables"
            yield "", found, "3R3T with at least 6"
        model = scope.whole.cables.model_of(robot)
        if CABLE_MODELS[model].sags:
            accepted = "cables that do not sag, whose lengths and tensions tell the pose"
            yield "", f"a section with cables.model {model}", accepted

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Adds a `WrenchEstimator`; platform and cables are as believed."""
        robot, believed = blocks.block, blocks.believed
        file = settings.perturbations.believed_robot
        base = robot.robot if file is None else load_robot(file)
        cables = believed.cables
        if not robot.forces.cable_set().has_pulleys():
            cables = cables.without_pulleys()
        if file is None:
            cables = replace(cables, stiffness=robot.forces.cable_set().stiffness)
        block = WrenchEstimator(
            self, EncoderLengths(cables, elastic=True), rigid_platform(base), believed.X_WP0,
            reading_error(settings.sensors, robot.robot, self.believed_share()),
        )  # fmt: skip
        builder.AddNamedSystem(blocks.prefix + "wrench_estimator", block)
        for port in ("measured_tensions", "measured_lengths"):
            builder.Connect(blocks.readings.port(port), block.GetInputPort(port))
        return {name: block.GetOutputPort(name) for name in self.columns}


def reading_error(sensors: SensorSettings, robot: Robot, friction: float) -> WrenchError:
    """What the readings of a robot's sensors err by.

    Args:
        sensors: The section.
        robot: The robot.
        friction: Share of a tension that pulleys before the sensors take.
    """
    noise = offset = length = 0.0
    if sensors.rate("tension") is not None:
        model = sensors.model("tension")
        noise = float(np.hypot(model.repeatability, model.resolution / np.sqrt(12.0)))
        offset = float(model.accuracy / np.sqrt(3.0))
    if sensors.rate("encoder") is not None:
        turn = 2.0 * np.pi / sensors.model("encoder").counts_per_turn
        radius = float(np.mean(robot.drum().radii(len(robot.cables))))
        length = turn * radius / np.sqrt(12.0)
    return WrenchError(noise=noise, offset=offset, friction=friction, length=length)


class WrenchEstimator(LeafSystem):
    """What pushes the platform beside its cables and its weight.

    ================= ========= ====== =======================================================
    port              type      unit   meaning
    ================= ========= ====== =======================================================
    measured_tensions vector(m) N      in
    measured_lengths  vector(m) m      in, unstrained lengths that the encoders count
    wrench_estimated  vector(6) N m, N out, moment about Po and force, in W
    wrench_sigma      vector(6) N m, N out, standard deviation of each, of what readings err by
    wrench_skipped    vector(2) -      out, samples so far without a pose, without a direction
    ================= ========= ====== =======================================================

    Samples at a rate of its own. Where lengths fit no pose, the pose before stays; where a cable
    has no direction, the estimate before. `wrench_skipped` counts both.
    """

    def __init__(
        self,
        settings: WrenchEstimation,
        counted: EncoderLengths,
        platform: RigidPlatform,
        X_WP0: RigidTransform,
        error: WrenchError,
    ) -> None:
        """For a platform that moves freely.

        Args:
            settings: The section.
            counted: The cables as they are believed to be, and whether they stretch.
            platform: The platform as it is believed to be.
            X_WP0: Pose believed at the start [m].
            error: What the readings err by.
        """
        super().__init__()
        m, self.period = counted.cables.count, 1.0 / settings.rate
        self._settings, self._counted, self._platform = settings, counted, platform
        self._kinematics = ForwardKinematics(counted.cables, platform.motion)
        body = packed_body(platform.mass, platform.p_PCo, platform.I_PPo, platform.acceleration())
        omega = 2.0 * np.pi * settings.bandwidth
        self._observer = WrenchObserver(settings.kind, body, omega, self.period)
        self._response = settings.response()
        self._error = error
        self._tensions = self.DeclareVectorInputPort("measured_tensions", m).Eval
        self._lengths = self.DeclareVectorInputPort("measured_lengths", m).Eval
        self._found = self.DeclareDiscreteState(6)
        self._sigma = self.DeclareDiscreteState(6)
        self._memory = self.DeclareDiscreteState(MEMORY_SIZE)
        self._pose = self.DeclareDiscreteState(pose_row(X_WP0))
        self._reference = self.DeclareDiscreteState(np.full(m, np.nan))
        self._before = self.DeclareDiscreteState(np.full(m, np.nan))
        self._skipped = self.DeclareDiscreteState(2)
        self.DeclarePeriodicDiscreteUpdateEvent(self.period, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)
        self.DeclareStateOutputPort(ESTIMATED, self._found)
        self.DeclareStateOutputPort(SIGMA, self._sigma)
        self.DeclareStateOutputPort(SKIPPED, self._skipped)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        def kept(index: int) -> Array:
            return np.array(context.get_discrete_state(index).value())

        X_WP, before = pose_from_row(kept(self._pose)), kept(self._before)
        readings, counts = self._tensions(context), self._lengths(context)
        rates = np.zeros(len(counts)) if np.isnan(before[0]) else (counts - before) / self.period
        tensions = self._at_platform(readings, rates)
        reference = kept(self._reference)
        if np.isnan(reference[0]):
            reference = self._counted.reference(X_WP, counts, tensions)
        skipped = kept(self._skipped)
        try:
            X_WP = self._where(X_WP, self._counted.lengths(counts, reference, tensions), tensions)
        except ForwardKinematicsError:
            skipped[0] += 1.0
        try:
            J = cable_jacobian(X_WP, self._counted.cables)
            observer = self._observer
            observer.memory[:] = kept(self._memory)
            state.set_value(self._found, observer.update(X_WP, -J.T @ tensions))
            state.set_value(self._memory, observer.memory)
            spread = self._error.covariance(
                J, tensions, self._platform.mass_matrix(X_WP), self._response,
                (counts + reference) / self._counted.cables.stiffness,
            )  # fmt: skip
            state.set_value(self._sigma, np.sqrt(np.diag(spread)))
        except CableGeometryError:
            skipped[1] += 1.0
        for index, value in (
            (self._pose, pose_row(X_WP)), (self._reference, reference), (self._before, counts),
            (self._skipped, skipped),
        ):  # fmt: skip
            state.set_value(index, value)

    def _at_platform(self, readings: Array, rates: Array) -> Array:
        """Tensions at the platform, behind the pulleys that are simulated, shape (m,) [N]."""
        settings = self._settings
        fading = settings.fading_speed
        read = tension_before_pulley(readings, rates, settings.pulley_friction, fading)
        found = tension_at_platform(read, rates, settings.believed_share(), fading)
        return np.maximum(found, 0.0)

    def _where(self, X_WP: RigidTransform, lengths: Array, tensions: Array) -> RigidTransform:
        """The pose that lengths tell, near the one before.

        Raises:
            ForwardKinematicsError: They fit none.
        """
        used = np.flatnonzero(tensions >= self._settings.slack_below)
        if len(used) < self._kinematics.num_unknowns:
            used = tautest_cables(tensions, self._kinematics.num_unknowns)
        return self._kinematics.pose(lengths, X_WP, used, MISFIT).X_WP

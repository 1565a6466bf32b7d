"""The schema of a scenario file for dynamic control by cable tensions.

`TensionScenario` is the file; its sections stand before it.
"""

from pathlib import Path
from typing import Annotated

import numpy as np

from cdpr_drake.control.force_balance import BALANCES, WRENCH
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_schema import Pose, Robot
from cdpr_drake.numerics.explicit_integration import explicit_integrators
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, Switch, Text, filled, settings
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import AUTOMATIC, COMPILED, ENGINES, DampingSettings
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL
from cdpr_drake.systems.scenarios.run_settings import ScenarioHeader
from cdpr_drake.systems.sections import with_sections
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.trajectories.sampled_motion import read_motion


@settings
class Stretch:
    """One stretch of the trajectory, from rest to rest."""

    pose: Annotated[Pose, "Pose of the platform in W at its end."]
    duration: Annotated[float, In("s", gt=0.0), "Time that it takes."]


@settings
class TrajectorySettings:
    """Poses that the platform passes, at rest in each, quintic time law in between; or a file."""

    start: Annotated[Pose | None, "Pose of the platform in W at time 0."] = None
    pause: Annotated[float, In("s", ge=0.0), "Rest before the motion."] = 0.0
    stretches: Annotated[list[Stretch], "The stretches, one after the other."] = filled(list)
    file: Annotated[
        Text | None,
        "Table of a motion in the place of start and stretches, as motion.csv of cdpr "
        "plan; null: none.",
    ] = None

    def trajectory(self) -> PoseTrajectory:
        """The trajectory.

        Raises:
            TrajectoryError: The file is none of a motion; names file and line.
        """
        if self.file is not None:
            return read_motion(Path(self.file), self.pause)
        assert self.start is not None
        poses = (self.start.transform(), *(s.pose.transform() for s in self.stretches))
        return PoseTrajectory(poses, tuple(s.duration for s in self.stretches), self.pause)


@settings
class TorqueSettings:
    """The computed torque in task space."""

    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Control steps per second."] = 1000.0
    stiffness: Annotated[float, In("1/s^2", ge=0.0), "Gain Kp."]
    damping: Annotated[float, In("1/s", ge=0.0), "Gain Kd."]
    balance: Annotated[
        str,
        OneOf(BALANCES),
        "What tensions balance: the wrench; or its force alone, as on a point mass, so "
        "that moments are not held and the platform turns as it will.",
    ] = WRENCH

    def gains(self) -> TaskGains:
        """The gains."""
        return TaskGains(self.stiffness, self.damping)


@settings
class DrivenCableSettings:
    """The simulated cables: massless, inextensible, with tensions as commanded."""

    pulleys: Annotated[Switch, "Whether the cables run over the robot's pulleys."] = False


@settings
class DistributionSettings:
    """The tension distribution."""

    method: Annotated[str, OneOf(METHODS), "Method."] = "quadratic_program"
    limits: Annotated[
        np.ndarray | None, In("N", 2, ge=0.0), "Smallest and largest tension; null: the robot's."
    ] = None
    reference: Annotated[
        float | None, In("N", ge=0.0), "Wanted tension of all cables, for reference_program."
    ] = None
    pulleys: Annotated[Switch, "Whether it reckons with the pulleys, where there are any."] = True


@settings
class StepSettings:
    """How the robot is integrated."""

    engine: Annotated[
        str,
        OneOf(ENGINES),
        "What moves the robot: Drake's MultibodyPlant, or compiled steps from event to "
        "event; automatic: the plant, but for repeated runs and those of more than ten "
        "minutes.",
    ] = AUTOMATIC
    integrator: Annotated[
        str, OneOf(explicit_integrators()), "Explicit integrator of Drake, fixed step."
    ] = "runge_kutta3"
    max_step: Annotated[float, In("s", gt=0.0), "Step."] = 0.001


@settings
class TensionBelief:
    """What the controller believes wrongly; the simulated robot stays as its file says."""

    believed_robot: Annotated[
        Text | None,
        "Robot by name, or path of a robot file, whose platform and cables computed "
        "torque and tension distribution believe in, such as what cdpr identify wrote; "
        "null: the robot that is simulated.",
    ] = None


@settings
class TensionStop:
    """When the run ends before its duration is over."""

    contact: Annotated[
        Switch, "Whether the run ends when the platform touches something of the world."
    ] = False


@settings
@with_sections("tension_control")
class TensionScenario(ScenarioHeader):
    """One run of a robot that follows a trajectory by commanded tensions."""

    kind: Annotated[str, OneOf((TENSION_CONTROL,)), "Kind of run."]
    cables: Annotated[DrivenCableSettings, "The simulated cables."] = filled(DrivenCableSettings)
    damping: Annotated[
        DampingSettings,
        "Damping of the simulated platform, which the controller knows unless it believes"
        " in another robot.",
    ] = filled(DampingSettings)
    trajectory: Annotated[TrajectorySettings, "Desired motion."]
    controller: Annotated[TorqueSettings, "Computed torque."]
    distribution: Annotated[DistributionSettings, "Tension distribution."] = filled(
        DistributionSettings
    )
    integration: Annotated[StepSettings, "Integration."] = filled(StepSettings)
    perturbations: Annotated[TensionBelief, "What the controller believes wrongly."] = filled(
        TensionBelief
    )
    stop: Annotated[TensionStop, "When the run ends early."] = filled(TensionStop)
    log_rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Rows of the log per second."] = 100.0

    def step_rule(self) -> StepRule | None:
        """How the robot is integrated in compiled steps; None by the engine plant."""
        integration = self.integration
        if integration.engine != COMPILED:
            return None
        return StepRule(method=integration.integrator, max_step=integration.max_step)

    def limits(self) -> tuple[float, float] | None:
        """Smallest and largest tension [N]; None: the robot's."""
        given = self.distribution.limits
        return None if given is None else (float(given[0]), float(given[1]))

    def reference_tensions(self, robot: Robot) -> np.ndarray | None:
        """Wanted tensions, shape (m,) [N], or None."""
        one = self.distribution.reference
        return None if one is None else np.full(len(robot.cables), one)

    def cable_set(self, robot: Robot) -> CableSet:
        """The simulated cables."""
        cables = robot.cable_set()
        return cables if self.cables.pulleys else cables.without_pulleys()

    def believed_cables(self, robot: Robot) -> CableSet:
        """What the tension distribution believes of them."""
        cables = self.cable_set(robot)
        return cables if self.distribution.pulleys else cables.without_pulleys()

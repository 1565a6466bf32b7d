"""The schema of a scenario file for dynamic control by cable tensions.

`TensionScenario` is the file; its sections stand before it. Section `predictive` asks for tensions
by a program over the time ahead.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_drake.control.force_balance import BALANCES, WRENCH
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_schema import Pose, Robot
from cdpr_drake.numerics.explicit_integration import explicit_integrators
from cdpr_drake.planning.horizon import View
from cdpr_drake.schema.fields import (
    FASTEST,
    array,
    number,
    optional_section,
    section,
    sections,
    switch,
    text,
    whole,
)
from cdpr_drake.systems.controllers.force_tracking import ForceControl
from cdpr_drake.systems.remote.settings import RemoteSettings
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.disturbances import DisturbanceSettings
from cdpr_drake.systems.robots.settings import AUTOMATIC, COMPILED, ENGINES, DampingSettings
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL
from cdpr_drake.systems.scenarios.run_settings import ScenarioHeader
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.trajectories.sampled_motion import read_motion


@dataclass(kw_only=True)
class Stretch:
    """One stretch of the trajectory, from rest to rest."""

    pose: Pose = section("Pose of the platform in W at its end.", Pose)
    duration: float = number("Time that it takes.", "s", above=0.0)


@dataclass(kw_only=True)
class TrajectorySettings:
    """Poses that the platform passes, at rest in each, quintic time law in between; or a file."""

    start: Pose | None = optional_section("Pose of the platform in W at time 0.")
    pause: float = number("Rest before the motion.", "s", 0.0, at_least=0.0)
    stretches: list[Stretch] = sections("The stretches, one after the other.", required=False)
    file: str | None = text(
        "Table of a motion in the place of start and stretches, as motion.csv of cdpr plan; null: "
        "none.",
        None,
    )

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


@dataclass(kw_only=True)
class TorqueSettings:
    """The computed torque in task space."""

    rate: float = number("Control steps per second.", "Hz", 1000.0, above=0.0, at_most=FASTEST)
    stiffness: float = number("Gain Kp.", "1/s^2", at_least=0.0)
    damping: float = number("Gain Kd.", "1/s", at_least=0.0)
    balance: str = text(
        "What tensions balance: the wrench; or its force alone, as on a point mass, so that "
        "moments are not held and the platform turns as it will.",
        WRENCH,
        choices=BALANCES,
    )

    def gains(self) -> TaskGains:
        """The gains."""
        return TaskGains(self.stiffness, self.damping)


@dataclass(kw_only=True)
class DrivenCableSettings:
    """The simulated cables: massless, inextensible, with tensions as commanded."""

    pulleys: bool = switch("Whether the cables run over the robot's pulleys.", False)


@dataclass(kw_only=True)
class DistributionSettings:
    """The tension distribution."""

    method: str = text("Method.", "quadratic_program", choices=METHODS)
    limits: np.ndarray | None = array(
        "Smallest and largest tension; null: the robot's.", "N", (2,), None, at_least=0.0
    )
    reference: float | None = number(
        "Wanted tension of all cables, for reference_program.", "N", None, at_least=0.0
    )
    pulleys: bool = switch("Whether it reckons with the pulleys, where there are any.", True)


@dataclass(kw_only=True)
class PredictiveSettings:
    """Predictive control in the place of computed torque, at the rate of `controller`.

    Its program takes a millisecond or more: rates of 50 to 200 Hz are usual.
    """

    steps: int = whole("Steps of control that it looks ahead.", 10, at_least=2, at_most=100)
    mount: str | None = text(
        "Mounting on the platform of the camera that keeps `points` in view; null: none.", None
    )
    points: np.ndarray | None = array("Points in W that stay in view.", "m", (None, 3), None)

    def view(self, robot: Robot) -> View | None:
        """What is kept in view.

        Raises:
            ScenarioError: The robot has no such camera on its platform, or one of mount and points
                is missing.
        """
        if (self.mount is None) != (self.points is None):
            missing = "mount" if self.mount is None else "points"
            raise ScenarioError(f"predictive.{missing}: found null; accepted: both, or neither")
        if self.mount is None or self.points is None:
            return None
        known = [mount for mount in robot.cameras if mount.parent == "platform"]
        found = [mount for mount in known if mount.name == self.mount]
        if not found:
            names = ", ".join(mount.name for mount in known) or "none on its platform"
            raise ScenarioError(
                f"predictive.mount: found {self.mount!r}; accepted for {robot.name}: {names}"
            )
        slopes = load_camera(found[0].model).view_slopes()
        return View(found[0].pose.transform(), slopes, self.points.T)


@dataclass(kw_only=True)
class StepSettings:
    """How the robot is integrated."""

    engine: str = text(
        "What moves the robot: Drake's MultibodyPlant, or compiled steps from event to event; "
        "automatic: the plant, but for repeated runs and those of more than ten minutes.",
        AUTOMATIC,
        choices=ENGINES,
    )
    integrator: str = text(
        "Explicit integrator of Drake, fixed step.", "runge_kutta3", choices=explicit_integrators()
    )
    max_step: float = number("Step.", "s", 1e-3, above=0.0)


@dataclass(kw_only=True)
class TensionBelief:
    """What the controller believes wrongly; the simulated robot stays as its file says."""

    believed_robot: str | None = text(
        "Robot by name, or path of a robot file, whose platform and cables computed torque and "
        "tension distribution believe in, such as what cdpr identify wrote; null: the robot that "
        "is simulated.",
        None,
    )


@dataclass(kw_only=True)
class TensionStop:
    """When the run ends before its duration is over."""

    contact: bool = switch(
        "Whether the run ends when the platform touches something of the world.", False
    )


@dataclass(kw_only=True)
class TensionScenario(ScenarioHeader):
    """One run of a robot that follows a trajectory by commanded tensions."""

    kind: str = text("Kind of run.", choices=(TENSION_CONTROL,))
    cables: DrivenCableSettings = section(
        "The simulated cables.", DrivenCableSettings, required=False
    )
    damping: DampingSettings = section(
        "Damping of the simulated platform, which the controller knows unless it believes in "
        "another robot.",
        DampingSettings, required=False,
    )  # fmt: skip
    trajectory: TrajectorySettings = section("Desired motion.", TrajectorySettings)
    controller: TorqueSettings = section("Computed torque.", TorqueSettings)
    distribution: DistributionSettings = section(
        "Tension distribution.", DistributionSettings, required=False
    )
    predictive: PredictiveSettings | None = optional_section(
        "Tensions by a program over the time ahead, in the place of computed torque; null: none."
    )
    force_control: ForceControl | None = optional_section(
        "How the platform answers forces, by the engine plant; null: as computed torque does."
    )
    disturbances: DisturbanceSettings | None = optional_section(
        "What pushes the platform, by the engine plant; null: nothing."
    )
    integration: StepSettings = section("Integration.", StepSettings, required=False)
    perturbations: TensionBelief = section(
        "What the controller believes wrongly.", TensionBelief, required=False
    )
    remote: RemoteSettings | None = optional_section(
        "A process outside in the place of a block, see cdpr serve; null: none."
    )
    stop: TensionStop = section("When the run ends early.", TensionStop, required=False)
    log_rate: float = number("Rows of the log per second.", "Hz", 100.0, above=0.0, at_most=FASTEST)

    @property
    def plant_alone(self) -> bool:
        """Whether the engine plant alone can run it."""
        return self.force_control is not None or self.disturbances is not None

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

"""How a robot is simulated: its cables, winches and damping, sections of a scenario.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass, replace

import numpy as np
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.cables.cable_behaviour import behaving_cables
from cdpr_drake.cables.models import CABLE_MODELS, KELVIN_VOIGT
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.fields import number, optional_section, section, switch, text
from cdpr_drake.systems.robots.disturbances import Disturbances, DisturbanceSettings
from cdpr_drake.systems.robots.failures import Failures, FailureSettings
from cdpr_drake.systems.robots.motor_winch import COMMAND_PORTS


@dataclass(kw_only=True)
class CableSettings:
    """Which cables a simulated robot has; their values stand in the robot's file.

    Inextensible cables are not among the models: with more cables than degrees of freedom their
    tensions are not determined. Stiff Kelvin-Voigt cables are what comes nearest.
    """

    model: str = text(
        "How a cable answers to its length.",
        KELVIN_VOIGT,
        choices=tuple(name for name, model in CABLE_MODELS.items() if model.extensible),
    )
    pulleys: bool = switch("Whether the cables run over the robot's pulleys.", False)

    stiffness_ratio: float = number(
        "Stiffness of the simulated cables per that of the robot's file. Ropes, what holds pulleys "
        "and sensors, and the platform give more than the modulus of a fibre says.",
        "-",
        1.0,
        above=0.0,
    )

    retardation_time: float | None = number(
        "Viscous damping of the simulated cables, over their stiffness; null: the robot file's.",
        "s",
        None,
        at_least=0.0,
    )

    def geometry_words(self, robot: Robot, believed: bool | None = None) -> str:
        """Geometry of a run in words, as every result names it, see `Robot.geometry_words`.

        Args:
            robot: The robot.
            believed: Whether the controller's model has the robot's pulleys; None: as the
                simulated cables.
        """
        words = robot.geometry_words(self.pulleys)
        if believed is None or robot.geometry_words(believed) == words:
            return words
        return f"{words}; in the controller's model {robot.geometry_words(believed)}"

    def cable_set(self, robot: Robot) -> CableSet:
        """The cables of a robot, over its pulleys or from fixed exit points.

        With what its file says of them beside the elastic law, see `cables.cable_behaviour`.
        """
        return self.applied(behaving_cables(robot.cable_set(), robot.cable_behaviour()))

    def applied(self, cables: CableSet) -> CableSet:
        """Cables as these settings want them."""
        if self.stiffness_ratio != 1.0:
            cables = replace(cables, stiffness=self.stiffness_ratio * cables.stiffness)
        if self.retardation_time is not None:
            cables = replace(cables, retardation=np.full(cables.count, self.retardation_time))
        return cables if self.pulleys else cables.without_pulleys()


AUTOMATIC, PLANT, COMPILED = "automatic", "plant", "compiled"
ENGINES = (AUTOMATIC, PLANT, COMPILED)
"""What moves a simulated robot: Drake's MultibodyPlant, or `CompiledMotion`."""

IDEAL, MOTOR = "ideal", "motor"


@dataclass(kw_only=True)
class WinchSettings:
    """Which winches a simulated robot has; their values stand in the robot's file."""

    kind: str = text(
        "ideal follows commanded velocities at once; motor has inertia, friction and limits.",
        IDEAL,
        choices=(IDEAL, MOTOR),
    )
    mode: str = text(
        "What the winches are commanded; ideal ones take velocity only. By position, a visual "
        "servo's velocities are integrated from the lengths at the start.",
        "velocity",
        choices=tuple(COMMAND_PORTS),
    )

    def has_motors(self) -> bool:
        """Whether the winches have motors."""
        return self.kind == MOTOR


@dataclass(kw_only=True)
class DampingSettings:
    """Viscous damping of the platform's motion about Po: air, and friction at pulleys and joints.

    A platform that hangs on fewer cables than it has degrees of freedom swings, and nothing in
    the cables damps that.
    """

    translation: float = number("Force per velocity of Po.", "N s/m", 0.0, at_least=0.0)
    rotation: float = number("Moment per angular velocity.", "N m s/rad", 0.0, at_least=0.0)

    def is_there(self) -> bool:
        """Whether there is any damping."""
        return self.translation > 0.0 or self.rotation > 0.0

    def block(self, in_plant: RobotInPlant) -> MatrixGain:
        """Generalized forces on the plant, shape (nv,), from the platform's state."""
        plant = in_plant.plant
        joint = in_plant.robot.joint()
        t, r = self.translation, self.rotation
        damping = np.array([r, r, r, t, t, t] if joint.is_floating else [t, t, r])
        damping = damping[: joint.num_velocities]
        D = np.zeros((plant.num_velocities(), plant.num_multibody_states(in_plant.model_instance)))
        for k, value in enumerate(damping):
            D[in_plant.first_velocity() + k, D.shape[1] - len(damping) + k] = -value
        return MatrixGain(D)


@dataclass(kw_only=True)
class CableRobotSettings:
    """How a robot is simulated beside what its file says."""

    cables: CableSettings = section("The simulated cables.", CableSettings, required=False)
    winches: WinchSettings = section("The winches.", WinchSettings, required=False)
    damping: DampingSettings = section(
        "What brakes the platform beside its cables.", DampingSettings, required=False
    )
    disturbances: DisturbanceSettings | None = optional_section(
        "What pushes the platform beside its cables; null: nothing."
    )
    failures: FailureSettings | None = optional_section(
        "What fails: cables that break, winches; null: nothing."
    )

    def disturbance_block(self, robot: Robot) -> Disturbances | None:
        """The block of `disturbances`, by the seed of the scenario that these settings are, or 0;
        None without.

        Raises:
            ScenarioError: They are not accepted; names it.
        """
        if self.disturbances is None:
            return None
        seed = int(getattr(self, "seed", 0))
        return Disturbances(self.disturbances, robot.gravity_vector(), seed=seed)

    def failure_block(self, robot: Robot) -> Failures | None:
        """The block of `failures`; None without, and nothing can fail."""
        if self.failures is None:
            return None
        return Failures(self.failures, len(robot.cables), robot.winch_groups().count)

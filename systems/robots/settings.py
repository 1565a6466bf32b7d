"""How a robot is simulated: its cables, winches and damping, sections of a scenario."""

from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.cables.cable_behaviour import behaving_cables
from cdpr_drake.cables.models import CABLE_MODELS, KELVIN_VOIGT
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import In, OneOf, Switch, filled, settings
from cdpr_drake.systems.robots.failures import Failures, FailureSettings
from cdpr_drake.systems.robots.motor_winch import COMMAND_PORTS


@settings
class CableSettings:
    """Which cables a simulated robot has; their values stand in the robot's file.

    Inextensible cables are not among the models: with more cables than degrees of freedom their
    tensions are not determined. Stiff Kelvin-Voigt cables are what comes nearest.
    """

    model: Annotated[
        str | None,
        OneOf(tuple(name for name, model in CABLE_MODELS.items() if model.extensible)),
        "How a cable answers to its length. Default: the robot file's `cable_model`, or "
        f"{KELVIN_VOIGT} where it gives none.",
    ] = None
    pulleys: Annotated[Switch, "Whether the cables run over the robot's pulleys."] = False

    stiffness_ratio: Annotated[
        float,
        In("-", gt=0.0),
        "Stiffness of the simulated cables per that of the robot's file. Ropes, what "
        "holds pulleys and sensors, and the platform give more than the modulus of a "
        "fibre says.",
    ] = 1.0

    retardation_time: Annotated[
        float | None,
        In("s", ge=0.0),
        "Viscous damping of the simulated cables, over their stiffness; null: the robot file's.",
    ] = None

    def model_of(self, robot: Robot | None = None) -> str:
        """Name of the simulated cables' model: these settings', or that of the robot's file.

        Args:
            robot: The robot; None for cables between bodies of a plant, which have no robot file.
        """
        return self.model or (robot and robot.cable_model) or KELVIN_VOIGT

    def geometry_words(self, robot: Robot, believed: bool | None = None) -> str:
        """Geometry of a run in words, as every result names it, see `Robot.geometry_words`.

        Args:
            robot: The robot.
            believed: Whether the controller's model has the robot's pulleys; None: as the
                simulated cables.
        """
        words = robot.geometry_words(self.pulleys)
        if believed in (None, self.pulleys) or robot.geometry_words(believed) == words:
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


@settings
class WinchSettings:
    """Which winches a simulated robot has; their values stand in the robot's file."""

    kind: Annotated[
        str,
        OneOf((IDEAL, MOTOR)),
        "ideal follows commanded velocities at once; motor has inertia, friction and limits.",
    ] = IDEAL
    mode: Annotated[
        str,
        OneOf(COMMAND_PORTS),
        "What the winches are commanded; ideal ones take velocity only. By position, a "
        "visual servo's velocities are integrated from the lengths at the start.",
    ] = "velocity"

    def has_motors(self) -> bool:
        """Whether the winches have motors."""
        return self.kind == MOTOR


@settings
class DampingSettings:
    """Viscous damping of the platform's motion about Po: air, and friction at pulleys and joints.

    A platform that hangs on fewer cables than it has degrees of freedom swings, and nothing in
    the cables damps that. What is not given here, the robot's file says.
    """

    translation: Annotated[
        float | None, In("N s/m", ge=0.0), "Force per velocity of Po. Default: the robot file's."
    ] = None
    rotation: Annotated[
        float | None,
        In("N m s/rad", ge=0.0),
        "Moment per angular velocity. Default: the robot file's.",
    ] = None

    def of(self, robot: Robot) -> tuple[float, float]:
        """Damping of a robot's simulated platform [N s/m, N m s/rad]."""
        t, r, own = self.translation, self.rotation, robot.damping
        return own.translation if t is None else t, own.rotation if r is None else r

    def block(self, in_plant: RobotInPlant) -> MatrixGain | None:
        """Generalized forces on the plant, shape (nv,), from the platform's state; None without
        damping."""
        plant = in_plant.plant
        joint = in_plant.robot.joint()
        t, r = self.of(in_plant.robot)
        if t == r == 0.0:
            return None
        damping = np.array([r, r, r, t, t, t] if joint.is_floating else [t, t, r])
        damping = damping[: joint.num_velocities]
        D = np.zeros((plant.num_velocities(), plant.num_multibody_states(in_plant.model_instance)))
        for k, value in enumerate(damping):
            D[in_plant.first_velocity() + k, D.shape[1] - len(damping) + k] = -value
        return MatrixGain(D)


def simulated_model(
    robot: Robot, cables: CableSettings | None, damping: DampingSettings
) -> dict[str, Any]:
    """What a robot is simulated as, for the summary of a run.

    Args:
        robot: The robot.
        cables: Settings of its cables; None: they have commanded tensions, and no model.
        damping: Settings of its damping.

    Returns:
        cable_model, pulleys, damping_n_s_per_m, damping_n_m_s_per_rad; and overrides: settings that
        differ from what the robot's file says, in words.
    """
    t, r = damping.of(robot)
    told: dict[str, Any] = {"damping_n_s_per_m": t, "damping_n_m_s_per_rad": r}
    pairs: list[tuple[str, Any, Any]] = [
        ("damping.translation", t, robot.damping.translation),
        ("damping.rotation", r, robot.damping.rotation),
    ]
    if cables is not None:
        model = cables.model_of(robot)
        pulleys = cables.pulleys and robot.cable_set().has_pulleys()
        told |= {"cable_model": model, "pulleys": pulleys}
        if robot.cable_model is not None:
            pairs.insert(0, ("cables.model", model, robot.cable_model))
        if cables.stiffness_ratio != 1.0:
            pairs.append(("cables.stiffness_ratio", cables.stiffness_ratio, 1))
        if cables.retardation_time is not None:
            own = robot.cable.retardation_time
            pairs.append(("cables.retardation_time", cables.retardation_time, own))
    told["overrides"] = [
        f"{key} {_plain(value)}, not {_plain(own)}" for key, value, own in pairs if value != own
    ]
    return told


def model_words(told: dict[str, Any]) -> str:
    """What `simulated_model` tells, in one line."""
    words = []
    if "cable_model" in told:
        where = "over pulleys" if told["pulleys"] else "from fixed exit points"
        words.append(f"{told['cable_model']} cables {where}")
    t, r = told["damping_n_s_per_m"], told["damping_n_m_s_per_rad"]
    words.append(f"damping {t:g} N s/m, {r:g} N m s/rad" if t or r else "platform undamped")
    if told["overrides"]:
        words.append(f"overrides the robot file: {'; '.join(told['overrides'])}")
    return ", ".join(words)


def _plain(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:g}"


@settings
class CableRobotSettings:
    """How a robot is simulated beside what its file says."""

    cables: Annotated[CableSettings, "The simulated cables."] = filled(CableSettings)
    winches: Annotated[WinchSettings, "The winches."] = filled(WinchSettings)
    damping: Annotated[DampingSettings, "Additional damping of the platform."] = filled(
        DampingSettings
    )
    failures: Annotated[
        FailureSettings | None, "What fails: cables that break, winches; null: nothing."
    ] = None

    def failure_block(self, robot: Robot) -> Failures | None:
        """The block of `failures`; None without, and nothing can fail."""
        if self.failures is None:
            return None
        return Failures(self.failures, len(robot.cables), robot.winch_groups().count)

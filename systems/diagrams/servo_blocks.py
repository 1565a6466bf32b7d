"""Adds a visual servo to a cable robot in somebody's builder."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import Adder, ConstantVectorSource, Integrator

from cdpr_drake.arrays import Array
from cdpr_drake.features import seen_pose_error
from cdpr_drake.models import Robot, load_camera
from cdpr_drake.servoing import BelievedRobot, CameraMounting
from cdpr_drake.systems.cameras import TargetMeasurement
from cdpr_drake.systems.diagrams.beliefs import believed_robot, winch_offsets
from cdpr_drake.systems.diagrams.camera import add_camera, add_target
from cdpr_drake.systems.diagrams.controller import make_controller
from cdpr_drake.systems.diagrams.estimators import EstimatorInputs, add_estimator
from cdpr_drake.systems.diagrams.tension_management import add_tension_corrector
from cdpr_drake.systems.diagrams.torque_control import (
    add_torque_controller,
    connect_torque_controller,
)
from cdpr_drake.systems.estimators import EstimatorSettings, EstimatorTask
from cdpr_drake.systems.robots import RobotBlock
from cdpr_drake.systems.scenarios import VisualServoSettings
from cdpr_drake.systems.sensors import SensorReadings
from cdpr_drake.systems.servos import FeatureServo, OpenLoopServo, PlannedPoseServo, open_loop_plan
from cdpr_drake.systems.tension_control import TensionCorrector, TorqueController
from cdpr_drake.trajectories import MovingPose, PoseTrajectory
from cdpr_drake.vision import Pinhole, Target


@dataclass(frozen=True, kw_only=True)
class VisualServoBlocks:
    """The blocks of a visual servo in a builder, and where camera and target truly are.

    Attributes:
        block: The robot that it moves.
        believed: That robot as it is believed to be.
        target: What the camera looks at.
        motion: How the target moves in its carrier.
        mounting: Where camera and target truly are.
        pinhole: The camera's intrinsic parameters.
        X_CdO: Desired pose of the target in the camera, that of the last task [m].
        begins: Time at which the last task takes over [s].
        measurement: The camera, with the ports of `TargetMeasurement`.
        servo: The servo.
        plan: The platform's motion, if that is planned without looking.
        estimator: The estimator that the servo listens to.
        compared: Estimators that run beside it.
        readings: The sensors.
        wanted_lengths: Integrates cable velocities for winches that are commanded by position;
            None for others.
        corrector: Takes up slack; None unless asked for.
        torque: Makes torques of the servo's twist; None unless winches are commanded by torque.
    """

    block: RobotBlock
    believed: BelievedRobot
    target: Target
    motion: MovingPose
    mounting: CameraMounting
    pinhole: Pinhole
    X_CdO: RigidTransform
    begins: float
    measurement: TargetMeasurement
    servo: FeatureServo
    plan: PoseTrajectory | None
    estimator: System
    compared: tuple[System, ...]
    readings: SensorReadings
    wanted_lengths: Integrator | None
    corrector: TensionCorrector | None = None
    torque: TorqueController | None = None

    @property
    def robot(self) -> Robot:
        """The robot's data."""
        return self.block.robot

    @property
    def X_PC(self) -> RigidTransform:
        """True camera on the platform, for eye in hand [m]."""
        return self.mounting.X_BC

    @property
    def X_WO(self) -> RigidTransform:
        """Object in W at time 0, for eye in hand [m]."""
        return self.motion.at(0.0)

    @property
    def free_rotation(self) -> bool:
        """Whether the rotation about the optical axis is left free."""
        return self.servo.controller.tasks[-1].features.rank < 6

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Names of the features, with their units."""
        return self.servo.controller.tasks[-1].features.names

    def X_CO(self, X_WP: RigidTransform, time: float) -> RigidTransform:
        """True pose of the object in the camera for a pose of the platform at a time [s]."""
        return self.mounting.X_CO(X_WP, self.motion.at(time))

    def desired_platform_pose(self, time: float = 0.0) -> RigidTransform:
        """Pose X_WP from which the object is seen as desired at a time [s]."""
        return self.mounting.X_WP(self.X_CdO, self.motion.at(time))

    def seen_error(self, X_WP: RigidTransform, time: float) -> tuple[float, float]:
        """True distance [m] and angle [rad] of the object in the camera from its desired pose."""
        return seen_pose_error(self.X_CO(X_WP, time), self.X_CdO, self.free_rotation)

    def take_lengths(self, context: Context, lengths: Array) -> None:
        """Starts what integrates wanted lengths at lengths, shape (m,) [m], in the root context."""
        if self.wanted_lengths is not None:
            integrator = self.wanted_lengths.GetMyMutableContextFromRoot(context)
            self.wanted_lengths.set_integral_value(integrator, lengths)


def add_visual_servo(
    builder: DiagramBuilder,
    robot: RobotBlock,
    settings: VisualServoSettings,
    *,
    X_WO: OutputPort | None = None,
    name: str = "",
) -> VisualServoBlocks:
    """Adds camera, servo, estimator and sensors to a robot, and lets the servo command its winches.

    Args:
        builder: The builder that has the robot.
        robot: A `CableRobot`, a `CompiledCableRobot`, or what `add_cable_robot` returned.
        settings: The servo; a scenario is one, too.
        X_WO: Pose of the target in the world [m]. None: the robot's port of that name, or a target
            that is added here. One on the platform is drawn only by a `CableRobot`.
        name: Put before the names of the blocks, so that several servos can be told apart.

    Returns:
        Handles.

    Raises:
        RenderingError: The camera is rendered and EGL is missing.
        VisualFeatureError: The target does not have what the scheme needs.
    """
    prefix = f"{name}_" if name else ""
    mount = robot.robot.camera_mount(settings.camera.mount)
    pinhole = load_camera(mount.model).pinhole(settings.camera.width, settings.camera.height)
    target, motion = settings.target.target(), settings.target.path()
    on_platform = settings.target.carrier == "platform"
    mounting = CameraMounting(mount.pose.transform(), motion.at(0.0) if on_platform else None)
    last_task = settings.tasks()[-1]
    X_CdO = last_task.desired.transform()
    if X_WO is None and not on_platform:
        if robot.HasOutputPort("X_WO"):
            X_WO = robot.GetOutputPort("X_WO")
        elif robot.scene_graph is not None:
            X_WO = add_target(builder, robot.scene_graph, settings.target, name=prefix + "target")
    measurement = add_camera(
        builder,
        robot,
        settings.camera,
        target=target,
        mounting=mounting,
        pinhole=pinhole,
        X_WO=X_WO,
        seed=settings.seed,
        image_bias=settings.perturbations.image_bias,
        name=name,
    )
    believed = believed_robot(settings, robot.robot)
    controller = make_controller(settings, believed, target)
    plan = open_loop_plan(settings.open_loop, believed, mounting.X_WP(X_CdO, motion.at(0.0)))
    rate = settings.controller.rate
    servo = FeatureServo(controller, target, pinhole, rate)
    if plan is not None:
        servo = OpenLoopServo(controller, target, pinhole, rate, plan)
    elif settings.pose_plan is not None:
        goals = [task.desired.transform() for task in settings.tasks()]
        way = settings.pose_plan.plan()
        servo = PlannedPoseServo(controller, target, pinhole, rate, way, goals)
    builder.AddNamedSystem(prefix + "servo", servo)
    task = EstimatorTask(
        robot=believed,
        X_WP0=settings.initial_pose.transform(),
        target=target,
        target_rests=settings.target_rests(),
        pinhole=pinhole,
        rate=rate,
        known_tag=settings.estimator.known_tag,
        fusion=settings.estimator.fusion,
        platform_tag=_platform_tag(settings, robot.robot),
    )
    readings = SensorReadings(builder, robot, settings.sensors, seed=settings.seed, name=name)
    ports = {port: measurement.GetOutputPort(port) for port in ("X_CO", "found")}
    ports["platform_velocity"] = servo.GetOutputPort("platform_velocity")
    torque = add_torque_controller(
        builder, settings, robot, believed=believed, name=prefix + "torque_controller"
    )
    if torque is not None:  # what the platform does then is not what it was asked for
        ports["platform_velocity"] = torque.GetOutputPort("platform_twist")
    inputs = EstimatorInputs(
        builder, robot, settings, pinhole=pinhole, readings=readings, ports=ports, name=name
    )
    estimator, *compared = _add_estimators(builder, settings.estimator, task, inputs, prefix)
    for port in ("X_CO", "found", target.mark):
        builder.Connect(measurement.GetOutputPort(port), servo.GetInputPort(port))
    builder.Connect(estimator.GetOutputPort("X_WP"), servo.GetInputPort("X_WP"))
    corrector, velocities = add_tension_corrector(
        builder, settings, robot, believed=believed, readings=readings, servo=servo,
        estimator=estimator, name=prefix + "corrector",
    )  # fmt: skip
    if torque is not None:
        connect_torque_controller(
            builder, torque, robot, readings=readings, servo=servo, estimator=estimator
        )
    velocities = _run_off(builder, velocities, winch_offsets(settings, velocities.size()), prefix)
    return VisualServoBlocks(
        block=robot,
        believed=believed,
        target=target,
        motion=motion,
        mounting=mounting,
        pinhole=pinhole,
        X_CdO=X_CdO,
        begins=last_task.time,
        measurement=measurement,
        servo=servo,
        plan=plan,
        estimator=estimator,
        compared=tuple(compared),
        readings=readings,
        wanted_lengths=_command_winches(builder, velocities, robot, prefix),
        corrector=corrector,
        torque=torque,
    )


def _platform_tag(
    settings: VisualServoSettings, robot: Robot
) -> tuple[RigidTransform, RigidTransform] | None:
    """X_WC of the second camera and X_PQ of its tag on the platform, if there are any [m]."""
    tag = settings.estimator.platform_tag
    if tag is None:
        return None
    return robot.camera_mount(tag.mount).pose.transform(), tag.pose.transform()


def _add_estimators(
    builder: DiagramBuilder,
    settings: EstimatorSettings,
    task: EstimatorTask,
    inputs: EstimatorInputs,
    prefix: str,
) -> list[System]:
    """Adds the estimator that the servo listens to, then those that run beside it."""
    kinds = {"estimator": settings.kind, **{f"estimator_{kind}": kind for kind in settings.compare}}
    return [
        add_estimator(builder, kind, task, inputs, name=prefix + block)
        for block, kind in kinds.items()
    ]


def _run_off(
    builder: DiagramBuilder, velocities: OutputPort, offsets: Array | None, prefix: str
) -> OutputPort:
    """Adds velocities by which winches run off; the port with what the winches really do."""
    if offsets is None:
        return velocities
    run_off = builder.AddNamedSystem(prefix + "winch_offsets", ConstantVectorSource(offsets))
    both = builder.AddNamedSystem(prefix + "winch_velocities", Adder(2, len(offsets)))
    for index, port in enumerate((velocities, run_off.get_output_port())):
        builder.Connect(port, both.get_input_port(index))
    return both.get_output_port()


def _command_winches(
    builder: DiagramBuilder, velocities: OutputPort, robot: RobotBlock, prefix: str
) -> Integrator | None:
    """Connects velocities to the winches; returns what makes lengths of them, if any.

    Winches by torque get none.
    """
    if robot.HasInputPort("motor_torques"):
        return None
    if not robot.HasInputPort("commanded_lengths"):
        builder.Connect(velocities, robot.GetInputPort("cable_velocities"))
        return None
    wanted = builder.AddNamedSystem(prefix + "wanted_lengths", Integrator(velocities.size()))
    builder.Connect(velocities, wanted.get_input_port())
    builder.Connect(wanted.get_output_port(), robot.GetInputPort("commanded_lengths"))
    if robot.HasInputPort("commanded_length_rates"):
        builder.Connect(velocities, robot.GetInputPort("commanded_length_rates"))
    return wanted

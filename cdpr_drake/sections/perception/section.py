"""Sections of `sensors` that look at the world or at motion, which are logged.

The inertial sensor is no section: the core's estimator that fuses sensors reads it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydrake.geometry import FrameId
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import Sine

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.rendered_camera import add_renderer, make_depth_camera
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.models.sensor_catalogue import (
    DepthSensorModel,
    RangeSensorModel,
    depth_sensor_names,
    load_depth_sensor,
    load_range_sensor,
    range_sensor_names,
)
from cdpr_drake.schema.declarations import (
    FASTEST,
    In,
    Name,
    OneOf,
    Refusal,
    Scope,
    Text,
    filled,
    number_words,
    settings,
    values,
)
from cdpr_drake.sections.perception.depth_sensor import DepthSensor, binned, depth_pinhole
from cdpr_drake.sections.perception.head import MODES, PanTilt, PanTiltJoints
from cdpr_drake.sections.perception.range_sensor import RangeSensor
from cdpr_drake.sections.perception.wheel_odometry import WheelModel, WheelOdometry
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.sections import Section
from cdpr_drake.systems.sensors.scene_shapes import ROLES
from cdpr_drake.systems.sensors.sensor_kinds import TypedSensor
from cdpr_drake.trajectories.mobile_robot import MobileRobotMotion

PLATFORM, WORLD, HEAD = "platform", "world", "pan_tilt"
"""What carries a sensor; the head's block has that name, too."""

REPORT = "cdpr_drake.sections.perception.report:SUBJECTS"

JOINTS = ("pan_rad", "tilt_rad")
"""Names of angles of pan and tilt in the log."""


def _origin() -> Pose:
    return Pose(position=np.zeros(3))


def carrier_refusals(carrier: str, scope: Scope, *more: str) -> Iterator[Refusal]:
    """What is not there to carry a sensor; `more` is."""
    target, world = scope.whole.target, scope.whole.world
    there = [PLATFORM, WORLD, *(["target"] if target.carrier == "world" else [])]
    there += [*([] if world is None else world.moving()), *more]
    if carrier not in there:
        yield "carrier", f"{carrier}, which is not there", ", ".join(there)[:200]


def carrier_frame(robot: RobotBlock, carrier: str, sees: str = "perception") -> FrameId:
    """Geometry frame of what carries a sensor.

    A thing that is both seen and touched can have two frames of its name, which move as one: that
    with the shapes which the sensor sees, since it is not to see its carrier.

    Raises:
        ScenarioError: Nothing of that name is in the scene.
    """
    plant, scene_graph = robot.plant, robot.scene_graph
    if carrier in (PLATFORM, WORLD):
        body = plant.world_body() if carrier == WORLD else robot.in_plant.body
        return plant.GetBodyFrameIdOrThrow(body.index())
    assert scene_graph is not None
    inspector = scene_graph.model_inspector()
    frames = {
        inspector.GetName(frame).split("::")[-1]: frame
        for frame in sorted(
            inspector.GetAllFrameIds(),
            key=lambda frame: inspector.NumGeometriesForFrameWithRole(frame, ROLES[sees]),
        )
        if frame != inspector.world_frame_id()
    }
    if carrier not in frames:
        raise ScenarioError(
            f"sensors: carrier: found {carrier}; accepted: {PLATFORM}, {WORLD}, {HEAD}, or "
            "what moves in the scene: " + ", ".join(sorted(frames))[:200]
        )
    return frames[carrier]


@settings
class PanTiltSettings(Section):
    """A head on two joints, which swings and carries range sensors; its angles are logged."""

    words = "A head on two joints"
    columns: ClassVar = {"pan_tilt_angles": JOINTS, "pan_tilt_encoders": JOINTS}
    report = REPORT

    carrier: Annotated[
        Text, "What carries it: platform, world, target, or an obstacle that moves."
    ] = PLATFORM
    pose: Annotated[
        Pose,
        "Pose of the joints' frame M in the carrier: z ahead, x to the right, y down; pan"
        " turns to the right about y, then tilt upwards about x.",
    ] = filled(_origin)
    arm: Annotated[
        np.ndarray, In("m", 3), "Position of the head's origin from where the axes meet."
    ] = values(0.0, 0.0, 0.0)
    lower_deg: Annotated[np.ndarray, In("deg", 2), "Smallest angles, pan and tilt."] = values(
        -160.0, -45.0
    )
    upper_deg: Annotated[np.ndarray, In("deg", 2), "Largest angles."] = values(160.0, 90.0)
    speed_deg: Annotated[np.ndarray, In("deg/s", 2, gt=0.0), "Largest speeds."] = values(
        120.0, 120.0
    )
    mode: Annotated[str, OneOf(MODES), "What its commands are."] = "position"
    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Looks at the command."] = 100.0
    swing_deg: Annotated[
        np.ndarray, In("deg", 2), "How far the commands swing to either side, pan and tilt."
    ] = values(0.0, 0.0)
    swing_period: Annotated[np.ndarray, In("s", 2, gt=0.0), "Periods of these sines."] = values(
        4.0, 4.0
    )
    counts_per_turn: Annotated[int, In(ge=4), "Counts of an encoder per turn."] = 4096
    zero_error_deg: Annotated[
        float, In("deg", ge=0.0), "Standard deviation of an encoder's zero."
    ] = 0.0

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Limits with nothing between, a carrier that is not there, and another of its name."""
        yield from carrier_refusals(self.carrier, scope)
        if not np.all(self.lower_deg <= self.upper_deg):
            accepted = f"at most upper_deg, {number_words(self.upper_deg)} [deg]"
            yield "lower_deg", number_words(self.lower_deg), accepted
        world = scope.whole.world
        for k, obstacle in enumerate([] if world is None else world.obstacles):
            if obstacle.name == HEAD:
                yield f"/world.obstacles[{k}].name", HEAD, "another name, which no head has"

    def sampling_rate(self) -> float:
        """Looks at the command [Hz]."""
        return self.rate

    def joints(self) -> PanTiltJoints:
        """The joints."""
        return PanTiltJoints(
            lower=np.radians(self.lower_deg),
            upper=np.radians(self.upper_deg),
            speed=np.radians(self.speed_deg),
            counts_per_turn=self.counts_per_turn,
            zero_error=float(np.radians(self.zero_error_deg)),
        )

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Adds a `PanTilt` as pan_tilt, and as pan_tilt_command the sines that command it."""
        name = blocks.prefix + HEAD
        head = builder.AddNamedSystem(
            name,
            PanTilt(
                self.joints(), self.pose.transform(), arm=self.arm, mode=self.mode, rate=self.rate,
                seed=settings.seed,
            ),
        )  # fmt: skip
        sines = builder.AddNamedSystem(
            f"{name}_command",
            Sine(np.radians(self.swing_deg), 2.0 * np.pi / self.swing_period, np.zeros(2)),
        )
        command = sines.get_output_port(0 if self.mode == "position" else 1)
        builder.Connect(command, head.GetInputPort("command"))
        ports = zip(self.columns, ("angles", "encoder_angles"), strict=True)
        return {quantity: head.GetOutputPort(port) for quantity, port in ports}


@settings
class RangeSettings(TypedSensor):
    """A laser scanner or a single beam; it is logged as scan_NAME."""

    words = "Laser scanners and single beams."
    many = True
    report = REPORT
    load = staticmethod(load_range_sensor)

    name: Annotated[Name, "Name, which also tells its noise from that of others."]
    type: Annotated[str, OneOf(range_sensor_names()), "Type of the catalogue."] = "hokuyo"
    carrier: Annotated[
        Text, "What carries it: platform, world, pan_tilt, target, or an obstacle that moves."
    ] = PLATFORM
    pose: Annotated[
        Pose,
        "Pose of its frame S in the carrier: x ahead, y to the left, beams in the plane z = 0.",
    ] = filled(_origin)
    rate: Annotated[float | None, In("Hz", gt=0.0), "Scans; null: the type's."] = None
    beams: Annotated[
        int | None, In(ge=1, le=10000), "Beams, over the same angles; null: the type's."
    ] = None
    noise: Annotated[
        float | None,
        In("m", ge=0.0),
        "Standard deviation of a reading, whatever its range; null: as the type has it.",
    ] = None
    sees: Annotated[
        str, OneOf(ROLES), "What beams end on: what cameras see, or what things bump into."
    ] = "perception"

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """The name of another one, a carrier that is not there, more scans than the type's."""
        yield from super().refusals(scope)
        suite = scope.whole.sensors
        if next(one for one in suite.range_sensors if one.name == self.name) is not self:
            yield "name", f"{self.name} twice", "each name once"
        yield from carrier_refusals(self.carrier, scope, *([HEAD] if suite.pan_tilt else []))

    def model(self) -> RangeSensorModel:
        """The type, with what is set here."""
        model: RangeSensorModel = super().model()
        if self.beams is not None:
            model = replace(model, beams=self.beams)
        return model if self.noise is None else replace(model, noise=self.noise, noise_share=0.0)

    def log_columns(self) -> Mapping[str, list[str]]:
        """A distance for each beam."""
        return {f"scan_{self.name}": [f"{k}_m" for k in range(self.model().beams)]}

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Adds a `RangeSensor` as scan_NAME; a head that carries it is there already."""
        title, head = f"scan_{self.name}", settings.sensors.pan_tilt
        on_head = self.carrier == HEAD and head is not None
        carrier = head.carrier if on_head else self.carrier
        sensor = builder.AddNamedSystem(
            blocks.prefix + title,
            RangeSensor(
                self.model(), carrier_frame(blocks.block, carrier, self.sees),
                self.pose.transform(), name=self.name, seed=settings.seed, sees=self.sees,
                sees_parent=carrier == WORLD,
            ),
        )  # fmt: skip
        query = blocks.block.GetOutputPort("query_object")
        builder.Connect(query, sensor.GetInputPort("query_object"))
        if on_head:
            joints = builder.GetSubsystemByName(blocks.prefix + HEAD)
            builder.Connect(joints.GetOutputPort("X_BH"), sensor.GetInputPort("X_BH"))
        return {title: sensor.GetOutputPort("ranges")}


@settings
class DepthSettings(TypedSensor):
    """A depth camera, rendered; the middle row of its images is logged as depth_row."""

    words = "Depth camera"
    needs_rendering = True
    report = REPORT
    load = staticmethod(load_depth_sensor)

    type: Annotated[str, OneOf(depth_sensor_names()), "Type of the catalogue."] = "kinect"
    carrier: Annotated[
        Text, "What carries it: platform, world, target, or an obstacle that moves."
    ] = PLATFORM
    pose: Annotated[
        Pose, "Pose of its frame C in the carrier: z ahead, x to the right, y down."
    ] = filled(_origin)
    rate: Annotated[float | None, In("Hz", gt=0.0), "Images; null: the type's."] = None
    binning: Annotated[
        int,
        In(ge=1, le=64),
        "Pixels of the type's image, across and down, for which one is rendered.",
    ] = 4
    noise: Annotated[
        float | None,
        In("m", ge=0.0),
        "Standard deviation of a depth, whatever its size; null: as the type has it.",
    ] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A carrier that is not there, and more images than the type's."""
        yield from super().refusals(scope)
        yield from carrier_refusals(self.carrier, scope)

    def model(self) -> DepthSensorModel:
        """The type, with what is set here."""
        model: DepthSensorModel = binned(super().model(), self.binning)
        if self.noise is None:
            return model
        return replace(model, noise=self.noise, noise_per_square=0.0)

    def log_columns(self) -> Mapping[str, list[str]]:
        """A depth for each pixel of a row."""
        return {"depth_row": [f"{k}_m" for k in range(self.model().width)]}

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Adds a `DepthSensor` as depth, and as depth_camera what Drake renders for it.

        Raises:
            RenderingError: EGL is missing.
        """
        robot, model, prefix = blocks.block, self.model(), blocks.prefix
        add_renderer(robot.scene_graph)
        camera = builder.AddNamedSystem(
            f"{prefix}depth_camera",
            make_depth_camera(
                carrier_frame(robot, self.carrier), self.pose.transform(), depth_pinhole(model),
                (float(model.limits[0]), float(model.limits[1])),
            ),
        )  # fmt: skip
        sensor = builder.AddNamedSystem(f"{prefix}depth", DepthSensor(model, seed=settings.seed))
        query = robot.GetOutputPort("query_object")
        builder.Connect(query, camera.GetInputPort("geometry_query"))
        image = camera.GetOutputPort("depth_image_32f")
        builder.Connect(image, sensor.GetInputPort("rendered"))
        return {"depth_row": sensor.GetOutputPort("depth_row")}

    def at_end(self, built: Any, context: Context) -> Mapping[str, Any]:
        """The last image as depth_image, shape (h, w) [m]."""
        sensor = built.diagram.GetSubsystemByName(f"{built.prefix}depth")
        return {"depth_image": sensor.image(sensor.GetMyContextFromRoot(context))}


@settings
class OdometrySettings(Section):
    """Odometry of the mobile robot that carries the target, logged as X_WO_odometry."""

    words = "Odometry of the mobile robot that carries the target"
    columns: ClassVar = {"wheel_distances": ("left_m", "right_m")}
    report = REPORT

    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Samples."] = 50.0
    wheel_radius: Annotated[float, In("m", gt=0.0), "Radius of the wheels."] = 0.02
    counts_per_turn: Annotated[int, In(ge=4), "Counts of an encoder per turn of a wheel."] = 4096
    scale_error: Annotated[
        float, In("-", ge=0.0), "Standard deviation of the relative error of a wheel's radius."
    ] = 0.0
    base_error: Annotated[
        float,
        In("-", ge=0.0, lt=0.2),
        "Standard deviation of the relative error of the wheels' distance.",
    ] = 0.0
    slip: Annotated[
        float,
        In("m/sqrt(m)", ge=0.0),
        "Standard deviation of what a wheel turns too much on one metre, growing with the"
        " root of the way.",
    ] = 0.0

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A target without a mobile robot."""
        motion = scope.whole.target.motion
        if motion is None or motion.mobile_robot is None:
            found = "a target that no mobile robot carries"
            yield "", found, "null, or target.motion.mobile_robot"

    def sampling_rate(self) -> float:
        """Samples [Hz]."""
        return self.rate

    def wheels(self) -> WheelModel:
        """The wheels."""
        return WheelModel(
            radius=self.wheel_radius,
            counts_per_turn=self.counts_per_turn,
            scale_error=self.scale_error,
            base_error=self.base_error,
            slip=self.slip,
        )

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Adds a `WheelOdometry` as odometry.

        Raises:
            ScenarioError: No mobile robot carries the target.
        """
        if not isinstance(blocks.motion, MobileRobotMotion):
            raise ScenarioError(
                "sensors.odometry: found a target that no mobile robot carries; accepted: null, or "
                "target.motion.mobile_robot"
            )
        sensor = builder.AddNamedSystem(
            f"{blocks.prefix}odometry",
            WheelOdometry(blocks.motion, self.wheels(), seed=settings.seed, rate=self.rate),
        )
        return {name: sensor.GetOutputPort(name) for name in ("X_WO_odometry", "wheel_distances")}

"""Checks the section `tension_management` and puts its block between a servo and the winches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ScenarioError, TensionProblemError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.rendered_camera import add_renderer
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.schema.declarations import Refusal, Scope, told
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.cameras.cable_camera import CableCamera
from cdpr_drake.systems.cameras.cable_picture_camera import CablePicture, CablePictureCamera
from cdpr_drake.systems.cameras.camera_settings import RENDERED
from cdpr_drake.systems.controllers.correction_laws import (
    AdaptiveCorrection,
    ConstantThreshold,
    CorrectionLaw,
    DetectedSlackRate,
    ExpectedLength,
    FollowedDistribution,
    ImageSlackRate,
    InsidePolygon,
    LengthGain,
    LengthThreshold,
)
from cdpr_drake.systems.controllers.tension_corrector import TensionCorrector
from cdpr_drake.systems.controllers.tension_management_settings import (
    ADAPTIVE,
    BY_LENGTH,
    CONSTANT,
    DISTRIBUTION,
    IMAGE,
    POLYGON,
    TensionManagement,
)
from cdpr_drake.systems.diagrams.torque_control import is_whole_step
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.scenarios.visual_servo_scenario import VisualServoSettings
from cdpr_drake.systems.sensors.sensor_readings import SensorReadings
from cdpr_drake.tensions.correction_gain import SHARES, SampledCorrection, tension_gain
from cdpr_drake.tensions.methods import method_for
from cdpr_drake.tensions.slack_correction import TensionFollower
from cdpr_drake.vision.cable_detection import SightSettings
from cdpr_drake.vision.pinhole import Pinhole

if TYPE_CHECKING:
    pass

SEEN_POINTS = 15
"""Points of each cable that are looked for in an image."""

WHOLE = 1e-6
"""A period over a step that is this near to a whole number is one: decimal rates are rounded."""


def management_refusals(scope: Scope) -> Iterator[Refusal]:
    """Thresholds, lengths, methods and rates that the robot or the simulation exclude."""
    scenario, robot, settings = scope.whole, scope.robot, scope.whole.tension_management
    if settings is None:
        return
    m, upper, section = len(robot.cables), robot.tension_bounds.upper, "tension_management"
    distributed = {DISTRIBUTION: "method", POLYGON: "set_point"}.get(settings.kind)
    for key in ("threshold", "highest"):
        values = getattr(settings, key)
        if values is None:
            continue
        if len(values) not in (1, m) or (distributed and len(values) != 1):
            each = f"one, or one for each of the {m} cables of {robot.name}"
            accepted = f"one, by kind {settings.kind}" if distributed else each
            yield f"{section}.{key}", f"{len(values)} values", accepted
            return
        if np.any(values < 0.0):
            accepted = "at least 0 [N]: cables do not push"
            yield f"{section}.{key}", f"{np.min(values):g}", accepted
        if np.any(values >= upper):
            accepted = f"below {upper:g} [N], the upper bound of {robot.name}"
            yield f"{section}.{key}", f"{np.max(values):g}", accepted
    if settings.kind == BY_LENGTH:
        yield from _by_length(settings)
    if settings.kind == IMAGE:
        yield from _sight_refusals(settings, robot, scenario.camera.kind == RENDERED)
    if distributed:
        try:
            method = getattr(settings, distributed)
            method_for(method, m - robot.motion_type().freedom, False)
        except TensionProblemError as problem:
            yield told(problem, f"{section}.{distributed}")
        most = (upper - float(settings.threshold[0])) / 2.0
        if settings.kind == POLYGON and settings.margin > most:
            accepted = f"at most {most:g} [N], half of what lies between threshold and upper bound"
            yield f"{section}.margin", f"{settings.margin:g}", accepted
    rate, step = settings.rate or scenario.controller.rate, scenario.integration.max_step
    if step is not None and not is_whole_step(rate, step):
        steps = f"a whole number of steps of integration.max_step = {step:g} s"
        yield f"{section}.rate", f"{rate:g}", f"{steps} for each correction"


def _sight_refusals(settings: TensionManagement, robot: Robot, rendered: bool) -> Iterator[Refusal]:
    key, mount = "tension_management.sight_mount", settings.sight_mount
    mounts = {each.name: each.model for each in robot.cameras if each.parent == "world"}
    if mount not in mounts:
        known = ", ".join(mounts) or "it has none"
        yield key, mount, f"a camera in the world of {robot.name}: {known}"
        return
    fastest = load_camera(mounts[mount]).rate_hz
    if settings.sight_rate > fastest:
        found = f"{settings.sight_rate:g}"
        yield "tension_management.sight_rate", found, f"at most {fastest:g} [Hz]"
    if rendered and not _sight(robot, settings).is_ideal:
        accepted = "with a rendered camera one without distortion"
        yield key, f"{mount}, whose lens distorts", accepted


def _by_length(settings: TensionManagement) -> Iterator[Refusal]:
    section = "tension_management"
    missing = [key for key in ("highest", "shortest", "longest") if getattr(settings, key) is None]
    for key in missing:
        yield f"{section}.{key}", "none", "a number, by kind by_length"
    if missing:
        return
    assert settings.shortest is not None
    assert settings.longest is not None
    assert settings.highest is not None
    if settings.longest <= settings.shortest:
        accepted = f"above shortest, {settings.shortest:g} [m]"
        yield f"{section}.longest", f"{settings.longest:g}", accepted
    low, high = np.broadcast_arrays(settings.threshold, settings.highest)
    if np.any(high < low):
        found = f"{np.min(high - low):g} N above threshold"
        yield f"{section}.highest", found, "not below threshold"
    if settings.shape == "exponential" and np.any(low <= 0.0):
        yield f"{section}.threshold", f"{np.min(low):g}", "above 0 [N] by shape exponential"


def automatic_gain(
    robot: Robot, cables: CableSet, X_WP: RigidTransform, rate: float, delay: float
) -> LengthGain:
    """A gain by `tension_gain`, less where modes of the platform on its cables ask for that.

    Args:
        robot: The robot, for its platform.
        cables: The cables, as stiff and as damped as they are known to be.
        X_WP: Pose at which modes are judged.
        rate: Corrections per second [Hz].
        delay: From a tension to the velocity that it asks for, beside the period [s].

    Raises:
        ScenarioError: No gain down to 1/64 of that is stable.
    """
    loop, lengths = correction_loop(robot, cables, X_WP)
    gains = tension_gain(loop.cable_stiffness, rate, delay)
    share = loop.stable_share(gains, rate, delay)
    if share is None:
        least = float(np.min(gains)) * SHARES[0]
        raise ScenarioError(
            f"tension_management.gain: found null; accepted for {robot.name} at {rate:g} Hz with a "
            f"delay of {delay:g} s: a number, as no gain down to {least:.2g} m/(N s) is stable; a "
            "higher rate, or cables that damp more, may help"
        )
    return LengthGain(share * gains / lengths)


def correction_loop(
    robot: Robot, cables: CableSet, X_WP: RigidTransform
) -> tuple[SampledCorrection, Array]:
    """The loop of a correction about a pose, and lengths of the cables there, shape (m,) [m].

    All cables pull; what weight and tensions add to their stiffness, and what brakes the platform
    beside them, is left out.
    """
    paths = cable_paths(X_WP, cables)
    S = robot.motion_type().basis(X_WP.rotation().matrix())
    k, J = cables.stiffness / paths.lengths, paths.J @ S
    mass = S.T @ rigid_platform(robot).mass_matrix(X_WP) @ S
    stiffness = J.T @ (k[:, np.newaxis] * J)
    loop = SampledCorrection(mass, stiffness, J, k, cables.retardation, np.zeros_like(mass))
    return loop, paths.lengths


def correction_law(
    settings: TensionManagement,
    robot: Robot,
    cables: CableSet,
    fastest: float,
    by_length: LengthGain | None = None,
    rendered: bool = False,
) -> CorrectionLaw:
    """The law that settings ask for, with what is believed of the cables.

    Args:
        settings: The section.
        robot: The robot, for its weight and tension bounds.
        cables: The believed cables.
        fastest: Rated cable speed of the winches [m/s].
        by_length: The gain where the section states none; needed by kinds that have one.
        rendered: Whether cables are found in rendered images; kind image.
    """

    def each(values: Array) -> Array:
        return np.asarray(np.broadcast_to(values, cables.count), float).copy()

    threshold = each(settings.threshold)
    gain: Array | LengthGain = np.zeros(0)
    if settings.needs_gain():
        assert by_length is not None
        gain = by_length
    elif settings.gain is not None:
        gain = np.full(cables.count, settings.gain)
    if settings.kind == CONSTANT:
        return ConstantThreshold(threshold, gain)
    if settings.kind == ADAPTIVE:
        return AdaptiveCorrection(threshold, settings.gain_per_length, cables)
    if settings.kind == BY_LENGTH:
        assert settings.highest is not None
        assert settings.shortest is not None
        assert settings.longest is not None
        return LengthThreshold(
            threshold, each(settings.highest), settings.shortest, settings.longest,
            settings.shape, gain,
        )  # fmt: skip
    if settings.kind == DISTRIBUTION:
        follower = TensionFollower(
            settings.proportional, settings.integral, settings.derivative,
            settings.fastest or fastest,
        )  # fmt: skip
        return FollowedDistribution(
            robot, cables, float(threshold[0]), robot.tension_bounds.upper, settings.method,
            follower,
        )  # fmt: skip
    if settings.kind == POLYGON:
        return InsidePolygon(
            robot, cables, float(threshold[0]), robot.tension_bounds.upper, settings.margin,
            settings.set_point, settings.gain or by_length or 0.0, settings.fastest or fastest,
        )  # fmt: skip
    if settings.kind == IMAGE and rendered:
        return DetectedSlackRate(
            threshold=threshold, gain=gain, allowance=settings.allowance,
            time=settings.closing_time, fastest=settings.fastest or fastest,
        )  # fmt: skip
    if settings.kind == IMAGE:
        mount = robot.camera_mount(settings.sight_mount)
        return ImageSlackRate(
            threshold=threshold, gain=gain, allowance=settings.allowance,
            time=settings.closing_time, fastest=settings.fastest or fastest, cables=cables,
            camera=(mount.pose.transform(), _sight(robot, settings), settings.sight_noise),
        )  # fmt: skip
    return ExpectedLength(cables, settings.allowance, settings.slowness)


def _sight(robot: Robot, settings: TensionManagement) -> Pinhole:
    """The lens of the camera that looks at the cables."""
    camera = load_camera(robot.camera_mount(settings.sight_mount).model)
    return camera.pinhole(camera.width, camera.height)


def used_gain(
    settings: VisualServoSettings,
    wanted: TensionManagement,
    robot: Robot,
    believed: BelievedRobot,
    real: CableSet,
) -> LengthGain | None:
    """The gain where a section states none and its kind has one, else None.

    Stiffness and damping of the cables are known as they are, `real`, or are those of the robot
    that is believed in, if that is another one.

    Raises:
        ScenarioError: None is stable.
    """
    if not wanted.needs_gain():
        return None
    cables, rate = believed.cables, wanted.rate or settings.controller.rate
    if not settings.controller.pulleys:
        cables = cables.without_pulleys()
    if settings.perturbations.believed_robot is None:
        cables = replace(cables, stiffness=real.stiffness, retardation=real.retardation)
    readings, delay = settings.sensors.rate("tension"), wanted.delay
    if delay is None:
        delay = 0.0 if readings is None else 1.0 / readings
    return automatic_gain(robot, cables, believed.X_WP0, rate, delay)


def make_corrector(
    settings: VisualServoSettings,
    wanted: TensionManagement,
    robot: Robot,
    believed: BelievedRobot,
    real: CableSet,
) -> TensionCorrector:
    """What takes up slack beside a servo, with what is believed of the robot; see `used_gain`.

    Raises:
        ScenarioError: No gain is stated, and none is stable.
    """
    cables = believed.cables
    if not settings.controller.pulleys:
        cables = cables.without_pulleys()
    by_length = used_gain(settings, wanted, robot, believed, real)
    rate = wanted.rate or settings.controller.rate
    drawn = wanted.kind == IMAGE and settings.camera.kind == RENDERED
    law = correction_law(wanted, robot, cables, robot.winch.rated_cable_speed(), by_length, drawn)
    points = SEEN_POINTS if wanted.kind == IMAGE and not drawn else 0
    return TensionCorrector(law, cables.count, rate, points, drawn)


def add_tension_corrector(
    builder: DiagramBuilder,
    settings: VisualServoSettings,
    robot: RobotBlock,
    *,
    believed: BelievedRobot,
    readings: SensorReadings,
    servo: System,
    estimator: System,
    name: str,
) -> tuple[TensionCorrector | None, OutputPort]:
    """Adds a `TensionCorrector` behind a servo, if its settings ask for one.

    Returns:
        The block, None without, and the port with the velocities for the winches.
    """
    commanded = servo.GetOutputPort("cable_velocities")
    wanted = settings.tension_management
    if wanted is None:
        return None, commanded
    corrector = make_corrector(settings, wanted, robot.robot, believed, robot.forces.cable_set())
    builder.AddNamedSystem(name, corrector)
    for port, source in (
        ("commanded_velocities", commanded),
        ("tensions", readings.port("measured_tensions")),
        ("lengths", readings.port("measured_lengths")),
        ("X_WP", estimator.GetOutputPort("X_WP")),
    ):
        builder.Connect(source, corrector.GetInputPort(port))
    if wanted.kind == IMAGE and settings.camera.kind == RENDERED:
        camera = _add_picture_camera(builder, robot, settings, wanted, believed, corrector)
        builder.Connect(estimator.GetOutputPort("X_WP"), camera.GetInputPort("X_WP_believed"))
    elif wanted.kind == IMAGE:
        _add_cable_camera(builder, robot, settings, wanted, corrector)
    return corrector, corrector.GetOutputPort("cable_velocities")


def _add_cable_camera(
    builder: DiagramBuilder,
    robot: RobotBlock,
    settings: VisualServoSettings,
    wanted: TensionManagement,
    corrector: TensionCorrector,
) -> None:
    """Adds the camera in the world that looks at the cables, named after the corrector."""
    camera = builder.AddNamedSystem(
        f"{corrector.get_name()}_camera",
        CableCamera(
            robot.forces.cable_set(), robot.forces.model(),
            robot.robot.camera_mount(wanted.sight_mount).pose.transform(),
            _sight(robot.robot, wanted), wanted.sight_rate,
            points=SEEN_POINTS, noise=wanted.sight_noise, seed=settings.seed,
        ),
    )  # fmt: skip
    for port in ("X_WP", "unstrained_lengths"):
        builder.Connect(robot.GetOutputPort(port), camera.GetInputPort(port))
    builder.Connect(camera.GetOutputPort("cable_points"), corrector.GetInputPort("cable_points"))


def _add_picture_camera(
    builder: DiagramBuilder,
    robot: RobotBlock,
    settings: VisualServoSettings,
    wanted: TensionManagement,
    believed: BelievedRobot,
    corrector: TensionCorrector,
) -> CablePictureCamera:
    """Adds the camera in the world that draws the cables and finds them, named after the corrector;
    its input X_WP_believed is left open."""
    cables = believed.cables
    if not settings.controller.pulleys:
        cables = cables.without_pulleys()
    add_renderer(robot.scene_graph)
    picture = CablePicture(
        cables=robot.forces.cable_set(),
        model=robot.forces.model(),
        radii=0.5 * robot.robot.diameters(),
        world=robot.plant.GetBodyFrameIdOrThrow(robot.plant.world_body().index()),
        X_WE=robot.robot.camera_mount(wanted.sight_mount).pose.transform(),
        pinhole=_sight(robot.robot, wanted),
        grain=wanted.sight_grain,
        seed=settings.seed,
    )
    looks = SightSettings(ends=wanted.sight_ends)
    camera = builder.AddNamedSystem(
        f"{corrector.get_name()}_camera",
        CablePictureCamera(picture, cables, wanted.sight_rate, looks),
    )
    for port in ("query_object", "X_WP", "unstrained_lengths"):
        builder.Connect(robot.GetOutputPort(port), camera.GetInputPort(port))
    builder.Connect(camera.GetOutputPort("cable_surplus"), corrector.GetInputPort("cable_surplus"))
    return camera

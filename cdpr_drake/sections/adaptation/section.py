"""Section `adaptation` of a scenario: its settings, and its block beside a servo."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort

from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import In, Refusal, Scope, Switch, settings
from cdpr_drake.sections.adaptation.adaptive_servo import BELIEVED_POINTS, AdaptiveServo
from cdpr_drake.sections.adaptation.belief_check import BeliefCheck
from cdpr_drake.sections.adaptation.geometry_learner import (
    ADAPTATION,
    DOUBTED,
    LEARNT,
    LEARNT_SIGMA,
    OPEN_FRAMES,
    GeometryLearner,
)
from cdpr_drake.sections.adaptation.recursive_calibration import (
    Beforehand,
    LearningRules,
    RecursiveCalibration,
)
from cdpr_drake.systems.controllers.tension_management_settings import (
    DISTRIBUTION,
    LENGTH,
    POLYGON,
)
from cdpr_drake.systems.sections import Section
from cdpr_drake.vision.target import PointTarget

LOGGED = (LEARNT, LEARNT_SIGMA, BELIEVED_POINTS, ADAPTATION, DOUBTED, OPEN_FRAMES)
"""Outputs of the block that a run logs."""

BY_LENGTHS = ("cable_lengths", "fusion", "sensor_fusion")
"""How names of estimators begin that reckon with the points that are believed at the start."""

BY_MODEL = (DISTRIBUTION, LENGTH, POLYGON)
"""Kinds of tension management that do."""


@settings
class Adaptation(Section):
    """Exit points, anchor points and lengths at the start, learnt while the servo runs."""

    words = "Exit and anchor points and lengths at the start, learnt while the servo runs"
    report = "cdpr_drake.sections.adaptation.report:SUBJECTS"

    exit_points: Annotated[
        float,
        In("m", gt=0.0),
        "Standard deviation of a coordinate of an exit point, before anything is measured.",
    ] = 0.01
    anchor_points: Annotated[float, In("m", gt=0.0), "The same of an anchor point."] = 0.01
    camera_place: Annotated[
        float,
        In("m", ge=0.0),
        "Standard deviation of a coordinate of the camera on the platform; 0: it is exact.",
    ] = 0.0
    camera_turn_deg: Annotated[float, In("deg", ge=0.0), "The same of a turn of it."] = 0.0
    start_place: Annotated[
        float,
        In("m", gt=0.0),
        "Standard deviation of a coordinate of the pose where the target is first seen, "
        "as the estimator starts from it.",
    ] = 0.001
    start_turn_deg: Annotated[float, In("deg", gt=0.0), "The same of a turn of it."] = 0.1
    length_noise: Annotated[
        float, In("m", gt=0.0), "Standard deviation of a length that encoders count."
    ] = 0.0001
    pixel_noise: Annotated[
        float, In("px", gt=0.0), "Standard deviation of a coordinate of a corner that is found."
    ] = 0.2
    slack_below: Annotated[float, In("N", ge=0.0), "Cables that pull less tell no length."] = 0.2
    spacing: Annotated[
        float, In("m", gt=0.0), "Way of the platform from one pose that counts to the next."
    ] = 0.005
    turn_deg: Annotated[float, In("deg", gt=0.0), "Or its turn."] = 2.0
    window: Annotated[
        int,
        In(ge=2, le=1000),
        "Poses that are linearised anew; those before them stay linearised as they were, "
        "which makes standard deviations too small: best as many as a motion has.",
    ] = 100
    period: Annotated[
        float, In("s", gt=0.0), "Time between models that are offered to the servo."
    ] = 0.5
    believe: Annotated[Switch, "Whether the servo gets them; else they are logged alone."] = True
    margin: Annotated[
        float, In("-"), "Least margin of the stability criterion of a model that is believed."
    ] = 0.0
    margin_loss: Annotated[
        float,
        In("-", ge=0.0),
        "By how much that margin may be less than the one of the model before.",
    ] = 0.05
    samples: Annotated[
        int,
        In(ge=1, le=10000),
        "Robots, as likely as what was measured leaves them, of each of which the "
        "criterion must hold.",
    ] = 16

    def beforehand(self) -> Beforehand:
        """What is known beforehand."""
        return Beforehand(
            exit_points=self.exit_points,
            anchor_points=self.anchor_points,
            camera_place=self.camera_place,
            camera_turn=float(np.radians(self.camera_turn_deg)),
            pose_place=self.start_place,
            pose_turn=float(np.radians(self.start_turn_deg)),
        )

    def rules(self, focal: float) -> LearningRules:
        """How measurements count, of a camera of a focal length [px]."""
        return LearningRules(
            length_sigma=self.length_noise,
            corner_sigma=self.pixel_noise / focal,
            spacing=self.spacing,
            turn=float(np.radians(self.turn_deg)),
            window=self.window,
            slack_below=self.slack_below,
        )

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Scenarios in which points cannot be learnt, or others would go by the old ones."""
        if any(scope.whole.target.refusals(scope)):
            return
        for found, accepted in _obstacles(scope.whole, scope.robot):
            if found:
                yield "", f"a section with {found}", accepted

    def make_servo(self, model: Any, settings: Any) -> AdaptiveServo:
        """A servo that goes by the points at its input."""
        rate = settings.controller.rate
        return AdaptiveServo(model.controller, model.target, model.pinhole, rate)

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Adds a `GeometryLearner`, and lets the servo go by its points."""
        from cdpr_drake.systems.diagrams.servo_watches import servo_criterion  # has scenarios

        believed, target, pinhole = blocks.believed, blocks.target, blocks.pinhole
        assert isinstance(target, PointTarget)
        real = blocks.block.forces.cable_set()
        cables = believed.cables
        if not real.has_pulleys():
            cables = cables.without_pulleys()
        if settings.perturbations.believed_robot is None:
            cables = replace(cables, stiffness=real.stiffness)
        learner = RecursiveCalibration(
            cables, believed.X_PC, believed.X_WP0, target.points, self.beforehand(),
            self.rules(float(np.sqrt(pinhole.fx * pinhole.fy))),
        )  # fmt: skip
        criterion = replace(
            servo_criterion(blocks, cables, settings.controller.pulleys), camera=believed.X_PC
        )
        block = GeometryLearner(
            self, learner, (target, pinhole), settings.camera.rate,
            latency_frames=settings.camera.latency_frames,
            believed=np.array([believed.cables.p_WA.T, believed.cables.p_PB.T]),
            judge=BeliefCheck(criterion, blocks.X_CdO), seed=settings.seed,
        )  # fmt: skip
        builder.AddNamedSystem(blocks.prefix + "geometry_learner", block)
        for port in ("X_CO", "found", target.mark):
            builder.Connect(blocks.measurement.GetOutputPort(port), block.GetInputPort(port))
        for port in ("measured_lengths", "measured_tensions"):
            builder.Connect(blocks.readings.port(port), block.GetInputPort(port))
        builder.Connect(blocks.estimator.GetOutputPort("X_WP"), block.GetInputPort("X_WP"))
        points = block.GetOutputPort(BELIEVED_POINTS)
        builder.Connect(points, blocks.servo.GetInputPort(BELIEVED_POINTS))
        return {name: block.GetOutputPort(name) for name in LOGGED}


def _obstacles(scenario: Any, robot: Robot) -> list[tuple[str, str]]:
    """What is found that does not go with a section, or nothing, and what does."""
    target, manager = scenario.target, scenario.tension_management
    kinds = (scenario.estimator.kind, *scenario.estimator.compare)
    counting = [kind for kind in kinds if kind.startswith(BY_LENGTHS)]
    encoder = scenario.sensors.rate("encoder")
    planned = [
        name
        for name in ("trajectory", "open_loop", "pose_plan", "remote", "stability")
        if getattr(scenario, name, None) is not None
    ]
    whole = robot.motion_type().is_free and len(robot.cables) >= 6
    images = 1.0 if encoder is None else encoder / scenario.camera.rate
    return [
        ("" if whole else f"{robot.name}, {robot.motion}, {len(robot.cables)} cables",
         "3R3T with at least 6 cables"),
        (f"pulleys at the platform of {robot.name}"
         if robot.cable_set().has_platform_pulleys() else "", "pulleys at the frame alone"),
        (f"several cables on a winch of {robot.name}"
         if robot.winch_groups().are_shared() else "", "a winch for each cable"),
        (f"cables.model {scenario.cables.model_of(robot)}"
         if CABLE_MODELS[scenario.cables.model_of(robot)].sags else "", "cables that do not sag"),
        ("" if target.kind == "tag" else f"target.kind {target.kind}", "tag"),
        ("" if scenario.target_rests() else "a target that moves", "one that rests in the world"),
        (f"estimators {', '.join(counting)}, which would go by the points of the start"
         if counting else "", "estimators that lengths do not enter"),
        (f"tension_management.kind {manager.kind}, which would go by the points of the start"
         if manager is not None and manager.kind in BY_MODEL else "",
         "null, constant, adaptive, by_length or image"),
        ("winches.mode torque" if scenario.winches.mode == "torque" else "",
         "velocity or position"),
        (f"section {planned[0]}" if planned else "", "none of it"),
        (f"controller.scheme {scenario.controller.scheme}, which the stability criterion does not "
         "judge" if not _is_judged(scenario) else "", "all six motions by one law"),
        (f"encoders at {encoder:g} Hz and images at {scenario.camera.rate:g} Hz"
         if abs(images - round(images)) > 1e-9 or images < 0.5 else "",
         "sensors.encoder_rate a multiple of camera.rate, so that both are of the same instant"),
    ]  # fmt: skip


def _is_judged(scenario: Any) -> bool:
    from cdpr_drake.systems.diagrams.controller import make_tasks  # which has scenarios

    if scenario.target.kind != "tag":
        return True  # said already
    tasks = make_tasks(scenario, scenario.target.target())
    partitioned = scenario.controller.scheme in ("partitioned", "switching")
    return tasks[-1].features.rank == 6 and not partitioned

"""Checks of a scenario that asks for fusion of sensors, or for a camera that fails."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.schema.declarations import Refusal, Scope
from cdpr_drake.systems.diagrams.fusion_models import is_asked_for, steers
from cdpr_drake.vision.target import PointTarget

if TYPE_CHECKING:
    pass


def fusion_refusals(scope: Scope) -> Iterator[Refusal]:
    """Sources that are not there, and cameras that are slower than asked."""
    scenario, robot, target = scope.whole, scope.robot, scope.whole.target
    tag, fusion = scenario.estimator.platform_tag, scenario.estimator.sensor_fusion
    mounts = {mount.name: mount for mount in robot.cameras}
    if tag is not None and tag.rate is not None and tag.mount in mounts:
        model = mounts[tag.mount].model
        fastest = load_camera(model).rate_hz
        if tag.rate > fastest:
            accepted = f"at most {fastest:g} [Hz], that of {model}"
            yield "estimator.platform_tag.rate", f"{tag.rate:g}", accepted
    if not is_asked_for(scenario) or any(target.refusals(scope)):
        return
    key = "estimator.sensor_fusion"
    if not (fusion.on_board or fusion.external or fusion.lengths):
        yield f"{key}.on_board", "no source", "on_board, external or lengths true"
    if robot.motion_type().freedom != 6:
        yield f"{key}.on_board", f"{robot.name}, which is planar", "a robot in space"
    for name, used in (("on_board", fusion.on_board), ("steer", steers(scenario))):
        if used and not scenario.target_rests():
            yield f"{key}.{name}", "true, but the target does not rest in the world", "false"
        elif used and not isinstance(target.target(), PointTarget):
            accepted = "false, or a target of points"
            yield f"{key}.{name}", f"true with target.kind {target.kind}", accepted
    if steers(scenario) and not fusion.on_board and fusion.told_object is None:
        found = "none, and nothing else tells where the target is"
        accepted = "what is known of it, on_board true, or steer false"
        yield f"{key}.told_object", found, accepted
    if fusion.external and tag is None:
        accepted = "false, or a tag on the platform"
        yield f"{key}.external", "true without estimator.platform_tag", accepted
    if fusion.imu and scenario.sensors.imu is None:
        yield f"{key}.imu", "true without sensors.imu", "false, or an IMU"
    for name in ("on_board", "external"):
        depth, doubt = getattr(fusion, f"{name}_depth"), getattr(fusion, f"{name}_doubt")
        if depth is not None and not getattr(fusion, name):
            yield f"{key}.{name}_depth", f"{depth} with {name} false", "null"
        for field in ("position", "rotation_deg"):
            told = getattr(fusion, f"{name}_{field}")
            if doubt is not None and getattr(doubt, field) <= told:
                accepted = f"more than {name}_{field}, which is {told:g}"
                yield f"{key}.{name}_doubt.{field}", f"{getattr(doubt, field):g}", accepted

"""A robot as calibrations model it, and a robot file of what was fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdpr_drake.analyses.fits.fit import fitted_robot
from cdpr_drake.analyses.fits.poses import schema_pose
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.errors import CalibrationError
from cdpr_drake.models.robot_schema import CameraMount, Robot


def calibration_model(robot: Robot, mount: str | None = None) -> CalibrationModel:
    """A robot as its file says, with the camera of a mounting, if one is named.

    Raises:
        CalibrationError: There is no such mounting on the platform.
    """
    model = CalibrationModel(tuple(cable.name for cable in robot.cables), robot.cable_set())
    if mount is None:
        return model
    return replace(model, X_PC=find_mount(robot, mount).pose.transform())


def find_mount(robot: Robot, name: str | None) -> CameraMount:
    """A camera on the platform by the name of its mounting; without a name the first.

    Raises:
        CalibrationError: There is none.
    """
    mounts = {mount.name: mount for mount in robot.cameras if mount.parent == "platform"}
    if not mounts and not name:
        raise CalibrationError(f"mount: found none on the platform of {robot.name}")
    name = name or next(iter(mounts))
    if name not in mounts:
        raise CalibrationError(
            f"mount: found {name!r}; accepted: {', '.join(mounts) or 'none'}, on the platform of "
            f"{robot.name}"
        )
    return mounts[name]


def calibrated_robot(
    robot: Robot, result: CalibrationResult, mount: str | None = None
) -> tuple[Robot, tuple[str, ...]]:
    """A robot with the fitted constants, and in words what its file has no place for.

    Args:
        robot: The robot as it was believed.
        result: Its calibration.
        mount: The camera's mounting that was calibrated.
    """
    model, moved = result.model, set(result.names)
    cables, stretch = [], model.common_length_scale
    for k, cable in enumerate(robot.cables):
        drum, pulley = cable.drum_radius, cable.pulley_radius
        if f"{cable.name}.drum_radius" in moved:
            drum = (robot.winch.drum_radius if drum is None else drum) + float(model.drum_radius[k])
        if f"{cable.name}.pulley_radius" in moved:
            pulley = float(model.cables.pulley_radius[k])
        cables.append(
            replace(
                cable,
                exit_point=cable.base_of(model.cables.p_WA[:, k]),
                anchor_point=np.array(model.cables.p_PB[:, k]),
                pulley_radius=pulley,
                drum_radius=None if drum is None else drum * stretch + model.common_drum_radius,
            )
        )
    cameras = [
        replace(camera, pose=schema_pose(model.X_PC))
        if camera.name == mount and camera.parent == "platform"
        else camera
        for camera in robot.cameras
    ]
    winch, left, scales = robot.winch, [], model.length_scale
    if any(name.endswith(".length_scale") for name in moved):
        mean = float(np.mean(scales))
        winch = replace(winch, drum_radius=winch.drum_radius * mean)
        left.append(
            f"drum radii: the file has one for all, their mean; each over it: "
            f"{', '.join(f'{s / mean:.5f}' for s in scales)}"
        )
    if "common_length_scale" in moved:
        winch = replace(winch, drum_radius=winch.drum_radius * stretch)
        left.append(
            f"the stretch of all lengths, {stretch:.6g}, is in the drum radii; that of a tape is "
            "none of the robot's: undo it there"
        )
    if model.common_drum_radius:
        winch = replace(winch, drum_radius=winch.drum_radius + model.common_drum_radius)
    for group in ("length_offset", "swivel_offset"):
        if any(name.endswith(group) for name in moved):
            left.append(f"{group.replace('_', ' ')}s belong to the log; they are in results.json")
    frames = [key for key in ("tracker", "marker") if any(n.startswith(f"{key}.") for n in moved)]
    if frames:
        left.append(f"the {' and the '.join(frames)} belong to the log; they are in results.json")
    if any(name == "clock" or name.startswith("tilt_zero.") for name in moved):
        left.append("zeros of tilts and the tracker's clock belong to the log, as well")
    changes = {"cables": cables, "cameras": cameras, "winch": winch}
    return fitted_robot(robot, "Calibrated", result.status, result.names, **changes), tuple(left)

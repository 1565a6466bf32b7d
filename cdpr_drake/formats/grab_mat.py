"""Robots of GRAB's tools as MATLAB files: a platform, and pulleys on the frame.

A structure with `EndEffector.Platform` (mass `m`, `PtoG`, `InertialMatrix` about G, `points` A_i in
P) and `Trasmission.Pulley` (radius `r`, `CableEnterPosition` D_i in W, `FixedFrame` with axes i, j,
k of the pulley in W), as the files spell it. The cable arrives along k, about which the pulley
turns; its swivel angle is atan2(j' DA, i' DA).

Source: github.com/fzoffoli/UACDPR_SelfCalibration, IRMA4U_Mar25.mat and its class
Pulley, ComputePulleyAngles.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.draft import DraftCable, RobotDraft
from cdpr_drake.formats.grab import GRAVITY
from cdpr_drake.models.foreign_text import fail, robot_name
from cdpr_drake.schema.input_files import file_size

TOOL = "GRAB MATLAB file"

MOST_BYTES = 1_000_000
"""Their robots have a kilobyte; logs are larger."""

_MAGIC = b"MATLAB 5.0 MAT-file"

_PARTS = ("EndEffector", "Trasmission")

_READ = {
    *_PARTS, "Platform", "m", "PtoG", "InertialMatrix", "points", "Pulley", "r",
    "CableEnterPosition", "FixedFrame",
}  # fmt: skip


def is_grab_mat(path: Path) -> bool:
    """Whether a file is a robot of these tools."""
    try:
        if path.suffix.lower() != ".mat" or path.stat().st_size > MOST_BYTES:
            return False
        return _robot(path) is not None
    except (OSError, RobotFileError):
        return False


def _robot(path: Path) -> Any:
    """The structure that is a robot; None where there is none; RobotFileError: no such file."""
    from scipy.io import loadmat

    try:
        file_size(path)
        with path.open("rb") as file:
            if file.read(len(_MAGIC)) != _MAGIC:
                return None
        content = loadmat(str(path), squeeze_me=True, struct_as_record=False)
    except Exception as problem:  # scipy raises of all kinds on damaged files
        words = " ".join(str(problem).split())[:160] or type(problem).__name__
        raise RobotFileError(f"{path}: cannot be read as a file of MATLAB: {words}") from problem
    return next((v for v in content.values() if all(hasattr(v, part) for part in _PARTS)), None)


def read_grab_mat(path: Path) -> RobotDraft:
    """Reads a robot of GRAB's MATLAB tools.

    Raises:
        RobotFileError: The file does not describe one; says where.
    """
    if path.stat().st_size > MOST_BYTES:
        raise fail(path, "size", f"{path.stat().st_size:,} bytes", f"at most {MOST_BYTES:,}")
    robot = _robot(path)
    if robot is None:
        raise fail(path, "variables", None, f"a structure with {' and '.join(_PARTS)}")
    platform = getattr(robot.EndEffector, "Platform", None)
    pulleys = np.atleast_1d(np.asarray(getattr(robot.Trasmission, "Pulley", []), object))
    points = list(np.atleast_1d(getattr(platform, "points", np.empty(0))))
    if not len(pulleys) or len(pulleys) != len(points):
        raise fail(
            path, "EndEffector.Platform.points", f"{len(points)} points, {len(pulleys)} pulleys",
            "one for each pulley",
        )  # fmt: skip
    mass = _numbers(path, "EndEffector.Platform.m", getattr(platform, "m", None), 1)[0]
    draft = RobotDraft(name=robot_name(path.stem), tool=TOOL, title=f"from {path.name}")
    draft.gravity, draft.mass = GRAVITY, float(mass)
    draft.center_of_mass = _numbers(
        path, "EndEffector.Platform.PtoG", getattr(platform, "PtoG", None), 3
    )
    inertia = _numbers(
        path, "EndEffector.Platform.InertialMatrix", getattr(platform, "InertialMatrix", None), 9
    ).reshape(3, 3)
    if not np.allclose(inertia, inertia.T, rtol=1e-6, atol=1e-9):
        raise fail(
            path, "EndEffector.Platform.InertialMatrix", inertia.tolist(), "a symmetric matrix"
        )
    draft.inertia = inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    for k, (pulley, point) in enumerate(zip(pulleys, points, strict=True)):
        where = f"Trasmission.Pulley({k + 1})"
        radius = float(_numbers(path, f"{where}.r", getattr(pulley, "r", None), 1)[0])
        if radius < 0.0:
            raise fail(path, f"{where}.r", radius, "at least 0 [m]")
        draft.cables.append(
            DraftCable(
                name=f"C{k + 1}",
                exit_point=_numbers(
                    path, f"{where}.CableEnterPosition",
                    getattr(pulley, "CableEnterPosition", None), 3,
                ),
                anchor_point=_numbers(path, f"EndEffector.Platform.points({k + 1})", point, 3),
                pulley_radius=radius,
                swivel_axis=_axis(path, f"{where}.FixedFrame", pulley),
            )
        )  # fmt: skip
    draft.motion = "3R3T"
    if len(draft.cables) < 6:
        draft.remarks.append(
            f"{len(draft.cables)} cables for 6 degrees of freedom: an underactuated robot."
        )
    rest = sorted(_fields(robot) - _READ)
    if rest:
        draft.remarks.append(f"Fields that were not kept: {', '.join(rest)}.")
    return draft


def _fields(value: Any) -> set[str]:
    """Names of all fields of a structure and of those in it."""
    if isinstance(value, np.ndarray) and value.dtype == object:
        return set().union(*map(_fields, value.ravel()))
    names = set(getattr(value, "_fieldnames", ()))
    return names.union(*(_fields(getattr(value, name)) for name in names))


def _axis(path: Path, where: str, pulley: Any) -> Array:
    """k, the last axis of a pulley's frame, shape (3,)."""
    frame = getattr(pulley, "FixedFrame", None)
    axes = list(np.atleast_1d(np.asarray(frame, object))) if frame is not None else []
    if len(axes) != 3:
        raise fail(path, where, f"{len(axes)} axes", "three axes i, j, k")
    rows = [_numbers(path, f"{where}({k + 1})", axis, 3) for k, axis in enumerate(axes)]
    if not np.allclose(np.array(rows) @ np.array(rows).T, np.eye(3), atol=1e-6):
        raise fail(path, where, np.array(rows).tolist(), "three unit vectors across each other")
    return rows[2]


def _numbers(path: Path, where: str, value: Any, count: int) -> Array:
    try:
        found = np.asarray(value, float).ravel()
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.size != count or not np.isfinite(found).all():
        raise fail(
            path, where, None if value is None else str(value)[:60], f"{count} finite numbers"
        )
    return found

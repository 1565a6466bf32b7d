"""Cameras as other tools calibrate them: `camera_info` of ROS, and OpenCV's FileStorage.

Source: ROS, sensor_msgs/CameraInfo and camera_calibration_parsers; OpenCV, calib3d, and its sample
calibration.cpp.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.foreign_text import read_text, read_xml
from cdpr_drake.schema.yaml_files import YamlTextError, load_yaml
from cdpr_drake.vision.lens_distortion import COEFFICIENTS

RATE = 30.0
"""Frame rate of a camera whose file has none [Hz]."""

KEYS = {
    "name": ("cameraname", "name"),
    "matrix": ("cameramatrix", "k", "intrinsicmatrix", "mtx"),
    "coefficients": (
        "distortioncoefficients", "distortioncoefficents", "distcoeffs", "d", "dist",
    ),
    "lens": ("distortionmodel", "cameramodel"),
    "fisheye": ("fisheyemodel",),
    "size": ("imagesize", "resolution"),
    "width": ("imagewidth", "width"),
    "height": ("imageheight", "height"),
}  # fmt: skip
"""Spellings of each key, in small letters and without what is neither letter nor digit."""

LENSES = {
    "plumbbob": "brown_conrady", "rationalpolynomial": "brown_conrady", "radtan": "brown_conrady",
    "pinhole": "brown_conrady", "equidistant": "fisheye", "fisheye": "fisheye",
}  # fmt: skip
"""Kinds of lenses by the names of other tools."""

BROWN_CONRADY_SIZES = (0, 5, 8, 12, 14)
"""Numbers of coefficients of which no other lens than OpenCV's usual one has as many."""


def read_calibration(path: Path) -> dict[str, Any] | None:
    """Fields of `camera_catalogue.Camera` that a file of another tool says.

    Args:
        path: YAML or XML file.

    Returns:
        The fields, with `distortion` as a mapping, or None without a lens; None if it is YAML
        without a camera matrix.

    Raises:
        RobotFileError: XML cannot be read, or a value is missing or not accepted; names the key.
    """
    if path.suffix.lower() == ".xml":
        content: Any = {element.tag: _xml_value(element) for element in read_xml(path)}
        if not _has_matrix(content):
            raise _refused(path, "camera_matrix", "none", "a calibration of OpenCV")
        return _fields(path, content)
    try:
        content = _yaml(read_text(path))
    except (RobotFileError, YamlTextError):
        return None  # the reader of our own files says why
    return _fields(path, content) if _has_matrix(content) else None


def _yaml(text: str) -> Any:
    """What YAML says, without a version, without tags of matrices, and up to its first end."""
    if "view_angle_horizontal_deg" in text:
        return None
    text = re.sub(r"^%YAML[: ].*$", "", text.replace("\r\n", "\n"), flags=re.MULTILINE)
    parts = re.split(r"^---.*$", text.replace("!!opencv-matrix", ""), flags=re.MULTILINE)
    return load_yaml(next((part for part in parts if part.strip()), ""))


def _xml_value(element: Any) -> Any:
    if len(element):
        return {child.tag: _xml_value(child) for child in element}
    words = (element.text or "").split()
    return words if len(words) > 1 else "".join(words)


def _has_matrix(content: object) -> bool:
    return isinstance(content, Mapping) and any(_plain(key) in KEYS["matrix"] for key in content)


def _fields(path: Path, content: Mapping[str, Any]) -> dict[str, Any]:
    spelled = {_plain(key): str(key) for key in content}
    keys = {
        what: next((spelled[word] for word in spellings if word in spelled), None)
        for what, spellings in KEYS.items()
    }
    values = {what: None if key is None else content[key] for what, key in keys.items()}
    matrix = _numbers(path, keys["matrix"] or "camera_matrix", values["matrix"])
    if len(matrix) != 9:
        raise _refused(path, keys["matrix"], f"{len(matrix)} numbers", "nine, row by row")
    fx, skew, cx, zero, fy, cy, *last = matrix.tolist()
    if not (fx > 0.0 and fy > 0.0) or skew != 0.0 or zero != 0.0 or last != [0.0, 0.0, 1.0]:
        raise _refused(path, keys["matrix"], f"{matrix.tolist()}",
                       "fx, 0, cx, 0, fy, cy, 0, 0, 1 with fx, fy > 0 [px]")  # fmt: skip
    width, height = _size(path, keys, values)
    if not (-0.5 < cx < width - 0.5 and -0.5 < cy < height - 0.5):
        raise _refused(path, keys["matrix"], f"a principal point ({cx:g}, {cy:g})",
                       f"one in the image of {width} x {height} pixels")  # fmt: skip
    half = 0.5 * np.array([width / fx, height / fy])
    horizontal, vertical = np.degrees(2.0 * np.arctan(half)).tolist()
    unused = [key for key in content if str(key) not in keys.values()]
    return {
        "name": str(values["name"] or path.stem), "title": "calibrated by another tool",
        "source": path.name, "width": width, "height": height,
        "view_angle_horizontal_deg": horizontal, "view_angle_vertical_deg": vertical,
        "rate_hz": RATE, "principal_point": np.array([cx, cy]),
        "distortion": _lens(path, keys, values),
        "assumptions": f"rate_hz: the file says none. Not used: {', '.join(map(str, unused))}.",
    }  # fmt: skip


def _lens(
    path: Path, keys: Mapping[str, str | None], values: Mapping[str, Any]
) -> dict[str, Any] | None:
    """Kind and coefficients of the lens; None without one."""
    given = values["coefficients"]
    found = np.zeros(0) if given in (None, "", []) else _numbers(path, keys["coefficients"], given)
    if not np.any(found):
        return None
    word = str(values["lens"] or "")
    kind = LENSES.get(_plain(word))
    if word and kind is None:
        raise _refused(path, keys["lens"], repr(word),
                       "plumb_bob, rational_polynomial, equidistant or fisheye")  # fmt: skip
    if _truth(values["fisheye"]):
        kind = "fisheye"
    elif kind is None and (values["fisheye"] is not None or len(found) in BROWN_CONRADY_SIZES):
        kind = "brown_conrady"
    if kind is None:
        raise _refused(path, "distortion_model", f"none with {len(found)} coefficients",
                       "plumb_bob for k1, k2, p1, p2, or equidistant for k1 to k4")  # fmt: skip
    names = COEFFICIENTS[kind]
    if np.any(found[len(names) :]):
        raise _refused(path, keys["coefficients"], f"{len(found)} numbers",
                       f"those of a {kind} lens, {', '.join(names)}, or 0 beyond")  # fmt: skip
    return {"kind": kind, **dict(zip(names, found.tolist(), strict=False))}


def _size(path: Path, keys: Mapping[str, str | None], values: Mapping[str, Any]) -> tuple[int, int]:
    """Width and height [px]."""
    given = [values["width"], values["height"]]
    if None in given:
        if values["size"] is None:
            raise _refused(path, "image_width, image_height", "none", "both [px]")
        given = list(_numbers(path, keys["size"], values["size"]))
    sizes = _numbers(path, keys["width"] or "image_size", given)
    if len(sizes) != 2 or np.any(sizes < 16) or np.any(sizes != np.round(sizes)):
        raise _refused(path, keys["width"] or keys["size"], f"{sizes.tolist()}",
                       "width and height, whole numbers from 16 on [px]")  # fmt: skip
    return int(sizes[0]), int(sizes[1])


def _numbers(path: Path, key: str | None, value: Any) -> Array:
    """Finite numbers of a list, of a list of rows, or of the `data` of a matrix, shape (n,)."""
    if isinstance(value, Mapping):
        value = value.get("data")
    try:
        found = np.asarray(value, float).ravel()
    except (TypeError, ValueError):
        found = np.array([np.nan])
    if not np.all(np.isfinite(found)):
        raise _refused(path, key, repr(value)[:60], "finite numbers")
    return found


def _truth(value: Any) -> bool:
    return str(value).strip().lower() in ("1", "true", "yes", "on")


def _plain(key: object) -> str:
    return re.sub(r"[^a-z0-9]", "", str(key).lower())


def _refused(path: Path, key: str | None, found: str, accepted: str) -> RobotFileError:
    return RobotFileError(f"{path}: {key}: found {found}; accepted: {accepted}")

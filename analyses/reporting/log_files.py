"""Writes the log, the effective scenario and the summary of a run of any kind."""

from __future__ import annotations

import csv
import json
import math
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.reporting.log_on_disk import Log, log_block
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.arrays import Array

_POSE = ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m")
_TWIST = ("wx_rad_s", "wy_rad_s", "wz_rad_s", "vx_m_s", "vy_m_s", "vz_m_s")
_ELLIPSE = (("u", "px"), ("v", "px"), ("n20_", "px2"), ("n11_", "px2"), ("n02_", "px2"))
_PARTS = {
    "platform_velocity": _TWIST,
    "found": ("flag",),
    "gain": ("per_s",),
    "servo_mode": ("image_flag", "switches", "l_pose", "l_image", "pose_bound", "image_bound"),
    "quality": ("deviation_px", "correlation", "share", "points", "followed"),
    "desired_wrench": ("mx_nm", "my_nm", "mz_nm", "fx_n", "fy_n", "fz_n"),
    "applied_wrench": ("mx_nm", "my_nm", "mz_nm", "fx_n", "fy_n", "fz_n"),
    "wrench_estimated": ("mx_nm", "my_nm", "mz_nm", "fx_n", "fy_n", "fz_n"),
    "displacement": ("rx_rad", "ry_rad", "rz_rad", "x_m", "y_m", "z_m"),
    "wrench_sigma": ("mx_nm", "my_nm", "mz_nm", "fx_n", "fy_n", "fz_n"),
    "wrench_skipped": ("no_pose", "no_direction"),
    "feasible": ("flag",),
    "failures": ("count",),
    "specific_force": ("x_m_s2", "y_m_s2", "z_m_s2"),
    "angular_velocity": ("x_rad_s", "y_rad_s", "z_rad_s"),
    "imu_biases": ("ax_m_s2", "ay_m_s2", "az_m_s2", "wx_rad_s", "wy_rad_s", "wz_rad_s"),
    "pan_tilt_angles": ("pan_rad", "tilt_rad"),
    "pan_tilt_encoders": ("pan_rad", "tilt_rad"),
    "camera_joints": ("pan_rad", "tilt_rad"),
    "camera_encoders": ("pan_rad", "tilt_rad"),
    "turned_found": ("flag",),
    "wheel_distances": ("left_m", "right_m"),
    "contact_force": ("x_n", "y_n", "z_n"),
    "contact_count": ("count",),
}
_PER_CABLE = {
    "cable_velocities": "m_s",
    "tensions": "n",
    "lengths": "m",
    "unstrained_lengths": "m",
    "slack": "flag",
    "surplus_lengths": "m",
    "measured_tensions": "n",
    "measured_lengths": "m",
    "tension_corrections": "m_s",
    "tension_thresholds": "n",
    "applied_torques": "nm",
    "friction_torques": "nm",
    "broken": "flag",
    "found_broken": "flag",
    "left_out": "flag",
    "break_residuals": "m",
}

ROWS_AT_ONCE = 2000
"""Rows of a log that are words at the same time: hours of them would not fit into memory."""

Parts = Mapping[str, Sequence[str]]
"""Names of the numbers of quantities, by the names of these."""

LogNames = tuple[Sequence[str], Sequence[str], Parts | None]
"""Of a kind of run: names of cables, of features, and of the numbers of further quantities."""


def column_names(
    log: Log, cables: Sequence[str], features: Sequence[str] = (), parts: Parts | None = None
) -> list[str]:
    """Names of the columns of `log.csv`, each ending in its unit, if it has one.

    Args:
        log: "time" and quantities by name, shape (n, size).
        cables: Names of the cables.
        features: Names of the features of a visual servo, for its error.
        parts: Names of the numbers of further quantities.
    """
    names, named = ["time_s"], {**_PARTS, **(parts or {})}
    for quantity in log:
        if quantity == "time":
            continue
        size = log_block(log, quantity, 0, 1).shape[1]
        if quantity in _PER_CABLE:
            own = tuple(f"{cable}_{_PER_CABLE[quantity]}" for cable in cables)
        elif quantity.startswith("scan_") or quantity == "depth_row":
            own = tuple(f"{k}_m" for k in range(size))
        elif quantity.startswith("X_"):
            own = _POSE
        elif quantity == "error":
            own = tuple(features)
        elif quantity in ("corners_px", "turned_corners_px"):
            own = tuple(f"{axis}{k}_px" for k in range(size // 2) for axis in "uv")
        elif quantity == "ellipses_px":
            own = tuple(f"{part}{k}_{unit}" for k in (0, 1) for part, unit in _ELLIPSE)
        else:
            own = tuple(named.get(quantity) or (str(k) for k in range(size)))
        assert len(own) == size
        names += [f"{quantity}.{part}" for part in own]
    return names


def log_columns(log: Log, names: LogNames) -> dict[str, Array]:
    """A log as columns by the names of `log.csv`, shape (n,) each."""
    rows = len(log["time"])
    table = np.column_stack([log_block(log, name, 0, rows) for name in log])
    return dict(zip(column_names(log, *names), table.T, strict=True))


def write_log(
    folder: Path,
    log: Log,
    cables: Sequence[str],
    features: Sequence[str] = (),
    parts: Parts | None = None,
) -> None:
    """Writes `log.npz` (one array per quantity) and `log.csv` (one column per number).

    One quantity, or some rows, are in memory at a time, if the log is on disk.
    """
    with (
        whole_file(folder / "log.npz") as part,
        zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as arrays,
    ):
        for name in log:  # as np.savez_compressed does, which wants all of them at once
            with arrays.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, log[name], allow_pickle=False)
    with (
        whole_file(folder / "log.csv") as part,
        part.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(column_names(log, cables, features, parts))
        for start in range(0, len(log["time"]), ROWS_AT_ONCE):
            stop = start + ROWS_AT_ONCE
            rows = [log_block(log, name, start, stop) for name in log]
            writer.writerows(np.column_stack(rows).tolist())


def write_scenario(path: Path, scenario: object) -> None:
    """Writes the scenario as it was run, overrides included, so that it can be run again."""
    write_whole(path, yaml_dump_typed(scenario))


def write_json(path: Path, found: dict[str, Any]) -> None:
    """Writes results for other programs; NaN is not accepted there, see `finite`.

    The file appears whole or not at all, see `write_whole`.
    """
    write_whole(path, json.dumps(found, indent=2, allow_nan=False) + "\n")


def write_whole(path: Path, words: str) -> None:
    """Writes a text file that appears whole or not at all; what was there before stays until then.

    Raises:
        OSError: It cannot be written, for instance on a full disk; nothing is left behind.
    """
    with whole_file(path) as part:
        part.write_text(words, encoding="utf-8")


def spread(values: Array) -> dict[str, float | None]:
    """Largest and mean of values, shape (n,); None where there are none."""
    if len(values) == 0:
        return {"max": None, "mean": None}
    return {"max": float(np.max(values)), "mean": float(np.mean(values))}


def finite(value: Any) -> Any:
    """A summary in which numbers that are not finite, as a diverged run leaves, are None."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value

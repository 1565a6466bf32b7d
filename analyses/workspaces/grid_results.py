"""Results over a grid of poses: their file, and the numbers of a region of it."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.sweeps.folder import store_arrays
from cdpr_drake.analyses.workspaces.grid_runs import ARRAYS
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume


def region_numbers(
    inside: np.ndarray, places: np.ndarray, axes: tuple[Array, Array, Array]
) -> dict[str, Any]:
    """Counts and volumes of a region for JSON.

    Args:
        inside: Which poses belong to it, shape (k, nx, ny, nz).
        places: Which positions do, shape (nx, ny, nz).
        axes: Coordinates along x, y, z [m].
    """
    volumes = [workspace_volume(places, axes, rule) for rule in VolumeRule]
    unit = volumes[0].unit.replace("^", "").replace("-", "1")
    return {
        "poses": int(np.count_nonzero(inside)),
        "of_poses": int(inside.size),
        "places": int(np.count_nonzero(places)),
        "of_places": int(places.size),
        **{f"{v.rule}_{unit}": v.value for v in volumes},
        **{f"{v.rule}_share": v.share for v in volumes},
    }


def save_grid(
    folder: Path, about: Mapping[str, Any], grid: WorkspaceGrid, arrays: Mapping[str, np.ndarray]
) -> Path:
    """Writes `workspace.npz` into a folder that exists, and returns its path.

    Args:
        folder: The folder.
        about: What the arrays were computed for, and by what, for JSON.
        grid: Their poses.
        arrays: By name.
    """
    path = folder / ARRAYS
    axes = dict(zip("xyz", grid.axes, strict=True))
    words = np.array(json.dumps(dict(about)))
    store_arrays(path, {"about": words, **axes, "angles": grid.angles, **arrays})
    return path


def load_grid(
    path: Path | str, needed: str, noun: str, command: str
) -> tuple[dict[str, Any], WorkspaceGrid, dict[str, np.ndarray]]:
    """Reads what `save_grid` wrote: about, grid, arrays.

    Args:
        path: The file, or its folder.
        needed: An array's name, or how it begins, without which it is a file of another kind.
        noun: What it should be, for the message.
        command: What writes such files, for the message.

    Raises:
        DataFileError: There is no such file, or it is not of that kind.
    """
    path = Path(path)
    path = path / ARRAYS if path.is_dir() else path
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays = {key: stored[key] for key in stored.files}
        about = load_json(str(arrays.pop("about")))
        x, y, z, angles = (arrays.pop(name) for name in ("x", "y", "z", "angles"))
        if not any(name.startswith(needed) for name in arrays):
            raise KeyError(needed)
        return about, WorkspaceGrid((x, y, z), angles), arrays
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as problem:
        raise DataFileError(
            f"{path}: found no stored {noun} ({type(problem).__name__}); accepted: {ARRAYS} of "
            f"{command}"
        ) from problem

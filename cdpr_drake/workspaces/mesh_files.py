"""Hulls and boxes as files for CAD, printers and ParaView, written by trimesh and meshio."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceError, accepted_names
from cdpr_drake.workspaces.hull import WorkspaceHull

GRID_ENDINGS = ("vtk", "vtu")
"""Files of VTK, which cells with numbers can be written to, and a hull as well."""

MESH_ENDINGS = ("glb", "obj", "ply", "stl", *GRID_ENDINGS)
"""Files that a hull can be written to."""

HEXAHEDRON = ((-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1),
              (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1))  # fmt: skip
"""Corners of a box in the order of VTK."""


def write_hull(hull: WorkspaceHull, path: Path) -> Path:
    """Writes the triangles, as the ending of the file says, one of `MESH_ENDINGS`.

    Raises:
        WorkspaceError: Another ending, or the library that writes it is not installed.
    """
    kind = mesh_ending(path, MESH_ENDINGS)
    if kind in GRID_ENDINGS:
        return _write_cells(path, hull.vertices, "triangle", hull.faces, {})
    import trimesh

    mesh = trimesh.Trimesh(hull.vertices, hull.faces, process=False)
    mesh.export(path, file_type=kind)
    return path


def write_cells(
    path: Path, middles: Array, halves: Array, numbers: Mapping[str, np.ndarray]
) -> Path:
    """Writes boxes with their faces along the axes as cells, one of `GRID_ENDINGS`.

    Args:
        path: The file.
        middles: Shape (k, 3) [m].
        halves: Half edges, shape (k, 3) [m].
        numbers: By name one for each box, shape (k,).

    Raises:
        WorkspaceError: Another ending, or meshio is not installed.
    """
    mesh_ending(path, GRID_ENDINGS)
    corners = middles[:, np.newaxis] + halves[:, np.newaxis] * np.array(HEXAHEDRON, float)
    points, number = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    cells = number.reshape(-1, len(HEXAHEDRON))
    return _write_cells(path, points, "hexahedron", cells, numbers)


def mesh_ending(path: Path, accepted: tuple[str, ...]) -> str:
    """The ending of a file, in small letters.

    Raises:
        WorkspaceError: It is not accepted, or the library that writes such files is not installed.
    """
    kind = path.suffix.lstrip(".").lower()
    if kind not in accepted:
        raise WorkspaceError(f"{path}: found the ending {kind!r}; {accepted_names(kind, accepted)}")
    library = "meshio" if kind in GRID_ENDINGS else "trimesh"
    if find_spec(library) is None:
        raise WorkspaceError(f"{path}: needs {library}; install cdpr_drake[mesh]")
    return kind


def _write_cells(
    path: Path, points: Array, shape: str, cells: np.ndarray, numbers: Mapping[str, np.ndarray]
) -> Path:
    import meshio

    data: dict[str, Any] = {name: [np.asarray(values)] for name, values in numbers.items()}
    mesh = meshio.Mesh(np.ascontiguousarray(points), [(shape, cells)], cell_data=data)
    mesh.write(path, binary=True)
    return path

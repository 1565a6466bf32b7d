"""Convex sets of poses, all of which are proven, with the graph of those that overlap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
import yaml
from pydrake.geometry.optimization import (
    HPolyhedron,
    LoadIrisRegionsYamlFile,
    SaveIrisRegionsYamlFile,
)
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from cdpr_drake.arrays import Array
from cdpr_drake.errors import DataFileError, WorkspaceError
from cdpr_drake.proofs.box_expansion_kernel import NUMBERS
from cdpr_drake.proofs.cuboid_cover import cover_cells
from cdpr_drake.proofs.cuboid_cover_kernel import overlapping_pairs
from cdpr_drake.proofs.proven_cells import SAME_NUMBER, ProvenCells
from cdpr_drake.schema.yaml_files import load_yaml

COVER = 0.97
"""Usual share of the proven cells that sets cover."""

NUMBER_NAMES = ("x", "y", "z", "phi", "theta", "psi")
"""Numbers of a pose; positions in m, angles in rad."""

REGIONS, ABOUT = "regions", "about"
"""Keys of the file: Drake's regions, and what they are of."""


@dataclass(frozen=True, eq=False)
class PoseSets:
    """Boxes of poses that may overlap; every pose in one of them is proven.

    Attributes:
        lower: Least position [m] and angles (phi, theta, psi) [rad] of each, shape (k, 6).
        upper: Largest, shape (k, 6).
        axes: Numbers of a pose that vary, shape (d,).
        about: Of what they are, for JSON: robot, kinds, limits, what was judged.
        cells: The raster that they were made of; None where they come from a file.
    """

    lower: Array
    upper: Array
    axes: np.ndarray
    about: Mapping[str, Any] = field(default_factory=dict)
    cells: ProvenCells | None = None

    def __post_init__(self) -> None:
        """Checks shapes and numbers.

        Raises:
            WorkspaceError: They do not fit.
        """
        low, high = self.lower, self.upper
        if low.shape != high.shape or low.ndim != 2 or low.shape[1] != NUMBERS or not len(low):
            raise WorkspaceError(
                f"proven sets: found shapes {low.shape}, {high.shape}; accepted: (k, {NUMBERS})"
            )
        if not np.all(np.isfinite(low) & np.isfinite(high) & (low <= high)):
            raise WorkspaceError("proven sets: accepted: finite numbers, lower <= upper [m, rad]")

    def __len__(self) -> int:
        """How many."""
        return len(self.lower)

    @cached_property
    def graph(self) -> np.ndarray:
        """Pairs of sets that share poses, wide along every number, shape (p, 2), sorted."""
        low, high = (np.ascontiguousarray(a[:, self.axes]) for a in (self.lower, self.upper))
        return np.asarray(overlapping_pairs(low, high, len(self.axes)))

    def containing(self, pose: Array) -> np.ndarray:
        """Numbers of the sets that hold a pose, shape (6,) [m, rad]."""
        pose = np.asarray(pose, float)
        fixed = np.setdiff1d(np.arange(NUMBERS), self.axes)
        slack = np.zeros(NUMBERS)
        slack[fixed] = SAME_NUMBER
        held = (self.lower - slack <= pose) & (pose <= self.upper + slack)
        return np.flatnonzero(np.all(held, axis=1))

    def covers(self, pose: Array) -> bool:
        """Whether a pose, shape (6,) [m, rad], lies in a set."""
        return len(self.containing(pose)) > 0

    def joined(self, first: Array, second: Array) -> bool:
        """Whether overlapping sets lead from one pose, shape (6,) [m, rad], to another."""
        n, pairs = len(self), self.graph
        edges = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
        _, parts = connected_components(edges, directed=False)
        ends = [set(parts[self.containing(pose)].tolist()) for pose in (first, second)]
        return bool(ends[0] & ends[1])

    def regions(self) -> list[HPolyhedron]:
        """The sets over the numbers that vary, for Drake's `GcsTrajectoryOptimization`."""
        return [
            HPolyhedron.MakeBox(low, high)
            for low, high in zip(self.lower[:, self.axes], self.upper[:, self.axes], strict=True)
        ]

    def save(self, path: Path) -> Path:
        """Writes regions as Drake's `LoadIrisRegionsYamlFile(path, "regions")` reads them.

        The key `about` of the same file says what they are of. The same sets give the same bytes.
        """
        names = [f"set_{number:05d}" for number in range(len(self))]
        SaveIrisRegionsYamlFile(path, dict(zip(names, self.regions(), strict=True)), REGIONS)
        told = {
            **self.about,
            "axes": [NUMBER_NAMES[axis] for axis in self.axes],
            "others_m_rad": {
                NUMBER_NAMES[axis]: float(self.lower[0, axis])
                for axis in range(NUMBERS)
                if axis not in self.axes
            },
        }
        with path.open("a", encoding="utf-8") as file:
            yaml.safe_dump({ABOUT: told}, file, sort_keys=True)
        return path

    @classmethod
    def load(cls, path: Path) -> Self:
        """Reads what `save` wrote.

        Raises:
            DataFileError: There is no such file, or it is damaged; names it.
        """
        if not path.is_file():
            raise DataFileError(f"{path}: there is no such file of proven sets")
        try:
            told = path.read_text(encoding="utf-8").rpartition(f"\n{ABOUT}:")[2]  # at the end
            about = dict(load_yaml(f"{ABOUT}:{told}")[ABOUT])
            axes = np.array([NUMBER_NAMES.index(name) for name in about.pop("axes")])
            others = about.pop("others_m_rad")
            found = LoadIrisRegionsYamlFile(path, REGIONS)
            ends = np.array([found[name].b() for name in sorted(found)])
            rows = np.concatenate([np.eye(len(axes)), -np.eye(len(axes))])
            if not all(np.array_equal(one.A(), rows) for one in found.values()):
                raise ValueError("a region that is no box")
            fixed = [NUMBER_NAMES.index(name) for name in others]
            if sorted([*fixed, *axes.tolist()]) != list(range(NUMBERS)):
                raise ValueError(f"axes {', '.join(NUMBER_NAMES[a] for a in axes)}")
            lower, upper = np.zeros((len(ends), NUMBERS)), np.zeros((len(ends), NUMBERS))
            lower[:, fixed] = upper[:, fixed] = list(others.values())
            upper[:, axes], lower[:, axes] = np.split(ends, [len(axes)], axis=1)
            lower[:, axes] *= -1.0
            return cls(lower, upper, axes, about)
        except (RuntimeError, ValueError, KeyError, TypeError) as problem:
            words = " ".join(str(problem).split())
            raise DataFileError(
                f"{path}: found {words}; accepted: a file of proven sets, regions and about"
            ) from problem


def sets_of_cells(
    cells: ProvenCells, cover: float = COVER, must: Sequence[Array] = ()
) -> tuple[Array, Array, np.ndarray]:
    """Merges proven cells to boxes, see `cuboid_cover.cover_cells`.

    Args:
        cells: The cells.
        cover: Share of them that the boxes cover.
        must: Poses that they cover in any case, shape (6,) each [m, rad]; in proven cells.

    Returns:
        Lower and upper ends, shape (k, 6) [m, rad], and the cuboids of cells, shape (k, 2, d).

    Raises:
        WorkspaceError: No cell is proven, or not the one of a pose; a share is not accepted.
    """
    held = []
    for pose in must:
        near = cells.cells_at(pose)
        near = near[cells.inside[tuple(near.T)]]
        if not len(near):
            raise WorkspaceError("must: found a pose in no proven cell; accepted: proven ones")
        held.append(near[0])
    found = cover_cells(cells.inside, cover, np.array(held, np.int64))
    lower = np.repeat(cells.box.lower[np.newaxis], len(found), axis=0)
    upper = np.repeat(cells.box.upper[np.newaxis], len(found), axis=0)
    lower[:, cells.axes], upper[:, cells.axes] = cells.edges(found[:, 0]), cells.edges(found[:, 1])
    return lower, upper, found

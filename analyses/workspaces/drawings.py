"""All ways in which a workspace was drawn, and their files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.reporting import whole_file
from cdpr_drake.analyses.workspaces.boxes import (
    BoxSearch,
    agreement_numbers,
    agreements,
    box_numbers,
    save_boxes,
    write_boxes,
)
from cdpr_drake.analyses.workspaces.regions import HullBound, hull_numbers, save_hull
from cdpr_drake.analyses.workspaces.results import RobotWorkspace
from cdpr_drake.workspaces import CertifiedBoxes, WorkspaceHull, write_hull


@dataclass(frozen=True, eq=False)
class WorkspaceDrawings:
    """A workspace as grid, hull and boxes.

    Attributes:
        workspace: The grid.
        hull: The hull; None: it was not asked for.
        boxes: The boxes; None: they were not asked for.
        bound: What bounded the hull; None: unknown.
        search: What was cut into boxes; None: unknown.
    """

    workspace: RobotWorkspace
    hull: WorkspaceHull | None = None
    boxes: CertifiedBoxes | None = None
    bound: HullBound | None = None
    search: BoxSearch | None = None

    def as_dict(self) -> dict[str, Any]:
        """Numbers of all for JSON, and whether they say the same."""
        told = self.workspace.as_dict()
        if self.hull is not None:
            told["hull"] = hull_numbers(self.hull, self.bound)
        if self.boxes is not None:
            told["certified"] = box_numbers(self.boxes, self.search)
            found = agreements(self.workspace, self.hull, self.boxes)
            told["agreement"] = agreement_numbers(found)
        return told

    def write(
        self, folder: Path, mesh: Path | None = None, boxes_mesh: Path | None = None
    ) -> dict[str, Any]:
        """Writes hull and boxes into a folder that exists, and to further files; the numbers.

        Raises:
            WorkspaceError: A further file cannot be written by what is installed.
        """
        if self.hull is not None:
            save_hull(self.hull, folder)
            if mesh is not None:
                with whole_file(mesh) as part:
                    write_hull(self.hull, part)
        if self.boxes is not None:
            save_boxes(self.boxes, folder)
            if boxes_mesh is not None:
                with whole_file(boxes_mesh) as part:
                    write_boxes(self.boxes, part)
        return self.as_dict()

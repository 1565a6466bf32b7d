"""The static workspace that follows a robot while somebody changes it.

While a point moves it is coarse, and of several robots the newest counts. When nothing has moved
for a while it is computed again, finer, some poses at a time, so that whoever goes on does not
wait. The numbers are those of `cdpr workspace` of the robot's file with as many poses: kind static,
a level platform, a grid in the box of the frame.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.calculator import Calculator, Signal

if TYPE_CHECKING:  # what computes is imported at the first sketch
    from cdpr_drake.studio.scene import RobotScene
    from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
    from cdpr_drake.workspaces.volume import WorkspaceVolume

REST, LONGEST_REST = 0.5, 2.0
"""Time without a change after which a workspace is refined [s]: twice as long as between the last
two changes, but in these bounds. A slow browser tells of the hand that moves twice a second only.
"""

COARSE, FINE = 1_000, 20_000
"""About so many poses while a point moves, and when it rests: a few and some tens of
milliseconds."""

PIECE = 4_000
"""Poses at a time, about 15 ms: so much longer waits who moves on."""

IN_NO_FILE = ""
"""Name of a robot that is in no catalogue: its grid is in the box of its frame."""


@dataclass(frozen=True, eq=False)
class WorkspaceSketch:
    """A static workspace on a grid.

    Attributes:
        counts: Points of the grid along x, y, z.
        volume: Of the cells whose corners are all inside.
        solid: Vertices, shape (n, 3) [m], and triangles, shape (k, 3); None: it is empty, or the
            robot moves along a line.
    """

    counts: tuple[int, int, int]
    volume: WorkspaceVolume
    solid: tuple[Array, np.ndarray] | None


def sketch_workspace(
    robot: Robot, poses: int, at_once: int | None = None
) -> Iterator[WorkspaceSketch | None]:
    """A sketch of about so many poses, judged `at_once` poses for each item; the last item is it.

    Raises:
        CdprError: The robot has no static workspace.
    """
    from cdpr_drake.analyses.workspaces.robot_conditions import static_case
    from cdpr_drake.workspaces.static_feasibility import statically_feasible
    from cdpr_drake.workspaces.volume import (
        VolumeRule,
        surface_quads,
        triangles,
        workspace_volume,
    )

    case, grid = static_case(robot, pulleys=True), sketch_grid(robot, poses)
    inside = np.zeros(grid.size, bool)
    step = at_once or grid.size
    for start in range(0, grid.size, step):
        if start:
            yield None
        stop = min(start + step, grid.size)
        inside[start:stop] = statically_feasible(
            case, grid.positions(start, stop), grid.rotations(start, stop)
        )
    places = inside.reshape(grid.shape[1:])
    vertices, faces = triangles(surface_quads(places, grid.axes))
    yield WorkspaceSketch(
        grid.shape[1:], workspace_volume(places, grid.axes, VolumeRule.CORNERS),
        (vertices, faces) if len(faces) else None,
    )  # fmt: skip


def sketch_grid(robot: Robot, poses: int) -> WorkspaceGrid:
    """A grid of about so many poses, as far apart along x as along y and z, in a robot's frame."""
    from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
    from cdpr_drake.workspaces.pose_grid import grid_by_count

    defaults = workspace_defaults(robot, IN_NO_FILE)
    size = defaults.upper - defaults.lower
    moving = size > 0.0
    step = (float(np.prod(size[moving])) / poses) ** (1.0 / max(int(np.count_nonzero(moving)), 1))
    counts = np.where(moving, np.maximum(np.round(size / step), 2.0), 1.0).astype(int)
    return grid_by_count(defaults.lower, defaults.upper, counts.tolist())


class LiveWorkspace:
    """What a session sees of the workspace of the robot that it changes.

    Attributes:
        sketch: The workspace as it is drawn; None: there is none.
        is_fine: True if it has been refined.
        problem: Why the robot has none; empty: it has, or nobody asked.
        is_wanted: True if it is computed and drawn.
        changed: Called when any of these has changed.
    """

    def __init__(self, calculator: Calculator, scene: Callable[[], RobotScene]) -> None:
        """With the calculator and the scene, which is asked for in its thread only."""
        self._calculator, self._scene = calculator, scene
        self.sketch: WorkspaceSketch | None = None
        self.is_fine, self.problem, self.is_wanted = False, "", True
        self.changed = Signal()
        self._is_cold = True
        self._robot: Robot | None = None
        self._computed: tuple[Robot, WorkspaceSketch | None, str] | None = None
        self._refining: asyncio.Task[None] | None = None
        self._followed, self._between = 0.0, 0.0  # when, and how long after the one before [s]

    def want(self, wanted: bool) -> None:
        """Computes and draws it from now on, or takes it out of the scene."""
        self.is_wanted = wanted
        self._calculator.run(lambda: self.draw(self._scene()), lambda _: self.take())

    def follow(self, robot: Robot | None) -> None:
        """Is about a robot from now on, at the next `draw`; None: about none."""
        if self._refining is not None:
            self._refining.cancel()
        now = time.monotonic()
        self._followed, self._between = now, now - self._followed
        self._robot = robot

    def compute(self) -> None:
        """Computes the coarse workspace of the newest robot; in the calculator's thread."""
        robot = self._robot if self.is_wanted else None
        if robot is None:
            self._computed = None
        elif self._computed is None or self._computed[0] is not robot:
            try:
                self._computed = robot, next(sketch_workspace(robot, COARSE)), ""
            except CdprError as problem:
                self._computed = robot, None, str(problem)

    def draw(self, scene: RobotScene) -> None:
        """Draws the coarse workspace of the newest robot; in the calculator's thread."""
        self.compute()
        sketch = None if self._computed is None else self._computed[1]
        scene.show_workspace(None if sketch is None else sketch.solid)

    def take(self) -> None:
        """Tells what was drawn, and refines it after a rest; in the thread of the page."""
        robot, sketch, problem = self._computed or (None, None, "")
        if self._is_cold:
            self._is_cold = False
            self._calculator.submit(self._warm)
        if (sketch, problem) == (self.sketch, self.problem):
            return
        self.sketch, self.problem, self.is_fine = sketch, problem, False
        self.changed.emit()
        if self._refining is not None:
            self._refining.cancel()
        if robot is not None and sketch is not None:
            with suppress(RuntimeError):  # who has no event loop asks for it
                loop = asyncio.get_running_loop()
                self._refining = loop.create_task(self.refine(self._rest()))

    def _rest(self) -> float:
        """Time to wait for more changes [s]."""
        twice = 2.0 * self._between
        return twice if REST < twice < LONGEST_REST else REST

    def _warm(self) -> None:
        """Has kernels loaded, or compiled at the first use, before somebody drags."""
        robot = self._scene().robot
        if robot is not None:
            with suppress(CdprError):
                next(sketch_workspace(robot, COARSE, 1))

    async def refine(self, rest: float = 0.0) -> None:
        """Computes a finer workspace of the robot after a rest [s], unless it changes meanwhile."""
        await asyncio.sleep(rest)
        robot = self._robot
        if robot is None or self.sketch is None:
            return
        pieces = sketch_workspace(robot, FINE, PIECE)

        def piece() -> WorkspaceSketch | None:
            if robot is not self._robot or not self.is_wanted:
                return None  # a change cannot stop a thread
            sketch = next(pieces)
            if sketch is not None:
                self._computed = robot, sketch, ""
                self._scene().show_workspace(sketch.solid)
            return sketch

        while robot is self._robot and self.is_wanted:
            sketch = await self._calculator.result(piece)
            if sketch is not None:
                self.sketch, self.is_fine = sketch, True
                self.changed.emit()
                return

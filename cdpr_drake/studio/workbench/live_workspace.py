"""The static workspace that follows a robot while somebody changes it.

While a point moves it is coarse, and of several robots that were asked about the newest counts.
When nothing has moved for a while it is computed again, finer, some poses at a time, so that
whoever goes on is not kept waiting.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.workbench.calculator import Signal

if TYPE_CHECKING:
    from cdpr_drake.studio.workbench.scene import RobotScene
    from cdpr_drake.studio.workbench.workspace_sketch import SketchWork, WorkspaceSketch

REST, LONGEST_REST = 0.5, 2.0
"""Time without a change after which a workspace is refined [s]: twice as long as between the last
two changes, but in these bounds. A slow browser tells of the hand that moves twice a second only.
"""

COARSE, FINE = 1_000, 20_000
"""About so many poses while a point moves, and when it rests: a few and some tens of
milliseconds."""

PIECE = 4_000
"""Poses at a time, about 15 ms: so much longer waits who moves on."""

Calculate = Callable[[Callable[[], Any], Callable[[Future[Any]], None]], None]
"""Does some work in the calculator's thread, and calls the second with its future."""


def sketch_work(robot: Robot, poses: int) -> SketchWork:
    """A sketch of about so many poses in the making; what computes is imported at the first one.

    Raises:
        CdprError: The robot has no static workspace.
    """
    from cdpr_drake.studio.workbench.workspace_sketch import SketchWork

    return SketchWork(robot, poses)


class LiveWorkspace:
    """What a session sees of the workspace of the robot that it changes.

    Attributes:
        sketch: The workspace as it is drawn; None: there is none.
        is_fine: Whether it has been refined.
        problem: Why the robot has none; empty: it has, or nobody asked.
        changed: Called when any of these has changed.
    """

    def __init__(self, calculate: Calculate, scene: Callable[[], RobotScene]) -> None:
        """With the calculator's thread and the scene, which is asked for there only."""
        self._calculate, self._scene = calculate, scene
        self.sketch: WorkspaceSketch | None = None
        self.is_fine, self.problem = False, ""
        self.changed = Signal()
        self._wanted, self._is_cold = True, True
        self._robot: Robot | None = None
        self._found: tuple[Robot, WorkspaceSketch | None, str] | None = None
        self._rest: asyncio.TimerHandle | None = None
        self._followed, self._between = 0.0, 0.0  # when, and how long after the one before [s]

    @property
    def is_wanted(self) -> bool:
        """Whether it is computed and drawn."""
        return self._wanted

    def want(self, wanted: bool) -> None:
        """Computes and draws it from now on, or takes it out of the scene."""
        self._wanted = wanted
        self._calculate(lambda: self.draw(self._scene()), lambda _: self.take())

    def follow(self, robot: Robot | None) -> None:
        """Is about a robot from now on, at the next `draw`; None: about none."""
        if self._rest is not None:
            self._rest.cancel()
        now = time.monotonic()
        self._followed, self._between = now, now - self._followed
        self._robot = robot

    def compute(self) -> None:
        """Computes the coarse workspace of the newest robot; in the calculator's thread."""
        robot = self._robot if self._wanted else None
        if robot is None:
            self._found = None
        elif self._found is None or self._found[0] is not robot:
            try:
                self._found = robot, sketch_work(robot, COARSE).go_on(2 * COARSE), ""
            except CdprError as problem:
                self._found = robot, None, str(problem)

    def draw(self, scene: RobotScene) -> None:
        """Draws the coarse workspace of the newest robot; in the calculator's thread."""
        self.compute()
        sketch = None if self._found is None else self._found[1]
        scene.show_workspace(None if sketch is None else sketch.solid)

    def take(self) -> None:
        """Tells what was drawn, and refines it after a rest; in the thread of the page."""
        robot, sketch, problem = self._found or (None, None, "")
        if self._is_cold:
            self._warm()
        if (sketch, problem) == (self.sketch, self.problem):
            return
        self.sketch, self.problem, self.is_fine = sketch, problem, False
        self.changed.emit()
        if self._rest is not None:
            self._rest.cancel()
        if robot is None or sketch is None:
            return
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            return  # who has no event loop asks for it
        twice = 2.0 * self._between
        self._rest = loop.call_later(twice if REST < twice < LONGEST_REST else REST, self.refine)

    def _warm(self) -> None:
        """Has kernels loaded, or compiled at the first use, before somebody drags."""
        self._is_cold = False
        scene = self._scene

        def load() -> None:
            robot = scene().robot
            with suppress(CdprError):
                if robot is not None:
                    sketch_work(robot, COARSE).go_on(1)

        self._calculate(load, lambda _: None)

    def refine(self) -> None:
        """Computes a finer workspace of the robot, unless it changes meanwhile."""
        robot = self._robot
        if robot is None or self.sketch is None:
            return
        work = sketch_work(robot, FINE)

        def piece() -> WorkspaceSketch | None:
            if robot is not self._robot or not self._wanted:
                return None
            sketch = work.go_on(PIECE)
            if sketch is not None:
                self._found = robot, sketch, ""
                self._scene().show_workspace(sketch.solid)
            return sketch

        def go_on(future: Future[WorkspaceSketch | None]) -> None:
            if robot is not self._robot or not self._wanted:
                return
            sketch = future.result()
            if sketch is None:
                self._calculate(piece, go_on)
                return
            self.sketch, self.is_fine = sketch, True
            self.changed.emit()

        self._calculate(piece, go_on)

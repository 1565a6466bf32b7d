"""What one browser session works on: a robot, its file, a pose, and what is known there."""

from __future__ import annotations

import asyncio
import copy
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.file_kinds import is_foreign
from cdpr_drake.models.robot_loader import robot_file, robot_names, robot_text
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.calculator import Calculator, Signal
from cdpr_drake.studio.document import Document
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.jobs import JobManager
from cdpr_drake.studio.live_workspace import LiveWorkspace
from cdpr_drake.studio.pose_answer import (
    USUAL_METHOD,
    PoseAnswer,
    RobotQuestions,
    axis_values,
    pose_at,
)
from cdpr_drake.studio.results import Results, Subject, subject_of
from cdpr_drake.studio.robot_files import OpenedRobot, RobotFiles
from cdpr_drake.studio.workbench.command_form import CommandForm
from cdpr_drake.studio.yaml_edit import with_value

if TYPE_CHECKING:  # it takes a second of the start
    from cdpr_drake.studio.scene import Draw, RobotScene

USUAL_ROBOT = "acrobot_large"

POSE_NUMBERS = "pose-numbers"
"""Name of the result that is what is known at the pose."""

LATE = 0.5
"""Time after which numbers that are of the pose before, or the robot before, are called so [s]."""

TELL = 0.1
"""Time by which the numbers are behind the scene while a point is dragged [s]: a browser builds
the page anew for each change of it, and would draw the scene only after that.
"""


class Workbench:
    """What one browser session works on; its tabs show the same.

    Attributes:
        folder: Where files are read and written.
        calculator: The thread for numbers and scenes, that of the server.
        files: Reads robots.
        robot: The robot's document.
        coordinates: Of the platform's pose, as `pose_axes` has them [m, deg].
        X_WP: The pose.
        method: How tensions are distributed, a name of `tensions.METHODS`.
        reference: Desired tension for methods that need one [N].
        answer: What is known about the robot at a pose; None: nothing yet.
        problem: Why there is no answer, which is a mistake of this program; None: there is one.
        is_computing: True while the answer is computed.
        answered: Called when there is another answer or problem.
        scenario: Name or path of the scenario that is worked with; empty: none was chosen.
        panel: Name of the panel that was shown last.
        dark: Whether the page is dark; None: as the browser likes it.
        jobs: Work in processes of its own, the same for all sessions of a server.
        results: What is shown of results, and what each is about.
        drawn: What the scene shows in the place of the robot; None: the robot.
        live: The static workspace that follows the robot while it is changed.
        questions: What asks about the robot as it is now.
    """

    def __init__(
        self, folder: WorkingFolder, robot: str = USUAL_ROBOT, scenario: str = "", *,
        calculator: Calculator | None = None, jobs: JobManager | None = None,
        commands: Callable[[], Mapping[str, CommandForm]] = dict,
    ) -> None:  # fmt: skip
        """With a robot of the package or the path of a file, and perhaps a scenario.

        `commands` makes the forms of commands; it is asked at their first use.

        Raises:
            CdprError: There is no such robot, or it is not accepted.
        """
        self.folder = folder
        self.calculator = calculator or Calculator()
        where = robot_file(robot).resolve()
        self.files = RobotFiles(folder, where.parent)
        self.robot: Document[Robot] = Document(
            robot_text(robot, "the studio"), where, self.files.read
        )
        self._texts: dict[Path, str] = {}  # of robot files
        if where.is_file() and not is_foreign(where):  # of which a name with rails has another text
            self._texts[where] = where.read_text(encoding="utf-8")
        self._assumed: dict[Path, list[str]] = {}
        self.method = USUAL_METHOD
        self.reference: float | None = None
        self.answer: PoseAnswer | None = None
        self.problem: BaseException | None = None
        self.is_computing = False
        self.answered = Signal()
        self.scenario, self.panel = scenario, ""
        self.dark: bool | None = None
        self.jobs = JobManager() if jobs is None else jobs
        self._make_commands = commands
        self.results = Results(lambda: self.subject)
        self.drawn: Subject | None = None
        self._busy = self._again = self.is_dragged = False
        self._answering: asyncio.Task[None] | None = None
        self._telling: asyncio.TimerHandle | None = None
        self._scene: RobotScene | None = None
        self._opened: Future[str] | None = None
        self.live = LiveWorkspace(self.calculator, self.scene)
        self._take_robot(self.robot.value)
        self.go_home()
        self.robot.changed.connect(self._robot_changed)

    @cached_property
    def commands(self) -> Mapping[str, CommandForm]:
        """Forms of the commands that there are, by name."""
        return self._make_commands()

    @property
    def subject(self) -> Subject:
        """The robot and the pose that are open: what a result should be about."""
        pose = tuple(float(value) for value in pose_row(self.X_WP))
        return replace(self._about, pose=pose)

    @property
    def file(self) -> str:
        """Name of the robot's file in the folder; empty: it has none yet."""
        path = self.robot.path
        own = path in self._texts and path.is_relative_to(self.folder.root)
        return self.folder.shown(path) if own else ""

    @property
    def is_saved(self) -> bool:
        """Whether the robot's file has the robot as it is."""
        return self._texts.get(self.robot.path) == self.robot.text

    @property
    def command_name(self) -> str:
        """By which commands know the robot as it is, in the folder; empty: they do not."""
        if not self.is_saved:
            return ""
        name = self.robot.value.name
        shipped = name in robot_names() and self.robot.path == robot_file(name).resolve()
        return name if shipped else self.file

    @property
    def state(self) -> str:
        """How the robot stands to its file, in a word or two."""
        if self.file:
            return "saved" if self.is_saved else "edited, not saved"
        return "of the package" if self.command_name else "not saved"

    @property
    def assumed(self) -> list[str]:
        """What was assumed of the robot when another tool's file was read, a sentence each."""
        return self._assumed.get(self.robot.path, [])

    def forget_assumed(self) -> None:
        """Says no more what was assumed, once somebody has read it."""
        self._assumed.pop(self.robot.path, None)
        self.robot.changed.emit()

    def open(self, name: str) -> OpenedRobot:
        """Works with a robot of the package, or with a file of the folder.

        Raises:
            CdprError: It is not accepted; nothing has changed.
        """
        return self.take_opened(self.files.open(name))

    def upload(self, files: Mapping[str, bytes]) -> OpenedRobot:
        """Works with a robot from uploaded files, which has no file in the folder yet.

        Raises:
            CdprError: It is not accepted; nothing has changed.
        """
        return self.take_upload(self.files.upload(files))

    def take_opened(self, opened: OpenedRobot) -> OpenedRobot:
        """Works with what `files.open` has read, which another thread may do."""
        if not opened.notes and opened.path.is_file():
            self._texts[opened.path] = opened.text
        return self._take(opened)

    def take_upload(self, opened: OpenedRobot) -> OpenedRobot:
        """Works with what `files.upload` has read, which another thread may do."""
        self._texts.pop(opened.path, None)
        return self._take(opened)

    def _take(self, opened: OpenedRobot) -> OpenedRobot:
        if opened.notes:
            self._assumed[opened.path] = opened.notes
        self.robot.change(opened.text, opened.path)
        return opened

    def save(self, name: str, overwrite: bool) -> None:
        """Writes the robot's file into the folder.

        Raises:
            CdprError: The name is not accepted, the file is there already, or cannot be written.
        """
        if not name.lower().endswith((".yaml", ".yml")):
            raise CdprError(f"name: found {name[:80]!r}; accepted: one that ends in .yaml")
        path, text = self.folder.path(name), self.robot.text
        self.files.read(text, path)  # it may name files that are not there
        self.folder.write(name, text, overwrite or name == self.file)
        self._texts[path] = text
        if self.assumed:
            self._assumed[path] = self.assumed
        self.robot.belongs_to(path)

    def drag_point(self, kind: str, number: int, p_W: Array, done: bool) -> str:
        """Moves a point of a cable: for the numbers only, or in the document when it is let go.

        Args:
            kind: `exit` or `anchor`.
            number: Number of the cable.
            p_W: Where it is, shape (3,) [m].
            done: Whether it was let go.

        Returns:
            Why it cannot be there, once it is let go; empty: it can.
        """
        self.is_dragged = not done
        robot = copy.deepcopy(self.robot.value)
        cable = robot.cables[number]
        p = cable.base_of(p_W) if kind == "exit" else self.X_WP.inverse().multiply(p_W)
        p = np.round(p, 4) + 0.0
        if not done:
            setattr(cable, f"{kind}_point", p)
            self._take_robot(robot)
            self.live.follow(robot)
            self.ask()
            return ""
        place = ("cables", number, f"{kind}_point")
        try:
            self.robot.change(with_value(self.robot.text, place, p.tolist()))
        except CdprError as problem:
            self._robot_changed()
            return "\n".join(self.robot.words(problem))
        return ""

    def _take_robot(self, robot: Robot) -> None:
        self.questions, self._about = RobotQuestions(robot), subject_of(robot)

    def _robot_changed(self) -> None:
        before, robot = self.questions.robot, self.robot.value
        self._take_robot(robot)
        self.live.follow(robot if robot.name == before.name else None)
        if robot.name != before.name or robot.motion != before.motion or self._is_outside():
            self.go_home()
        self.ask()

    def _is_outside(self) -> bool:
        """Whether the platform is where the robot as it is now cannot be."""
        p, (lower, upper) = self.X_WP.translation(), self.robot.value.frame.bounds()
        near = self.robot.value.joint().nearest(self.X_WP)
        return bool(
            np.any(p < lower) or np.any(p > upper) or not near.IsNearlyEqualTo(self.X_WP, 1e-6)
        )

    def go_home(self) -> None:
        """Puts the platform to the robot's home pose, without asking about it."""
        self.X_WP: RigidTransform = self.robot.value.home.transform()
        self.coordinates = axis_values(self.robot.value, self.X_WP)

    def move_to(self, coordinates: Sequence[float]) -> None:
        """Moves the platform to coordinates as `pose_axes` has them, and asks about that pose."""
        self.is_dragged = False  # also where a browser went away with a point in its hand
        self.coordinates = [float(value) for value in coordinates]
        self.X_WP = pose_at(self.robot.value, self.coordinates)
        self.ask()

    def ask(self) -> None:
        """Asks what there is to know; `answered` tells. Of several questions the last counts.

        Without an event loop it waits for the answer.
        """
        self._again = self.is_computing = True
        self.results.wait_for(POSE_NUMBERS)
        self.results.changed.emit()
        if self._busy:
            return
        self._busy = True
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            asyncio.run(self._answer_all())
            if self._telling is not None:
                self._tell()
        else:
            self._answering = loop.create_task(self._answer_all())

    async def _answer_all(self) -> None:
        """Answers until nobody has asked again meanwhile."""
        loop = asyncio.get_running_loop()
        try:
            while self._again:
                self._again = False
                late = loop.call_later(LATE, self.results.end_wait, POSE_NUMBERS)
                try:
                    await self._answer()
                finally:
                    late.cancel()
        finally:
            self._busy = self.is_computing = False
            self.results.end_wait(POSE_NUMBERS)

    async def _answer(self) -> None:
        """Tells the numbers first and draws then; of what is dragged it draws first."""
        questions, X_WP = self.questions, self.X_WP
        at_pose = partial(questions.at, X_WP, self.method, self.reference)
        tensions = np.full(len(questions.robot.cables), np.nan)
        try:
            answer = await self.calculator.result(at_pose)
            self.answer, self.problem, tensions = answer, None, answer.tensions
            self.is_computing = self._again
            self.results.show(POSE_NUMBERS, subject_of(answer.robot, X_WP))
            if not self.is_dragged:
                self.answered.emit()
        except Exception as problem:  # the robot is drawn all the same, with grey cables
            self.problem = problem
        try:
            await self.calculator.result(lambda: self._show(questions.robot, X_WP, tensions))
        except Exception as problem:
            self.problem = problem
        if self.problem is not None:
            self.is_computing = self._again
            self.answered.emit()
        elif not self.is_dragged:
            self.live.take()
        elif self._telling is None:
            self._telling = asyncio.get_running_loop().call_later(TELL, self._tell)

    def _show(self, robot: Robot, X_WP: RigidTransform, tensions: Array) -> None:
        """Draws a robot and its workspace; in the calculator's thread.

        All is computed before: what comes to the browser at once is one picture there, not two.
        """
        self.live.compute()
        self.scene().show(robot, X_WP, tensions)
        self.live.draw(self.scene())

    def _tell(self) -> None:
        """Tells what there is to know about what is dragged."""
        self._telling = None
        self.live.take()
        self.answered.emit()

    def draws(self, subject: Subject | None) -> None:
        """Says that the scene shows another robot than the one that is open; None: that one."""
        if self.drawn != subject:
            self.drawn = subject
            self.results.changed.emit()

    def draw(self, draw: Draw, done: Callable[[Future[Any]], Any] | None = None) -> None:
        """Draws into the scene, in the calculator's thread; `done` as for `Calculator.run`."""
        self.calculator.run(lambda: draw(self.scene()), done)

    def scene(self) -> RobotScene:
        """The scene, made at the first call; for the calculator's thread only."""
        if self._scene is None:
            from cdpr_drake.studio.scene import RobotScene

            self._scene = RobotScene()
        return self._scene

    def scene_address(self) -> Future[str]:
        """Path of the socket behind which the scene is; the server relays it to the page.

        The robot is drawn there first, with grey cables: what is known of it may have to wait for
        kernels that are compiled.
        """
        if self._opened is None:
            robot, X_WP = self.robot.value, self.X_WP

            def open_scene() -> str:
                scene = self.scene()
                scene.show(robot, X_WP, np.full(len(robot.cables), np.nan))
                return scene.door

            self._opened = self.calculator.submit(open_scene)
        return self._opened

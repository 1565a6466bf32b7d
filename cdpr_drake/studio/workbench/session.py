"""What one browser session works on."""

from __future__ import annotations

import asyncio
import copy
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
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
from cdpr_drake.studio.jobs import JobManager
from cdpr_drake.studio.results import Results, Subject, subject_of
from cdpr_drake.studio.workbench.calculator import Calculator, Signal
from cdpr_drake.studio.workbench.command_form import CommandForm
from cdpr_drake.studio.workbench.document import Document
from cdpr_drake.studio.workbench.live_workspace import LiveWorkspace
from cdpr_drake.studio.workbench.pose_answer import USUAL_METHOD, PoseAnswer
from cdpr_drake.studio.workbench.pose_axes import axis_values, pose_at
from cdpr_drake.studio.workbench.robot_files import OpenedRobot, RobotFiles
from cdpr_drake.studio.workbench.robot_questions import RobotQuestions
from cdpr_drake.studio.workbench.working_folder import WorkingFolder
from cdpr_drake.studio.workbench.yaml_edit import with_value

if TYPE_CHECKING:  # it takes a second of the start
    from cdpr_drake.studio.workbench.scene import Draw, RobotScene

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
        reference: Wanted tension for methods that need one [N].
        answer: What is known about the robot at a pose; None: nothing yet.
        problem: Why there is no answer, which is a mistake of this program; None: there is one.
        answered: Called when there is another answer or problem.
        scenario: Name or path of the scenario that is worked with; empty: none was chosen.
        panel: Name of the panel that was shown last.
        dark: Whether the page is dark; None: as the browser likes it.
        jobs: Work in processes of its own, the same for all sessions of a server.
        results: What is shown of results, and what each is about.
        drawn: What the scene shows in the place of the robot; None: the robot.
        live: The static workspace that follows the robot while it is changed.
    """

    def __init__(
        self,
        folder: WorkingFolder,
        robot: str = USUAL_ROBOT,
        scenario: str = "",
        *,
        calculator: Calculator | None = None,
        jobs: JobManager | None = None,
        commands: Callable[[], Mapping[str, CommandForm]] = dict,
    ) -> None:
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
        self._saved: dict[Path, str] = {}
        self._assumed: dict[Path, list[str]] = {}
        self._shipped: dict[Path, str] = {}
        if robot in robot_names() or Path(robot).is_file():  # not with rails that the name moves
            self._keep_shipped(where, self.robot.text)
        is_own = where.is_relative_to(folder.root) and where.is_file() and not is_foreign(where)
        if is_own:  # with rails that the name moves, the text is not that of the file
            self._saved[where] = where.read_text(encoding="utf-8")
        self.method = USUAL_METHOD
        self.reference: float | None = None
        self.answer: PoseAnswer | None = None
        self.problem: BaseException | None = None
        self.answered = Signal()
        self.scenario = scenario
        self.panel = ""
        self.dark: bool | None = None
        self.jobs = JobManager() if jobs is None else jobs
        self._make_commands = commands
        self.coordinates: list[float] = []
        self.X_WP: RigidTransform = self.robot.value.home.transform()
        self._questions = RobotQuestions(self.robot.value)
        self._about = subject_of(self.robot.value)
        self.results = Results(lambda: self.subject)
        self.drawn: Subject | None = None
        self._busy = self._wanted = self._dragged = False
        self._late: asyncio.TimerHandle | None = None
        self._telling: asyncio.TimerHandle | None = None
        self._scene: RobotScene | None = None
        self._opened: Future[str] | None = None
        self.live = LiveWorkspace(self.calculator.run, self.scene)
        self.go_home()
        self.robot.changed.connect(self._robot_changed)

    @cached_property
    def commands(self) -> Mapping[str, CommandForm]:
        """Forms of the commands that there are, by name."""
        return self._make_commands()

    @property
    def file(self) -> str:
        """Name of the robot's file in the folder; empty: it has none yet."""
        path = self.robot.path
        return self.folder.shown(path) if path in self._saved else ""

    @property
    def subject(self) -> Subject:
        """The robot and the pose that are open: what a result should be about."""
        pose = tuple(float(value) for value in pose_row(self.X_WP))
        return replace(self._about, pose=pose)

    def draws(self, subject: Subject | None) -> None:
        """Says that the scene shows another robot than the one that is open; None: that one."""
        if self.drawn != subject:
            self.drawn = subject
            self.results.changed.emit()

    @property
    def is_saved(self) -> bool:
        """Whether the robot's file has the robot as it is."""
        return self._saved.get(self.robot.path) == self.robot.text

    @property
    def assumed(self) -> list[str]:
        """What was assumed of the robot when another tool's file was read, a sentence each."""
        return self._assumed.get(self.robot.path, [])

    def forget_assumed(self) -> None:
        """Says no more what was assumed, once somebody has read it."""
        self._assumed.pop(self.robot.path, None)
        self.robot.changed.emit()

    @property
    def state(self) -> str:
        """How the robot stands to its file, in a word or two."""
        if self.file:
            return "saved" if self.is_saved else "edited, not saved"
        if self.command_name:
            return "of the package"
        return "not saved"

    @property
    def command_name(self) -> str:
        """By which commands know the robot as it is, in the folder; empty: they do not."""
        name = self.robot.value.name
        if name in robot_names() and self.robot.path == robot_file(name).resolve():
            return name if self.robot.text == self._shipped.get(self.robot.path) else ""
        return self.file if self.is_saved else ""

    def _keep_shipped(self, path: Path, text: str) -> None:
        """Remembers what a file of the package says, where it is one."""
        if any(path == robot_file(name).resolve() for name in robot_names()):
            self._shipped[path] = text

    def open(self, name: str) -> OpenedRobot:
        """Works with a robot of the package, or with a file of the folder.

        Raises:
            CdprError: It is not accepted; nothing has changed.
        """
        return self.take_opened(self.files.open(name))

    def take_opened(self, opened: OpenedRobot) -> OpenedRobot:
        """Works with what `files.open` has read, which another thread may do."""
        self._keep_shipped(opened.path, opened.text)
        own = opened.path.is_relative_to(self.folder.root) and opened.path.is_file()
        if own and not opened.notes:
            self._saved[opened.path] = opened.text
        self._take_opened(opened)
        return opened

    def _take_opened(self, opened: OpenedRobot) -> None:
        if opened.notes:
            self._assumed[opened.path] = opened.notes
        self.robot.change(opened.text, opened.path)

    def upload(self, files: Mapping[str, bytes]) -> OpenedRobot:
        """Works with a robot from uploaded files, which has no file in the folder yet.

        Raises:
            CdprError: It is not accepted; nothing has changed.
        """
        return self.take_upload(self.files.upload(files))

    def take_upload(self, opened: OpenedRobot) -> OpenedRobot:
        """Works with what `files.upload` has read, which another thread may do."""
        self._saved.pop(opened.path, None)
        self._take_opened(opened)
        return opened

    def save(self, name: str, overwrite: bool) -> None:
        """Writes the robot's file into the folder.

        Raises:
            CdprError: The name is not accepted, the file is there already, or cannot be written.
        """
        if not name.lower().endswith((".yaml", ".yml")):
            raise CdprError(f"name: found {name[:80]!r}; accepted: one that ends in .yaml")
        path = self.folder.path(name)
        self.files.read(self.robot.text, path)  # it may name files that are not there
        text = self.robot.text
        self.folder.write(name, text, overwrite or name == self.file)
        self._saved[path] = text
        if self.assumed:
            self._assumed[path] = self.assumed
        self.robot.belongs_to(path)

    def go_home(self) -> None:
        """Puts the platform to the robot's home pose, without asking about it."""
        robot = self.robot.value
        self.X_WP = robot.home.transform()
        self.coordinates = axis_values(robot, self.X_WP)

    def move_to(self, coordinates: Sequence[float]) -> None:
        """Moves the platform to coordinates as `pose_axes` has them, and asks about that pose."""
        self._dragged = False  # also where a browser went away with a point in its hand
        self.coordinates = [float(value) for value in coordinates]
        self.X_WP = pose_at(self.robot.value, self.coordinates)
        self.ask()

    def ask(self) -> None:
        """Asks what there is to know; `answered` tells. Of several questions the last counts."""
        self.results.wait_for(POSE_NUMBERS)
        self.results.changed.emit()
        if self._busy:
            self._wanted = True
            return
        self._busy, self._wanted = True, False
        questions, X_WP, method, reference = (
            self._questions, self.X_WP, self.method, self.reference
        )  # fmt: skip
        with suppress(RuntimeError):  # without an event loop the answer is there before
            loop = asyncio.get_running_loop()
            self._late = loop.call_later(LATE, self.results.end_wait, POSE_NUMBERS)
        self._calculate(lambda: questions.at(X_WP, method, reference), self._take)

    def _calculate(self, work: Callable[[], Any], done: Callable[[Future[Any]], None]) -> None:
        """What is part of an answer: what cannot be begun ends it."""
        try:
            self.calculator.run(work, done)
        except Exception:
            self._busy = False
            raise

    def _take(self, future: Future[PoseAnswer]) -> None:
        """Tells the numbers first and draws then; of what is dragged it draws first."""
        self.problem = future.exception()
        if self.problem is not None:  # the robot is drawn all the same, with grey cables
            robot, X_WP = self._questions.robot, self.X_WP
            unknown = np.full(len(robot.cables), np.nan)
            self._calculate(lambda: self._show(robot, X_WP, unknown), lambda _: self._end())
            return
        answer = self.answer = future.result()
        self.results.show(POSE_NUMBERS, subject_of(answer.robot, answer.X_WP))
        if not self._dragged:
            self.answered.emit()
        X_WP, tensions = answer.X_WP, answer.tensions
        self._calculate(lambda: self._show(answer.robot, X_WP, tensions), self._drawn)

    def _show(self, robot: Robot, X_WP: RigidTransform, tensions: Array) -> None:
        """Draws a robot and its workspace; in the calculator's thread.

        All is computed before: what comes to the browser at once is one picture there, not two.
        """
        self.live.compute()
        self.scene().show(robot, X_WP, tensions)
        self.live.draw(self.scene())

    def _drawn(self, future: Future[Any]) -> None:
        self.problem = future.exception()
        if not self._dragged:
            self.live.take()
        elif self._telling is None:
            try:
                self._telling = asyncio.get_running_loop().call_later(TELL, self._tell)
            except RuntimeError:  # who has no event loop waits for nothing
                self._tell()
        self._end(self.problem is not None)

    def _tell(self) -> None:
        """Tells what there is to know about what is dragged."""
        self._telling = None
        self.live.take()
        self.answered.emit()

    def _end(self, tell: bool = True) -> None:
        self._busy = False
        if self._late is not None:
            self._late.cancel()
        if tell:
            self.answered.emit()
        if self._wanted:
            self.ask()
        else:
            self.results.end_wait(POSE_NUMBERS)

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
        self._dragged = not done
        robot = copy.deepcopy(self.robot.value)
        cable = robot.cables[number]
        p = p_W if kind == "exit" else self.X_WP.inverse().multiply(p_W)
        p = np.round(p if kind == "anchor" else cable.base_of(p), 4) + 0.0
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

    @property
    def questions(self) -> RobotQuestions:
        """What asks about the robot as it is now."""
        return self._questions

    def _take_robot(self, robot: Robot) -> None:
        self._questions, self._about = RobotQuestions(robot), subject_of(robot)

    def _robot_changed(self) -> None:
        before, robot = self._questions.robot, self.robot.value
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

    def draw(self, draw: Draw, done: Callable[[Future[Any]], Any] | None = None) -> None:
        """Draws into the scene, in the calculator's thread; `done` as for `Calculator.run`."""
        self.calculator.run(lambda: draw(self.scene()), done)

    def scene(self) -> RobotScene:
        """The scene, made at the first call; for the calculator's thread only."""
        if self._scene is None:
            from cdpr_drake.studio.workbench.scene import RobotScene

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

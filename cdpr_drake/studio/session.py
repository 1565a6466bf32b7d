"""What one browser session works on: a robot, its file, a pose, and what is known there.

Kernels are compiled under one lock, a minute long at the first use, and Drake's Meshcat takes calls
only from the thread that made it. All of that happens in one thread, that of the `calculator`, so
that the server's, which answers pages, never waits for it.
"""

from __future__ import annotations

import asyncio
import copy
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from nicegui import Event
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.models.file_kinds import is_foreign
from cdpr_drake.models.robot_loader import robot_file, robot_names, robot_text
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.document import Document, with_value
from cdpr_drake.studio.files import OpenedRobot, RobotFiles, WorkingFolder
from cdpr_drake.studio.jobs import JobManager
from cdpr_drake.studio.live_workspace import COARSE, LiveWorkspace, sketch_workspace
from cdpr_drake.studio.pose_answer import USUAL_METHOD, PoseAnswer, RobotQuestions
from cdpr_drake.studio.results import Results, Subject
from cdpr_drake.studio.verb_form import Verb

if TYPE_CHECKING:  # it takes a second of the start
    from cdpr_drake.studio.scene import Draw, RobotScene

T = TypeVar("T")

USUAL_ROBOT = "acrobot_large"

POSE_NUMBERS = "pose-numbers"
"""Name of the result that is what is known at the pose."""

LATE = 0.5
"""Time after which numbers that are of the pose before, or the robot before, are called so [s]."""

TELL = 0.2
"""Time by which the numbers are behind the scene while a point is dragged [s]: a browser builds
the page anew for each change of it, and would draw the scene only after that.
"""


class Workbench:
    """What one browser session works on; its tabs show the same.

    Attributes:
        coordinates: Of the platform's pose, as `RobotQuestions` has them [m, deg].
        method: How tensions are distributed, a name of `tensions.METHODS`.
        reference: Desired tension for methods that need one [N].
        answer: What is known about the robot at a pose; None: nothing yet.
        problem: Why there is no answer, which is a mistake of this program; None: there is one.
        is_computing: True until what was asked last is answered.
        is_dragged: True while a point of the robot is in a hand.
        scenario: Name or path of the scenario that is worked with; empty: none was chosen.
        dark: Whether the page is dark; None: as the browser likes it.
        drawn: What the scene shows in the place of the robot; None: the robot.
    """

    def __init__(
        self, folder: WorkingFolder, robot: str = USUAL_ROBOT, scenario: str = "", *,
        calculator: ThreadPoolExecutor | None = None, jobs: JobManager | None = None,
        commands: Callable[[], Mapping[str, Verb]] = dict,
    ) -> None:  # fmt: skip
        """With a robot of the package or the path of a file, and perhaps a scenario.

        `commands` makes the forms of commands; it is asked at their first use.

        Raises:
            CdprError: There is no such robot, or it is not accepted.
        """
        self.folder, self.scenario, self.panel = folder, scenario, ""
        self.calculator = calculator or ThreadPoolExecutor(1)
        self.jobs = JobManager() if jobs is None else jobs
        self._make_commands = commands
        self._kept: dict[Any, Any] = {}
        path = robot_file(robot).resolve()
        self.files = RobotFiles(folder, path.parent)
        self.robot: Document[Robot] = Document(
            robot_text(robot, "the studio"), path, self.files.read
        )
        self._opened: dict[Path, OpenedRobot] = {}
        if path.is_file() and not is_foreign(path):  # of which a name with rails has another text
            own = folder.shown(path) if path.is_relative_to(folder.root) else ""
            name = robot if robot in robot_names() else own
            text = path.read_text(encoding="utf-8")
            self._opened[path] = OpenedRobot(text, path, [], name)
        self.method = USUAL_METHOD
        self.reference: float | None = None
        self.answer: PoseAnswer | None = None
        self.problem: BaseException | None = None
        self.answered = Event[[]]()
        self.is_computing = self.is_dragged = False
        self.dark: bool | None = None
        self.results = Results(lambda: self.subject)
        self.drawn: Subject | None = None
        self._question: Callable[[], PoseAnswer] | None = None
        self._telling: asyncio.TimerHandle | None = None
        self._scene: RobotScene | None = None
        self.live = LiveWorkspace(self.draw)
        self.questions = RobotQuestions(self.robot.value)
        self.go_home()
        self.robot.changed.subscribe(lambda: self._take(self.robot.value))

    def kept(self, kind: Callable[[Workbench], T]) -> T:
        """What the session keeps of a kind, made of the workbench at the first call."""
        if kind not in self._kept:
            self._kept[kind] = kind(self)
        return self._kept[kind]

    @cached_property
    def commands(self) -> Mapping[str, Verb]:
        """Forms of the commands that there are, by name."""
        return self._make_commands()

    @property
    def subject(self) -> Subject:
        """The robot and the pose that are open: what a result should be about."""
        return self.questions.subject.at(self.X_WP)

    @property
    def _file(self) -> OpenedRobot:
        """What was read or written last where the robot stands."""
        path = self.robot.path
        return self._opened.get(path, OpenedRobot("", path, []))

    @property
    def file(self) -> str:
        """Name of the robot's file in the folder; empty: it has none yet."""
        return "" if self._file.name in robot_names() else self._file.name

    @property
    def command_name(self) -> str:
        """By which commands know the robot as it is, in the folder; empty: they do not."""
        return self._file.name if self._file.text == self.robot.text else ""

    @property
    def state(self) -> str:
        """How the robot stands to its file, in a word or two."""
        if self.file:
            return "saved" if self.command_name else "edited, not saved"
        return "of the package" if self.command_name else "not saved"

    @property
    def assumed(self) -> list[str]:
        """What was assumed of the robot when another tool's file was read, a sentence each."""
        return self._file.notes

    def forget_assumed(self) -> None:
        """Says no more what was assumed, once somebody has read it."""
        self._opened[self.robot.path] = replace(self._file, notes=[])
        self.robot.changed.emit()

    def take_opened(self, opened: OpenedRobot) -> None:
        """Works with what `files` has read, perhaps in another thread."""
        self._opened[opened.path] = opened
        self.robot.change(opened.text, opened.path)

    async def save(self, name: str, overwrite: bool) -> None:
        """Writes the robot's file into the folder, and works with that.

        Raises:
            CdprError: The name is not accepted, the file is there already, or cannot be written.
        """
        if not name.lower().endswith((".yaml", ".yml")):
            raise CdprError(f"name: found {name[:80]!r}; accepted: one that ends in .yaml")
        text, overwrite = self.robot.text, overwrite or name == self.file

        def write() -> Path:
            path = self.folder.path(name)
            self.files.read(text, path)  # it may name files that are not there
            return self.folder.write(name, text, overwrite)

        path = await asyncio.to_thread(write)
        self._opened[path] = OpenedRobot(text, path, self.assumed, self.folder.shown(path))
        self.robot.belongs_to(path)

    def drag_point(self, kind: str, number: int, p_W: Array, done: bool) -> None:
        """Moves the exit or anchor point of a cable to p_W, shape (3,) [m].

        That is for the numbers only, or in the document once it is let go (`done`).

        Raises:
            CdprError: It cannot be there.
        """
        self.is_dragged = not done
        robot = copy.deepcopy(self.robot.value)
        cable, name = robot.cables[number], f"{kind}_point"
        p = cable.base_of(p_W) if kind == "exit" else self.X_WP.inverse().multiply(p_W)
        p = np.round(p, 4) + 0.0
        try:
            if done:
                place = "cables", number, name
                self.robot.change(with_value(self.robot.text, place, p.tolist()))
            else:
                setattr(cable, name, p)
                self._take(robot)
        except CdprError as problem:
            self._take(self.robot.value)
            raise CdprError("\n".join(self.robot.words(problem))) from problem

    def _take(self, robot: Robot) -> None:
        """Asks about another robot, or the same one after a change."""
        before, self.questions = self.questions.robot, RobotQuestions(robot)
        self.live.follow(robot if robot.name == before.name else None)
        if robot.name != before.name or robot.motion != before.motion:
            self.go_home()
        else:
            self._put_to(self.coordinates)
            p, (lower, upper) = self.X_WP.translation(), robot.frame.bounds()
            if np.any((p < lower) | (p > upper)):
                self.go_home()
        self.ask()

    def _put_to(self, coordinates: Sequence[float]) -> None:
        self.coordinates = [float(value) for value in coordinates]
        self.X_WP = self.questions.pose(self.coordinates)

    def go_home(self) -> None:
        """Puts the platform to the robot's home pose, without asking about it."""
        self._put_to(self.questions.coordinates(self.questions.robot.home.transform()))

    def move_to(self, coordinates: Sequence[float]) -> None:
        """Moves the platform to coordinates, as `RobotQuestions` has them, and asks there."""
        self.is_dragged = False  # also where a browser went away with a point in its hand
        self._put_to(coordinates)
        self.ask()

    def ask(self) -> None:
        """Asks what there is to know, and draws it; `answered` tells, of several the last."""
        place = self.X_WP, self.method, self.reference
        self._question = partial(self._answer, self.questions, *place)
        if not self.is_computing:
            self._go_on()
        self.results.changed.emit()

    def _go_on(self) -> None:
        """Has the newest question answered; those before it are dropped."""
        question, self._question = self._question, None
        self.is_computing = question is not None
        if question is not None:
            self.results.wait_for(POSE_NUMBERS, LATE)
            self.calculate(question, self._answer_came)

    def _answer(
        self, questions: RobotQuestions, X_WP: RigidTransform, method: str, reference: float | None
    ) -> PoseAnswer:
        """Answers, and draws the robot in any case; in the calculator's thread."""
        tensions = np.full(len(questions.robot.cables), np.nan)
        try:
            answer = PoseAnswer(questions, X_WP, method, reference)
            tensions = answer.tensions
        finally:
            # All is computed before: what comes to the browser at once is one picture, not two.
            self.live.compute()
            self.scene().show(questions.robot, X_WP, tensions)
            self.live.draw(self.scene())
        return answer

    def _answer_came(self, future: asyncio.Future[PoseAnswer]) -> None:
        self._go_on()
        self.problem = future.exception()
        if self.problem is None:
            if self.answer is None:  # so that kernels are there before somebody drags
                self.calculator.submit(partial(sketch_workspace, self.robot.value, COARSE))
            self.answer = future.result()
            self.results.show(POSE_NUMBERS, self.answer.subject)
        if not self.is_dragged:
            self._tell()
        elif self._telling is None:
            self._telling = asyncio.get_running_loop().call_later(TELL, self._tell)

    def _tell(self) -> None:
        """Tells what there is to know, of what is dragged less often than it is drawn."""
        self._telling = None
        self.live.take()
        self.answered.emit()

    def draws(self, subject: Subject | None) -> None:
        """Says that the scene shows another robot than the one that is open; None: that one."""
        if self.drawn != subject:
            self.drawn = subject
            self.results.changed.emit()

    def draw(self, draw: Draw, done: Callable[[asyncio.Future[Any]], Any] | None = None) -> None:
        """Draws into the scene, see `calculate`."""
        self.calculate(lambda: draw(self.scene()), done)

    def calculate(
        self, work: Callable[[], T], done: Callable[[asyncio.Future[T]], Any] | None = None
    ) -> None:
        """Works in the calculator's thread; `done` gets the future in the event loop."""
        future = asyncio.get_running_loop().run_in_executor(self.calculator, work)
        if done is not None:  # the server is not ending
            future.add_done_callback(lambda future: future.cancelled() or done(future))

    def scene(self) -> RobotScene:
        """The scene, made at the first call; for the calculator's thread only."""
        if self._scene is None:
            from cdpr_drake.studio.scene import RobotScene

            self._scene = RobotScene()
        return self._scene

    @cached_property
    def scene_address(self) -> Future[str]:
        """Path of the socket behind which the scene is; the server relays it to the page.

        The robot is drawn there first, with grey cables: kernels may have to be compiled.
        """
        robot, X_WP = self.questions.robot, self.X_WP

        def open_scene() -> str:
            self.scene().show(robot, X_WP, np.full(len(robot.cables), np.nan))
            return self.scene().door

        return self.calculator.submit(open_scene)

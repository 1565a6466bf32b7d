"""Runs as a page shows them, live (`RunJob`) or finished (`FinishedRun`) alike, and their board.

Both have `scenario`, and its robot as `subject`; `charts`, the time `end` [s], and `samples` as in
`analyses.runs.steering`; `outcome` (running, converged, ...); and `at(time)`.
"""

from __future__ import annotations

import asyncio
import math
import socket
import zipfile
import zlib
from asyncio import Future
from collections.abc import Mapping, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Any

import numpy as np
from nicegui import run
from pydrake.geometry import Meshcat

from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.runs.samples import MarksPicture, shown_limits
from cdpr_drake.analyses.runs.steering import Message, receive, send
from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.geometry.poses import pose_from_row, pose_rows_distance
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import nth_look
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.typed_yaml import plain_value
from cdpr_drake.studio.boards import Board, Entry
from cdpr_drake.studio.jobs import Job, JobState
from cdpr_drake.studio.plots import Chart, charts_of
from cdpr_drake.studio.results import Subject, subject_of
from cdpr_drake.studio.scenario import ScenarioDraft
from cdpr_drake.studio.scene import WORKSPACE, RobotScene, look_at_robot
from cdpr_drake.studio.session import Workbench
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import ServoModel, servo_model
from cdpr_drake.systems.robots.settings import CableSettings
from cdpr_drake.systems.scenarios.files import check_moves_robot
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

RUNS = "runs"
"""Folder of results in the working folder, as that of `cdpr simulate`."""

SPEEDS: dict[str, float | None] = {
    "x 0.1": 0.1, "x 0.5": 0.5, "real time": 1.0, "x 2": 2.0, "x 5": 5.0, "x 20": 20.0,
    "as fast as possible": None,
}  # fmt: skip
"""Speeds that are offered, as factors of real time."""

MOST_SAMPLES = 3000
"""Samples of a run that are kept, or rows of a log, evenly spread."""

LOG, SUMMARY, SCENARIO = "log.npz", "summary.json", "scenario.yaml"

READING = "reading the log"

PATHS = ("visualizer", "cables", "studio", WORKSPACE)
"""What is taken out of a scene before a run's robot is put there."""

Sample = dict[str, Any]


class RunJob(Job):
    """`cdpr simulate` of one scenario, with the same results as that command alone would write.

    Attributes:
        scenario: The scenario, if who began it has read it; `subject` likewise.
        header: What it said at its beginning, see `analyses.runs.steering`; empty before.
        samples: What it has shown so far, thinned where it is much, the newest the last.
        events: What was done to it by hand, or refused, see `analyses.runs.steering`.
        pace: If it is paused, and its speed, as it said last.
    """

    def __init__(
        self, name: str, working: Path, folder: Path, *, settings: Sequence[str] = (),
        speed: float | None = None, paused: bool = False,
    ) -> None:  # fmt: skip
        """Not begun; `settings` are items key=value that replace what the scenario's file says.

        The speed is in simulated seconds per second, None: as fast as possible. If `paused`, it
        stands at the start until it is told to go.
        """
        options = [f"--set={item}" for item in settings]
        super().__init__(["simulate", name, *options, f"--out={folder}", "--json"], working, folder)
        self.scenario: Any = None
        self.subject: Subject | None = None
        self.header: dict[str, Any] = {}
        self.charts: tuple[Chart, ...] = ()
        self.end = 0.0
        self.samples: list[Sample] = []
        self.events: list[dict[str, Any]] = []
        self.pace: dict[str, Any] = {"paused": paused, "speed": speed}
        self._image, self._count, self._stride = b"", 0, 1
        self._connection: Connection | None = None

    @property
    def takes(self) -> Sequence[str]:
        """What can be done to it by hand, once it has said so."""
        return self.header.get("takes", ())

    @property
    def outcome(self) -> str:
        """As in its newest sample; empty: there is none."""
        return str(self.samples[-1]["outcome"]) if self.samples else ""

    def at(self, time: float | None) -> tuple[Sample | None, bytes]:
        """The newest sample, whatever the time, and the newest image as JPEG, if there are any."""
        return self.samples[-1] if self.samples else None, self._image

    def tell(self, what: str, **more: Any) -> None:
        """Tells the run a message `do` of `analyses.runs.steering`: pause, go, step, break, ...

        One that is queued remembers how it is to start.
        """
        if self._connection is not None:
            with suppress(OSError):  # it has just ended
                send(self._connection, Message("do", {"what": what, **more}))
        elif what == "speed":
            self.pace["speed"] = more["factor"]
        elif what in ("pause", "go"):
            self.pace["paused"] = what == "pause"

    def take(self, message: Message) -> None:
        """Keeps what the run shows."""
        data = message.data
        if message.kind == "begin":
            self.header, self.end = data, float(data["duration"])
            self.charts = charts_of(data["cables"], data["limits"])
        elif message.kind == "sample":
            self._take_sample(data)
        elif message.kind == "image":
            self._image = message.blob
        elif message.kind == "event":
            self.events.append(data)
        elif message.kind == "pace":
            self.pace = data
            if self.state in (JobState.RUNNING, JobState.PAUSED):
                self.set_state(JobState.PAUSED if data["paused"] else JobState.RUNNING)

    def _take_sample(self, sample: Sample) -> None:
        """Replaces the newest one, if that is between those that are kept."""
        if self._count and (self._count - 1) % self._stride:
            self.samples.pop()
        self.samples.append(sample)
        self._count += 1
        if len(self.samples) > MOST_SAMPLES:
            self.samples, self._stride = self.samples[::2], 2 * self._stride

    def _hear(self, said: str) -> None:
        super()._hear(said)
        if self.samples:  # they say more
            sample = self.samples[-1]
            self.progress = min(sample["t"] / self.end, 1.0), _progress_words(sample)

    async def _work(self) -> None:
        ours, theirs = socket.socketpair()
        self.descriptors = (theirs.detach(),)
        self.arguments += (f"--steered-by={self.descriptors[0]}",)
        self._connection = connection = Connection(ours.detach())
        self.tell("speed", factor=self.pace["speed"])
        if self.pace["paused"]:
            self.tell("pause")
        loop = asyncio.get_running_loop()

        def listen() -> None:
            """Takes what the run shows, until it closes its end or sends no message."""
            with suppress(EOFError, OSError, ValueError, RuntimeError):  # the loop is closed
                while True:
                    loop.call_soon_threadsafe(self.take, receive(connection))

        Thread(target=listen, daemon=True).start()
        await super()._work()
        self._connection = None


def _progress_words(sample: Sample) -> str:
    distance, angle = sample["position_error"], sample["rotation_error"]
    if distance is None or angle is None:
        return f"{sample['t']:.2f} s"
    return f"{sample['t']:.2f} s, error {1e3 * distance:.2f} mm, {math.degrees(angle):.2f} deg"


NO_RUN = RunJob("", Path(), Path())
NO_RUN.state = JobState.FINISHED
"""What is shown where nothing is, and nobody works."""


class FinishedRun:
    """What a run left in a folder.

    Attributes:
        folder: The folder.
        summary: Its summary.
        times: Of the samples, which are rows of its log, shape (n,) [s].
    """

    def __init__(self, folder: Path) -> None:
        """Reads it.

        Raises:
            OutputFolderError: It cannot be read.
            CdprError: Its scenario is not accepted.
        """
        self.folder = folder
        check_moves_robot(str(folder / SCENARIO), "the studio")
        self.scenario = load_scenario(folder / SCENARIO)
        robot = load_robot(self.scenario.robot)
        self.subject = subject_of(robot)
        cables = [cable.name for cable in robot.cables]
        self.charts = charts_of(cables, shown_limits(self.scenario, robot))
        model = servo_model(self.scenario, robot) if isinstance(self.scenario, Scenario) else None
        self._picture = None if model is None else MarksPicture(model)
        self._drawn = -1, b""
        try:
            self.summary: dict[str, Any] = load_json((folder / SUMMARY).read_text(encoding="utf-8"))
            self.outcome = str(self.summary.get("outcome", ""))
            with np.load(folder / LOG, allow_pickle=False) as log:
                self._read(log, model)
        except (OSError, LookupError, ValueError, zipfile.BadZipFile, zlib.error) as problem:
            raise OutputFolderError(f"{folder.name}: cannot be read: {problem}") from problem

    def _read(self, log: Mapping[str, np.ndarray], model: ServoModel | None) -> None:
        """Samples, and marks where they are found."""
        count = len(log["time"])
        rows = np.unique(np.linspace(0, count - 1, min(count, MOST_SAMPLES)).astype(int))
        self.times, poses = log["time"][rows], log["X_WP"][rows]
        self.end = float(self.times[-1])
        if model is None:
            distance, angle = pose_rows_distance(poses, log["X_WP_desired"][rows])
        else:
            self._marks = log[f"{model.target.mark}_px"][rows]
            self._is_found = log["found"][rows, 0] > 0.0
            pairs = zip(poses, self.times, strict=True)
            errors = [model.seen_error(pose_from_row(pose), float(time)) for pose, time in pairs]
            distance, angle = np.array(errors).T
        unstrained = "unstrained_lengths"
        columns = {
            "t": self.times, "position_error": distance, "rotation_error": angle,
            "tensions": log["tensions"][rows], "lengths": log["lengths"][rows], "pose": poses,
            "unstrained": log[unstrained][rows] if unstrained in log else np.full(len(rows), None),
        }  # fmt: skip
        samples = zip(*(values.tolist() for values in columns.values()), strict=True)
        self.samples = [finite(dict(zip(columns, sample, strict=True))) for sample in samples]

    def at(self, time: float | None) -> tuple[Sample, bytes]:
        """Sample nearest to a time [s], None: the end; and the camera's image, empty: no camera.

        The image is drawn from the marks of the log, as JPEG.
        """
        row = int(np.argmin(np.abs(self.times - (self.end if time is None else time))))
        if self._picture is not None and row != self._drawn[0]:
            marks = self._marks[row] if self._is_found[row] else None
            self._drawn = row, self._picture.jpeg(marks, None)
        return self.samples[row], self._drawn[1]


def _picture(meshcat: Meshcat, robot: Robot, scenario: Any) -> RobotPicture:
    """The robot of a scenario and all that is round it."""
    servo, cables, world = scenario, None, None
    if not isinstance(scenario, Scenario):
        servo, world = None, scenario.world
        cables = CableSettings(model=ELASTIC, pulleys=scenario.cables.pulleys)
    colors = [nth_look(k).color for k in range(len(robot.cables))]
    full_scale = robot.tension_limits()[1]
    return RobotPicture(
        robot, full_scale, servo, cables, meshcat=meshcat, world=world, colors=colors
    )


class RunBoard(Board):
    """What the run panel of a session shows, in all its tabs and in its scene.

    Attributes:
        draft: The scenario that is worked on; None: none was chosen.
        run: What is shown of it: samples while it goes on, rows of its log when it is finished.
        other: The run behind it; None: there is none.
        compared: Key of the run behind the one that is shown; empty: none.
        speed: Speed of the next run, a name of `SPEEDS`.
        cursor: Time that is looked at in a finished run [s]; None: its end.
        in_scene: The sample of a run that is in the scene, or on its way; None: the open robot is.
    """

    def __init__(self, bench: Workbench) -> None:
        """Of a workbench, without a run in its scene."""
        super().__init__(bench.jobs, bench.folder.root, RUNS)
        self._bench = bench
        self.draft: ScenarioDraft | None = None
        self.run: RunJob | FinishedRun = NO_RUN
        self.other: FinishedRun | None = None
        self.compared, self.speed = "", "real time"
        self.cursor: float | None = None
        self.in_scene: Sample | None = None
        self._reads, self._unreadable = False, set[Path]()  # folders
        self._draws, self._drawn = False, 0.0
        # Of the calculator's thread: whose pictures there are, and if the scene shows them.
        self._about: tuple[Subject | None, dict[str, Any]] = None, {}
        self._is_drawn = False
        self._picture: RobotPicture

    def is_whole(self, folder: Path) -> bool:
        """True if a folder has the results of a run."""
        return all((folder / name).is_file() for name in (LOG, SUMMARY, SCENARIO))

    @property
    def job(self) -> RunJob:
        """The job of the run that is looked at, as long as the server has it."""
        job = self.entry and self.entry.job
        return job if isinstance(job, RunJob) else NO_RUN

    @property
    def looked_at(self) -> tuple[Path, Job | None] | None:
        """Folder and job that are looked at: one run may come after another in a folder."""
        return None if self.entry is None else (self.entry.folder, self.entry.job)

    @property
    def state(self) -> str:
        """How the run is, in a few words; empty: none is looked at."""
        job = self.job
        if job is not NO_RUN:
            starts = job.state == JobState.RUNNING and not job.header
            return "starting" if starts else job.state.value
        if isinstance(self.run, FinishedRun):
            return "finished"
        if self.entry is None:
            return ""
        return "unreadable" if self.entry.folder in self._unreadable else READING

    def newest(self, choices: Mapping[str, Entry]) -> str:
        """That which was begun last; of what others left nothing is looked at unasked."""
        return next((key for key, entry in choices.items() if entry.job), "")

    def follow(self) -> dict[str, Entry]:
        """As every board, and shows another run where that is another one."""
        before, choices = self.looked_at, super().follow()
        if self.compared == self.shown:
            self.compared = ""
        if before != self.looked_at:
            self.run = self.job
            self._unreadable.clear()
        return choices

    async def read(self, other: Entry | None) -> None:
        """Reads what a run left once it is over, and the run behind it; for all tabs, once."""
        if self._reads:
            return
        self._reads = True
        try:
            if other is None or self.other is None or other.folder != self.other.folder:
                self.other = await self._finished(other)
            before = self.looked_at
            if self.job.state.is_over and not isinstance(self.run, FinishedRun):
                done = await self._finished(self.entry)
                if done is not None and before == self.looked_at:
                    self.run = done
                    self.cursor = done.end if self.cursor is None else min(self.cursor, done.end)
        finally:
            self._reads = False

    async def _finished(self, entry: Entry | None) -> FinishedRun | None:
        """What a run left; None: nothing, or what cannot be read, which is said once."""
        if entry is None or not entry.is_whole or entry.folder in self._unreadable:
            return None
        try:
            return await run.io_bound(FinishedRun, entry.folder)
        except Exception:
            self._unreadable.add(entry.folder)
            raise

    async def simulate(self, *, paused: bool = False, by_hand: bool = False) -> None:
        """Begins a run of the draft, perhaps standing at the start, and looks at it.

        `by_hand`: cables can be broken and the platform pushed while it runs.

        Raises:
            CdprError: The draft is not accepted.
        """
        job = await asyncio.to_thread(self._job, paused, by_hand)
        self._jobs.submit(job)
        assert job.folder is not None
        self.shown, self.cursor = job.folder.name, None

    def _job(self, paused: bool, by_hand: bool) -> RunJob:
        """A run of the draft, which is read for that."""
        draft = self.draft
        assert draft is not None
        scenario = draft.check()
        job = RunJob(
            draft.name, self._root, self._jobs.free_folder(self.folder / scenario.name),
            settings=(*draft.settings(), *(draft.by_hand() if by_hand else ())),
            speed=SPEEDS[self.speed], paused=paused,
        )  # fmt: skip
        job.scenario, job.subject = scenario, subject_of(load_robot(scenario.robot))
        return job

    def draw(self, shown: RunJob | FinishedRun, sample: Sample, wait: float) -> None:
        """Draws a sample of a run, unless it is there, or one was drawn less than `wait` before [s]
        or is being drawn; to be called again and again."""
        if sample is self.in_scene or self._draws or monotonic() - self._drawn < wait:
            return
        bench, dark = self._bench, bool(self._bench.dark)
        self.in_scene, self._draws = sample, True

        def done(future: Future[None]) -> None:
            self._draws, self._drawn = False, monotonic()
            if future.exception() is None and self.in_scene is not None:
                bench.draws(shown.subject)

        bench.draw(lambda scene: self._draw(scene, shown, sample, dark), done)

    def give_back(self) -> None:
        """Lets the open robot be shown again."""
        if self.in_scene is not None:
            self.in_scene = None
            self._bench.draw(self._leave)
            self._bench.draws(None)
            self._bench.ask()

    def _leave(self, scene: RobotScene) -> None:
        self._is_drawn = False
        scene.redraw()

    def _draw(
        self, scene: RobotScene, shown: RunJob | FinishedRun, sample: Sample, dark: bool
    ) -> None:
        scenario = shown.scenario
        about = shown.subject, plain_value(scenario) | {"robot": ""}  # a file of each folder
        if about != self._about or not self._is_drawn:
            for path in PATHS:
                scene.meshcat.Delete(path)
            robot = load_robot(scenario.robot)
            if about != self._about:  # pydrake frees no diagram
                self._about, self._picture = about, _picture(scene.meshcat, robot, scenario)
            else:
                self._picture.show()
            look_at_robot(scene.meshcat, robot)
            scene.set_dark(dark)
            self._is_drawn = True
        unstrained = sample["unstrained"]
        self._picture.draw(
            pose_from_row(np.array(sample["pose"], float)),
            np.array(sample["tensions"], float),  # None becomes NaN
            float(sample["t"]),
            None if unstrained is None else np.array(unstrained, float),
        )

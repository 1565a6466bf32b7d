"""Meshcat scenes and recordings that open in a browser without a server."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams, Rgba
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from cdpr_drake.analyses.visualization.curves import path_rows
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.analyses.visualization.replay_page import PageNotes, with_notes
from cdpr_drake.analyses.visualization.replay_signals import (
    CameraView,
    camera_signals,
    film_images,
    frame_signals,
    tension_curves,
)
from cdpr_drake.analyses.visualization.shown_things import (
    ShownThing,
    ShownView,
    Surroundings,
    ThingMover,
    frustum,
    show_things,
)
from cdpr_drake.analyses.visualization.solids import see_through, transparent_paths
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import (
    CableGeometryError,
    EquilibriumError,
    InfeasibleTensionError,
    TensionProblemError,
)
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_holding import rest_as_long
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import CAMERA, PLATFORM, Look, rgb
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.pan_tilt_settings import CameraPanTilt
from cdpr_drake.systems.diagrams.camera import pictured_robot
from cdpr_drake.systems.diagrams.pan_tilt import LOGGED_JOINTS, turned_mounting
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures
from cdpr_drake.systems.robots.cable_robot import CableRobot, holding_tensions
from cdpr_drake.systems.robots.settings import CableSettings
from cdpr_drake.systems.worlds.settings import WorldSettings
from cdpr_drake.vision.pinhole import Pinhole

if TYPE_CHECKING:  # all that a servo may be made of, which other scenes do without
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

REPLAY_RATE = 25.0
"""Frames per second of a recording [Hz]; the browser interpolates between them."""

CLOCK = 1000.0
"""Steps per second that times of frames are rounded down to [Hz]. Meshcat would take
`REPLAY_RATE`, and then put 1.16 s, which is 28.999... steps, into the frame before its own."""

MOST_FRAMES = 15_000
"""Frames of a recording at most: ten minutes at the full rate; longer ones have fewer a second."""

LARGEST_PAGE = 60_000_000
"""Size of a page with a recording at most [bytes]; one with more has fewer frames a second."""

BYTES_EACH = 260
"""What one body in one frame takes of a page, about [bytes]: it is 247 with its scale."""

FEWEST_FRAMES, SAMPLED_FRAMES = 50, 60
"""Frames of a recording at least, and how many are looked at to see what one takes."""

TRACE_BINS = 500
"""Pieces of a path drawn into a scene, each by its extremes."""

FRUSTUM = 0.05
"""Depth of the drawn view of a camera, of the diagonal of the robot's frame."""


class RobotPicture:
    """A robot in Meshcat that can be posed, with its scene and cables.

    Attributes:
        meshcat: Where it is shown.
        problem: Why the cables are grey, in one line; empty where their tensions are known.
    """

    def __init__(
        self,
        robot: Robot,
        full_scale: float,
        scenario: Scenario | None = None,
        cables: CableSettings | None = None,
        *,
        meshcat: Meshcat | None = None,
        world: WorldSettings | None = None,
        colors: Sequence[str] | None = None,
        look: bool = True,
    ) -> None:
        """Shows a robot, the target of a scenario, and the kind of cables that is given.

        `full_scale` colours the cables [N]; it is shown in `meshcat`, or in one of its own. A
        `world` is that of a scenario of another kind; `colors` are those of cables that are not
        slack, in the place of those of tensions. Without `look`, whoever looks at the scene keeps
        the view.
        """
        self.meshcat = open_meshcat() if meshcat is None else meshcat
        self.problem = ""
        self._block, self._diagram, self._visualizer = _visualized(
            robot, scenario, world, self.meshcat
        )
        self._context: Context = self._diagram.CreateDefaultContext()
        self._visualizer.ForcedPublish(self._visualizer.GetMyContextFromRoot(self._context))
        for path in transparent_paths(self._block.scene_graph.model_inspector()):
            see_through(self.meshcat, path)
        if cables is None and scenario is not None:
            cables = scenario.cables
        self.cables = CablePictures(self.meshcat, robot, full_scale, settings=cables, colors=colors)
        self._robot, self._full_scale = robot, full_scale
        self._lines: list[tuple[str, Look]] = []
        self._known = True
        self.title = "" if scenario is None else scenario.title
        if look:
            look_at(self.meshcat, robot.frame.lower, robot.frame.upper)

    def draw(
        self,
        X_WP: RigidTransform,
        tensions: Array,
        time: float | None = None,
        unstrained_lengths: Array | None = None,
    ) -> None:
        """Draws the platform at X_WP [m] and its cables; arguments as `CablePictures.draw`.

        Where no tension is known, the page of the scene says so, and has no scale of tensions.
        """
        self._known = not np.all(np.isnan(tensions))
        plant = self._block.plant
        self._context.SetTime(time or 0.0)
        self._block.in_plant.set_pose(plant.GetMyMutableContextFromRoot(self._context), X_WP)
        self._visualizer.ForcedPublish(self._visualizer.GetMyContextFromRoot(self._context))
        self.cables.draw(X_WP, tensions, time, unstrained_lengths)

    def show_trace(self, name: str, points: Array, look: Look) -> None:
        """Draws a path in W, points of shape (n, 3) [m], in the colour of a look."""
        shown = np.asarray(points[path_rows(points, TRACE_BINS)])
        color = Rgba(*rgb(look.color))
        self.meshcat.SetLine(f"traces/{name}", np.ascontiguousarray(shown.T), 3.0, color)
        self._lines.append((f"path of the {name}", look))

    def explain(self, words: str, look: Look) -> None:
        """Adds a line to the legend of the page."""
        self._lines.append((words, look))

    def show_camera(self, pinhole: Pinhole) -> None:
        """Draws what a camera sees as a pyramid, for `place_camera`."""
        starts, ends = frustum(pinhole, self._depth())
        self.meshcat.SetLineSegments("camera/view", starts, ends, 2.0, Rgba(*rgb(CAMERA.color)))
        self._lines.append(("view of the camera", CAMERA))

    def place_camera(self, X_WC: RigidTransform, time: float | None = None) -> None:
        """Moves the camera of `show_camera` to X_WC [m]; time [s] as in `draw`."""
        self.meshcat.SetTransform("camera", X_WC, time)

    def show_things(self, things: Sequence[ShownThing | ShownView]) -> None:
        """Shows what is neither robot nor world, where frames are W, for a `ThingMover`."""
        self._lines += show_things(self.meshcat, things, self._depth())

    def _depth(self) -> float:
        """To which what a camera sees is drawn [m]."""
        frame = self._robot.frame
        return FRUSTUM * float(np.linalg.norm(frame.upper - frame.lower))

    def start_recording(self) -> None:
        """From now on, `draw` with a time writes into the recording."""
        self._visualizer.StartRecording(set_transforms_while_recording=False)

    def html(self) -> str:
        """The scene as one page that needs no server."""
        return self._page({})

    def recording_html(
        self,
        frames: dict[str, Any],
        curves: dict[str, Any],
        camera: dict[str, Any] | None = None,
    ) -> str:
        """The scene with its recording, and beside it what `replay_signals` made of its run."""
        self.meshcat.StopRecording()
        self.meshcat.PublishRecording()
        return self._page({"frames": frames, "curves": curves, "camera": camera})

    def _page(self, signals: dict[str, Any]) -> str:
        notes = PageNotes(
            names=[cable.name for cable in self._robot.cables],
            places=self._robot.cable_set().p_WA,
            full_scale=self._full_scale,
            known=self._known,
            title=self.title,
            lines=self._lines,
            **signals,
        )
        return with_notes(self.meshcat.StaticHtml(), notes)


def _visualized(
    robot: Robot, scenario: Scenario | None, world: WorldSettings | None, meshcat: Meshcat
) -> tuple[CableRobot, Diagram, MeshcatVisualizer]:
    builder = DiagramBuilder()
    block = builder.AddNamedSystem("robot", pictured_robot(robot, scenario, world))
    params = MeshcatVisualizerParams(publish_period=1.0 / CLOCK)  # of recordings alone
    visualizer = MeshcatVisualizer.AddToBuilder(
        builder, block.GetOutputPort("query_object"), meshcat, params
    )
    return block, builder.Build(), visualizer


def look_at(meshcat: Meshcat, lower: Array, upper: Array) -> None:
    """Looks from the front and above, past pillars, with a box from lower to upper in W [m]
    filling the window."""
    middle, size = (lower + upper) / 2.0, float(np.linalg.norm(upper - lower))
    eye = middle + size * np.array([-0.18, -0.8, 0.3])
    meshcat.SetCameraPose(eye, middle)
    # Meshcat's point lights stand a few metres off, inside a large robot.
    for light in ("PointLightNegativeX", "PointLightPositiveX", "SpotLight"):
        meshcat.SetProperty(f"/Lights/{light}", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 2.0)
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    meshcat.SetProperty("/Background/<object>", "top_color", [0.92, 0.94, 0.97])
    meshcat.SetProperty("/Background/<object>", "bottom_color", [0.98, 0.98, 0.98])


def robot_html(robot: Robot) -> str:
    """A page that shows a robot as `robot_picture` does."""
    return robot_picture(robot).html()


def robot_picture(robot: Robot, meshcat: Meshcat | None = None) -> RobotPicture:
    """A robot at its home pose, held by its cables, in Meshcat, by default in one of its own.

    With fewer cables than degrees of freedom it is where it comes to rest on cables as long as
    their paths there. Where the cables cannot hold it they are grey, and `problem` says why.
    """
    X_WP, problem = robot.home.transform(), ""
    try:
        if robot.is_underactuated():
            X_WP, holding = rest_as_long(robot, X_WP, robot.cable_set(), ELASTIC)
            tensions = holding.tensions
        else:
            tensions = holding_tensions(robot, X_WP)
    except (
        CableGeometryError,
        EquilibriumError,
        InfeasibleTensionError,
        TensionProblemError,
    ) as found:
        tensions, problem = np.full(len(robot.cables), np.nan), str(found)
    # Twice the largest tension, so that colours also tell the home pose from full load.
    full_scale = robot.tension_limits()[1] if problem else 2.0 * float(np.max(tensions))
    picture = RobotPicture(robot, full_scale, cables=CableSettings(pulleys=True), meshcat=meshcat)
    picture.title = f"{robot.name}, {robot.geometry_words()}"
    picture.draw(X_WP, tensions)
    picture.problem = problem
    return picture


def write_replay(
    path: Path,
    robot: Robot,
    log: Mapping[str, Array],
    scenario: Scenario | None = None,
    cables: CableSettings | None = None,
    camera: tuple[CameraMounting, Pinhole] | None = None,
    *,
    around: Surroundings | None = None,
    view: CameraView | None = None,
    limits: tuple[float, float] | None = None,
    title: str = "",
) -> None:
    """Writes the recording of a run as one HTML file of at most `LARGEST_PAGE`.

    Args:
        path: The file.
        robot: The robot.
        log: "time", shape (n,) [s], "X_WP", shape (n, 7), "tensions", shape (n, m) [N], for
            cables that sag or hang slack, "unstrained_lengths", shape (n, m) [m], and, with a
            view, what `camera_signals` takes.
        scenario: A visual servo's scenario, whose target is shown too.
        cables: The kind of cables; None: the scenario's, or straight from fixed exit points.
        camera: Where a camera is, and how it sees; None: there is none.
        around: What is round the robot in a scenario of another kind.
        view: What the camera saw, which is shown beside the scene; None: nothing is.
        limits: Smallest and largest tension that are shown with the tensions [N]; None: those of
            the robot.
        title: Of the page; empty: the scenario's.
    """
    world, things = (None, ()) if around is None else (around.world, around.things)
    curves = tension_curves(log, limits or robot.tension_limits())
    images = film_images(view)

    def page(most: int) -> Recorded:
        picture = _scene(robot, log, scenario, cables, camera, world=world)
        picture.title = title or picture.title
        picture.show_things(things)
        most = min(most, _affordable_frames(picture, log, len(things)))
        joints = None if scenario is None else scenario.camera.pan_tilt
        shown, frames = _record(picture, log, camera, most, things, joints)
        seen = None if view is None else camera_signals(view, log, shown, images)
        return Recorded(picture.recording_html(frames, curves, seen), len(shown), most)

    def still() -> str:
        return _scene(robot, log, scenario, cables, camera, world=world).html()

    path.write_text(fitting_page(page, still), encoding="utf-8")


@dataclass(frozen=True)
class Recorded:
    """A page with a recording: its frames, and how many were allowed."""

    html: str
    frames: int
    most: int


def fitting_page(page: Callable[[int], Recorded], still: Callable[[], str]) -> str:
    """A page of at most `LARGEST_PAGE`, with as many frames as that allows.

    Args:
        page: Makes it with at most so many frames.
        still: The same without a recording.
    """
    most = MOST_FRAMES
    while True:
        made = page(most)
        if len(made.html) <= LARGEST_PAGE or made.most <= FEWEST_FRAMES:
            return made.html
        bare = len(still())
        room = max(LARGEST_PAGE - bare, 0) / (len(made.html) - bare)
        most = max(FEWEST_FRAMES, int(0.9 * min(made.most, made.frames) * room))
        del made


def _scene(
    robot: Robot,
    log: Mapping[str, Array],
    scenario: Scenario | None,
    cables: CableSettings | None,
    camera: tuple[CameraMounting, Pinhole] | None,
    *,
    world: WorldSettings | None,
) -> RobotPicture:
    """What stands still in a replay: the robot, the traces, the shape of what a camera sees."""
    picture = RobotPicture(robot, float(np.max(log["tensions"])), scenario, cables, world=world)
    poses = log["X_WP"]
    points = poses[:, 4:]
    picture.show_trace("platform, Po", points, PLATFORM)
    if camera is not None:
        mounting, pinhole = camera
        picture.show_camera(pinhole)
        if not mounting.is_eye_to_hand():
            rows = path_rows(points, TRACE_BINS)
            X_WCs = [mounting.X_WC(pose_from_row(row)) for row in poses[rows]]
            picture.show_trace("camera, Co", np.array([X.translation() for X in X_WCs]), CAMERA)
    return picture


def _affordable_frames(picture: RobotPicture, log: Mapping[str, Array], things: int) -> int:
    """How many frames a page has room for, by how many rods the cables take at some times."""
    unstrained = log.get("unstrained_lengths")
    if unstrained is None:
        rods = log["tensions"].shape[1]
    else:
        some = np.unique(np.linspace(0, len(log["time"]) - 1, SAMPLED_FRAMES).astype(int))
        poses = log["X_WP"][some]
        rods = max(
            picture.cables.rods(pose_from_row(pose), lengths)
            for pose, lengths in zip(poses, unstrained[some], strict=True)
        )
    others = 3 + things  # platform, camera, target
    return max(FEWEST_FRAMES, int(LARGEST_PAGE / (BYTES_EACH * (rods + others))))


def _record(
    picture: RobotPicture,
    log: Mapping[str, Array],
    camera: tuple[CameraMounting, Pinhole] | None,
    most: int,
    things: Sequence[Any] = (),
    joints: CameraPanTilt | None = None,
) -> tuple[list[int], dict[str, Any]]:
    """Records at most so many frames; rows of the log that they show, and their numbers."""
    times = log["time"]  # a log on disk is read where it is looked at: once, only what is shown
    shown = frame_indices(times, REPLAY_RATE, most)
    poses, tensions = log["X_WP"][shown], log["tensions"][shown]
    unstrained = log["unstrained_lengths"][shown] if "unstrained_lengths" in log else None
    slack = np.zeros(tensions.shape, bool)
    angles = None if joints is None else log[LOGGED_JOINTS][shown]
    mover = ThingMover(picture.meshcat, things, log, shown)
    picture.start_recording()
    for frame, time in enumerate(times[shown]):
        X_WP = pose_from_row(poses[frame])
        lengths = None if unstrained is None else unstrained[frame]
        picture.draw(X_WP, tensions[frame], float(time), lengths)
        mover.place(frame, float(time))
        slack[frame] = picture.cables.slack(tensions[frame], lengths)
        if camera is not None:
            mounting = camera[0]
            if joints is not None and angles is not None:
                mounting = turned_mounting(mounting, joints, angles[frame])
            picture.place_camera(mounting.X_WC(X_WP), float(time))
    return shown, frame_signals(log, shown, slack)


def frame_indices(times: Array, rate: float, most: int = MOST_FRAMES) -> list[int]:
    """Rows of a log nearest to the frames of a film.

    Args:
        times: Times of the rows, growing, shape (n,) [s].
        rate: Frames per second [Hz]; fewer where there would be more than `most`.
        most: Largest number of frames.
    """
    duration = float(times[-1] - times[0])
    period = max(1.0 / rate, duration / max(most - 1, 1))
    wanted = np.arange(times[0], times[-1] + 0.5 * period, period)
    after = np.clip(np.searchsorted(times, wanted), 1, max(len(times) - 1, 1))
    before = after - 1
    last = np.minimum(after, len(times) - 1)
    nearer = np.where(wanted - times[before] <= times[last] - wanted, before, last)
    return np.unique(nearer).tolist()

"""Robots in Meshcat: as one page that opens without a server, and runs as recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams, Rgba
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort

from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.analyses.visualization.replay_page import (
    CameraView,
    camera_signals,
    film_images,
    frame_signals,
    tension_curves,
    with_notes,
)
from cdpr_drake.analyses.visualization.shown_things import (
    ALONE,
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
from cdpr_drake.systems.cameras.turning_camera import turning_camera
from cdpr_drake.systems.diagrams.camera import add_pictured_robot
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures
from cdpr_drake.systems.robots.cable_robot import holding_tensions
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
"""Largest number of frames: ten minutes at the full rate; longer recordings have a lower rate."""

LARGEST_PAGE = 60_000_000
"""Largest size of a page with a recording [bytes]; a larger one gets fewer frames a second."""

BYTES_EACH = 260
"""Size of one body in one frame of a page, about [bytes]: it is 247 with its scale."""

FEWEST_FRAMES, SAMPLED_FRAMES = 50, 60
"""Smallest number of frames of a recording, and number of rows that tell the size of a frame."""

TRACE_BINS = 500
"""Pieces of a path drawn into a scene, each by its extremes."""

FRUSTUM = 0.05
"""Depth of the drawn view of a camera, of the diagonal of the robot's frame."""


class RecordedScene:
    """A Diagram in Meshcat that can be posed, recorded and written as a page.

    Attributes:
        meshcat: The Meshcat that shows it.
        problem: Why the cables are grey, in one line; empty where their tensions are known.
    """

    def __init__(self, meshcat: Meshcat, builder: DiagramBuilder, geometry: OutputPort) -> None:
        """Builds the Diagram, whose query object is the output `geometry`."""
        self.meshcat, self.problem = meshcat, ""
        params = MeshcatVisualizerParams(publish_period=1.0 / CLOCK)  # of recordings alone
        self._visualizer = MeshcatVisualizer.AddToBuilder(builder, geometry, meshcat, params)
        self._diagram = builder.Build()
        self._context: Context = self._diagram.CreateDefaultContext()

    def publish(self, time: float | None = None) -> None:
        """Draws the bodies where the context has them, at a time of a recording [s]."""
        self._context.SetTime(time or 0.0)
        self._visualizer.ForcedPublish(self._visualizer.GetMyContextFromRoot(self._context))

    def start_recording(self) -> None:
        """From now on, what is drawn with a time goes into the recording."""
        self._visualizer.StartRecording(set_transforms_while_recording=False)

    def page(
        self, names: Sequence[str], exits: Array, full_scale: float, *, frames: Any = None,
        **notes: Any,
    ) -> str:  # fmt: skip
        """The scene as one page that needs no server; arguments as of `with_notes`.

        With frames it has the recording, which ends.
        """
        if frames is not None:
            self.meshcat.StopRecording()
            self.meshcat.PublishRecording()
        html = self.meshcat.StaticHtml()
        return with_notes(html, names, exits, full_scale, frames=frames, **notes)


class RobotPicture(RecordedScene):
    """A robot in Meshcat that can be posed, with its scene and cables.

    Attributes:
        title: Of its page.
    """

    def __init__(
        self, robot: Robot, full_scale: float, scenario: Scenario | None = None,
        cables: CableSettings | None = None, *, meshcat: Meshcat | None = None,
        world: WorldSettings | None = None, colors: Sequence[str] | None = None, look: bool = True,
    ) -> None:  # fmt: skip
        """Shows a robot.

        Args:
            robot: The robot.
            full_scale: Tension of the last colour of cables [N].
            scenario: A visual servo, whose target is shown, too.
            cables: The kind of cables; None: the scenario's, or straight from fixed exit points.
            meshcat: Where to show it; None: a new one.
            world: World of a scenario of another kind.
            colors: Of cables that are not slack, #rrggbb; None: by their tensions.
            look: True to look at the robot; else the view stays.
        """
        self.title = "" if scenario is None else scenario.title
        builder = DiagramBuilder()
        self._block = add_pictured_robot(builder, robot, scenario, world)
        super().__init__(
            meshcat or open_meshcat(), builder, self._block.GetOutputPort("query_object")
        )
        if cables is None and scenario is not None:
            cables = scenario.cables
        self._new_cables = partial(
            CablePictures, self.meshcat, robot, full_scale, settings=cables, colors=colors
        )
        self.show()
        self._robot, self._full_scale, self._known = robot, full_scale, True
        self._lines: list[tuple[str, Look]] = []
        frame = robot.frame
        self._depth = FRUSTUM * float(np.linalg.norm(frame.upper - frame.lower))
        if look:
            look_at(self.meshcat, frame.lower, frame.upper)

    def show(self) -> None:
        """Puts it into Meshcat, at the first time or where somebody took it out."""
        self._visualizer.Delete()
        self.publish()
        for path in transparent_paths(self._block.scene_graph.model_inspector()):
            see_through(self.meshcat, path)
        self.cables = self._new_cables()

    def draw(
        self, X_WP: RigidTransform, tensions: Array, time: float | None = None,
        unstrained_lengths: Array | None = None,
    ) -> None:  # fmt: skip
        """Draws the platform at X_WP [m] and its cables; arguments as `CablePictures.draw`.

        If no tension is known, the page of the scene says so, and has no scale of tensions.
        """
        self._known = not np.all(np.isnan(tensions))
        plant = self._block.plant
        self._block.in_plant.set_pose(plant.GetMyMutableContextFromRoot(self._context), X_WP)
        self.publish(time)
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
        starts, ends = frustum(pinhole, self._depth)
        self.meshcat.SetLineSegments("camera/view", starts, ends, 2.0, Rgba(*rgb(CAMERA.color)))
        self._lines.append(("view of the camera", CAMERA))

    def place_camera(self, X_WC: RigidTransform, time: float | None = None) -> None:
        """Moves the camera of `show_camera` to X_WC [m]; time [s] as in `draw`."""
        self.meshcat.SetTransform("camera", X_WC, time)

    def show_things(self, things: Sequence[ShownThing | ShownView]) -> None:
        """Shows what is neither robot nor world, where frames are W, for a `ThingMover`."""
        self._lines += show_things(self.meshcat, things, self._depth)

    def html(self, **signals: Any) -> str:
        """The scene as one page that needs no server, with its recording if there is one.

        Args:
            signals: Frames, curves and camera of the recording, for `with_notes`.
        """
        names, exits = [cable.name for cable in self._robot.cables], self._robot.cable_set().p_WA
        return self.page(
            names, exits, self._full_scale, title=self.title, lines=self._lines,
            known=self._known, **signals,
        )  # fmt: skip


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


UNHELD = (CableGeometryError, EquilibriumError, InfeasibleTensionError, TensionProblemError)
"""Refusals of tensions that hold a platform."""


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
    except UNHELD as refusal:
        tensions, problem = np.full(len(robot.cables), np.nan), str(refusal)
    # Twice the largest tension, so that colours also tell the home pose from full load.
    full_scale = robot.tension_limits()[1] if problem else 2.0 * float(np.max(tensions))
    picture = RobotPicture(robot, full_scale, cables=CableSettings(pulleys=True), meshcat=meshcat)
    picture.title = f"{robot.name}, {robot.geometry_words()}"
    picture.draw(X_WP, tensions)
    picture.problem = problem
    return picture


def write_replay(
    path: Path, robot: Robot, log: Mapping[str, Array], scenario: Scenario | None = None,
    cables: CableSettings | None = None, camera: tuple[CameraMounting, Pinhole] | None = None, *,
    around: Surroundings = ALONE, view: CameraView | None = None,
    limits: tuple[float, float] | None = None, title: str = "",
) -> None:  # fmt: skip
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
        around: What is around the robot in a scenario of another kind.
        view: What the camera saw, which is shown beside the scene; None: nothing is.
        limits: Smallest and largest tension that are shown with the tensions [N]; None: the
            robot's.
        title: Of the page; empty: the scenario's.
    """
    curves, images = tension_curves(log, limits or robot.tension_limits()), film_images(view)
    times = log["time"]
    _, turning = ("", None) if scenario is None else turning_camera(scenario)

    def scene() -> RobotPicture:
        full_scale = float(np.max(log["tensions"]))
        picture = RobotPicture(robot, full_scale, scenario, cables, world=around.world)
        picture.title = title or picture.title
        points = log["X_WP"][:, 4:]
        picture.show_trace("platform, Po", points, PLATFORM)
        if camera is not None:
            mounting, pinhole = camera
            picture.show_camera(pinhole)
            if not mounting.is_eye_to_hand():
                poses = map(pose_from_row, log["X_WP"][path_rows(points, TRACE_BINS)])
                path_of_camera = np.array([mounting.X_WC(X_WP).translation() for X_WP in poses])
                picture.show_trace("camera, Co", path_of_camera, CAMERA)
        return picture

    def page(most: int) -> tuple[str, int]:
        picture = scene()
        picture.show_things(around.things)
        most = min(most, affordable_frames(picture, log, len(around.things)))
        shown = frame_indices(times, REPLAY_RATE, most)
        # A log on disk is read once, and only what is shown.
        poses, tensions = log["X_WP"][shown], log["tensions"][shown]
        unstrained = log["unstrained_lengths"][shown] if "unstrained_lengths" in log else None
        mountings = [] if camera is None else [camera[0]] * len(shown)
        if camera is not None and turning is not None:
            mountings = [*turning.mountings(camera[0], log, shown)]
        slack = np.zeros(tensions.shape, bool)
        mover = ThingMover(picture.meshcat, around.things, log, shown)
        picture.start_recording()
        for frame, time in enumerate(map(float, times[shown])):
            X_WP = pose_from_row(poses[frame])
            lengths = None if unstrained is None else unstrained[frame]
            picture.draw(X_WP, tensions[frame], time, lengths)
            mover.place(frame, time)
            slack[frame] = picture.cables.slack(tensions[frame], lengths)
            if camera is not None:
                picture.place_camera(mountings[frame].X_WC(X_WP), time)
        html = picture.html(
            frames=frame_signals(log, shown, slack), curves=curves,
            camera=None if view is None else camera_signals(view, log, shown, images),
        )  # fmt: skip
        return html, len(shown)

    path.write_text(fitting_page(page, lambda: scene().html()), encoding="utf-8")


def fitting_page(page: Callable[[int], tuple[str, int]], still: Callable[[], str]) -> str:
    """A page of at most `LARGEST_PAGE`, with as many frames as that allows.

    Args:
        page: Makes it with at most so many frames; returns it with the number of its frames.
        still: The same without a recording.
    """
    most = MOST_FRAMES
    while True:
        html, frames = page(most)
        if len(html) <= LARGEST_PAGE or frames <= FEWEST_FRAMES:
            return html
        bare = len(still())
        room = max(LARGEST_PAGE - bare, 0) / (len(html) - bare)
        most = max(FEWEST_FRAMES, int(0.9 * frames * room))
        del html


def affordable_frames(picture: RobotPicture, log: Mapping[str, Array], things: int) -> int:
    """Number of frames for which a page has room, by the rods that the cables take at some rows."""
    unstrained = log.get("unstrained_lengths")
    if unstrained is None:
        rods = log["tensions"].shape[1]
    else:
        sample = sampled_rows(log)
        rods = max(
            picture.cables.rods(pose_from_row(pose), lengths)
            for pose, lengths in zip(log["X_WP"][sample], unstrained[sample], strict=True)
        )
    others = 3 + things  # platform, camera, target
    return max(FEWEST_FRAMES, int(LARGEST_PAGE / (BYTES_EACH * (rods + others))))


def sampled_rows(log: Mapping[str, Array]) -> np.ndarray:
    """At most `SAMPLED_FRAMES` rows of a log, evenly over it."""
    return np.unique(np.linspace(0, len(log["time"]) - 1, SAMPLED_FRAMES).astype(int))


def frame_indices(times: Array, rate: float, most: int = MOST_FRAMES) -> list[int]:
    """Rows of a log nearest to the frames of a film.

    Args:
        times: Times of the rows, growing, shape (n,) [s].
        rate: Frames per second [Hz]; fewer where there would be more than `most`.
        most: Largest number of frames.
    """
    duration = float(times[-1] - times[0])
    period = max(1.0 / rate, duration / max(most - 1, 1))
    instants = np.arange(times[0], times[-1] + 0.5 * period, period)
    after = np.clip(np.searchsorted(times, instants), 1, max(len(times) - 1, 1))
    before = after - 1
    last = np.minimum(after, len(times) - 1)
    nearer = np.where(instants - times[before] <= times[last] - instants, before, last)
    return np.unique(nearer).tolist()

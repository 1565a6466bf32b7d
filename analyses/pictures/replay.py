"""Meshcat scenes and recordings that open in a browser without a server."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from cdpr_drake.analyses.pictures.meshcat_window import open_meshcat
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, InfeasibleTensionError, TensionProblemError
from cdpr_drake.models import Robot
from cdpr_drake.spatial import pose_from_row
from cdpr_drake.systems.diagrams import scene_adder
from cdpr_drake.systems.monitoring import CablePictures
from cdpr_drake.systems.robots import CableRobot, CableSettings, holding_tensions
from cdpr_drake.systems.scenarios import Scenario

REPLAY_RATE = 25.0
"""Frames per second of a recording [Hz]; the browser interpolates between them."""

MOST_FRAMES = 15_000
"""Frames of a recording at most: ten minutes at the full rate; longer ones have fewer a second."""


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
    ) -> None:
        """Shows a robot, the target of a scenario, and the kind of cables that is given.

        `full_scale` colours the cables [N]; it is shown in `meshcat`, or in one of its own.
        """
        self.meshcat = open_meshcat() if meshcat is None else meshcat
        self.problem = ""
        self._block, self._diagram, self._visualizer = _visualized(robot, scenario, self.meshcat)
        self._context: Context = self._diagram.CreateDefaultContext()
        if cables is None and scenario is not None:
            cables = scenario.cables
        self.cables = CablePictures(self.meshcat, robot, full_scale, settings=cables)
        _look(self.meshcat, robot)

    def draw(
        self,
        X_WP: RigidTransform,
        tensions: Array,
        time: float | None = None,
        unstrained_lengths: Array | None = None,
    ) -> None:
        """Draws the platform at X_WP [m] and its cables; arguments as `CablePictures.draw`."""
        plant = self._block.plant
        self._context.SetTime(time or 0.0)
        self._block.in_plant.set_pose(plant.GetMyMutableContextFromRoot(self._context), X_WP)
        self._visualizer.ForcedPublish(self._visualizer.GetMyContextFromRoot(self._context))
        self.cables.draw(X_WP, tensions, time, unstrained_lengths)

    def start_recording(self) -> None:
        """From now on, `draw` with a time writes into the recording."""
        self._visualizer.StartRecording(set_transforms_while_recording=False)

    def html(self) -> str:
        """The scene, and the recording if there is one, as one page that needs no server."""
        if self._visualizer.get_mutable_recording() is not None:
            self.meshcat.StopRecording()
            self.meshcat.PublishRecording()
        return str(self.meshcat.StaticHtml())


def _visualized(
    robot: Robot, scenario: Scenario | None, meshcat: Meshcat
) -> tuple[CableRobot, Diagram, MeshcatVisualizer]:
    builder = DiagramBuilder()
    block = builder.AddNamedSystem(
        "robot", CableRobot(robot, add_to_scene=None if scenario is None else scene_adder(scenario))
    )
    params = MeshcatVisualizerParams(publish_period=1.0 / REPLAY_RATE)
    visualizer = MeshcatVisualizer.AddToBuilder(
        builder, block.GetOutputPort("query_object"), meshcat, params
    )
    return block, builder.Build(), visualizer


def _look(meshcat: Meshcat, robot: Robot) -> None:
    """Looks from the front and above, past the pillars, with the robot filling the window."""
    lower, upper = robot.frame.lower, robot.frame.upper
    middle, size = (lower + upper) / 2.0, float(np.linalg.norm(upper - lower))
    eye = middle + size * np.array([-0.18, -0.8, 0.3])
    meshcat.SetCameraPose(eye, middle)
    # Meshcat's point lights stand a few metres off, inside a large robot.
    for light in ("PointLightNegativeX", "PointLightPositiveX", "SpotLight"):
        meshcat.SetProperty(f"/Lights/{light}", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 2.0)
    meshcat.SetProperty("/Lights/DirectionalLight", "visible", True)
    meshcat.SetProperty("/Lights/DirectionalLight/<object>", "intensity", 2.0)
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    meshcat.SetProperty("/Background", "top_color", [0.92, 0.94, 0.97])
    meshcat.SetProperty("/Background", "bottom_color", [0.98, 0.98, 0.98])


def robot_html(robot: Robot) -> str:
    """A page that shows a robot as `robot_picture` does."""
    return robot_picture(robot).html()


def robot_picture(robot: Robot, meshcat: Meshcat | None = None) -> RobotPicture:
    """A robot at its home pose, held by its cables, in Meshcat, by default in one of its own.

    Where the cables cannot hold it they are grey, and `problem` says why.
    """
    X_WP, problem = robot.home.transform(), ""
    try:
        tensions = holding_tensions(robot, X_WP)
    except (CableGeometryError, InfeasibleTensionError, TensionProblemError) as found:
        tensions, problem = np.full(len(robot.cables), np.nan), str(found)
    # Twice the largest tension, so that colours also tell the home pose from full load.
    full_scale = robot.tension_limits()[1] if problem else 2.0 * float(np.max(tensions))
    picture = RobotPicture(robot, full_scale, meshcat=meshcat)
    picture.draw(X_WP, tensions)
    picture.problem = problem
    return picture


def write_replay(
    path: Path,
    robot: Robot,
    log: dict[str, Array],
    scenario: Scenario | None = None,
    cables: CableSettings | None = None,
) -> None:
    """Writes the recording of a run as one HTML file.

    Args:
        path: The file.
        robot: The robot.
        log: "time", shape (n,) [s], "X_WP", shape (n, 7), "tensions", shape (n, m) [N], and, for
            cables that sag or hang slack, "unstrained_lengths", shape (n, m) [m].
        scenario: A visual servo's scenario, whose target is shown too.
        cables: The kind of cables; None: the scenario's, or straight from fixed exit points.
    """
    picture = RobotPicture(robot, float(np.max(log["tensions"])), scenario, cables)
    picture.start_recording()
    unstrained = log.get("unstrained_lengths")
    for index in frame_indices(log["time"], REPLAY_RATE):
        picture.draw(
            pose_from_row(log["X_WP"][index]),
            log["tensions"][index],
            float(log["time"][index]),
            None if unstrained is None else unstrained[index],
        )
    path.write_text(picture.html(), encoding="utf-8")


def frame_indices(times: Array, rate: float, most: int = MOST_FRAMES) -> list[int]:
    """Rows of a log nearest to the frames of a film.

    Args:
        times: Times of the rows, growing, shape (n,) [s].
        rate: Frames per second [Hz]; fewer where there would be more than `most`.
        most: Largest number of frames.
    """
    duration = float(times[-1] - times[0])
    period = max(1.0 / rate, duration / (most - 1))
    wanted = np.arange(times[0], times[-1] + 0.5 * period, period)
    after = np.clip(np.searchsorted(times, wanted), 1, max(len(times) - 1, 1))
    before = after - 1
    last = np.minimum(after, len(times) - 1)
    nearer = np.where(wanted - times[before] <= times[last] - wanted, before, last)
    return np.unique(nearer).tolist()

"""Where a robot's stability is asked for, and under which perturbations, as data."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import BoundsFileError
from cdpr_drake.models.robot_loader import robot_file, robot_names
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import In, OneOf, Text, settings, values
from cdpr_drake.schema.typed_yaml import load_typed
from cdpr_drake.servoing.turned_view import encoder_turn
from cdpr_drake.stability.perturbation_bounds import (
    BASELINE,
    DIRECTIONS,
    PLANAR_BASELINE,
    PerturbationBounds,
)

FILE = "workspace.yaml"
"""In a robot's folder: its grid and bounds in the servoing thesis."""

INSET = 0.1
"""Without such a file the grid leaves this share of the frame free on every side but the floor."""

COUNTS = (17, 17, 9)
"""Without such a file the grid has so many points along x, y, z."""


Turn = Annotated[float, In("deg", ge=0.0, le=180.0)]
"""An angle without a sign."""


@settings
class BoundsSettings:
    """Bounds on the error between true and believed model; what is left out is known exactly."""

    source: Annotated[Text, "Where the values stand."] = ""
    r_bp: Annotated[float, In("m", ge=0.0), "Position of the platform."] = 0.0
    d_theta_bp_deg: Annotated[Turn, "Orientation of the platform."] = 0.0
    r_pc: Annotated[float, In("m", ge=0.0), "Position of the camera on the platform."] = 0.0
    d_theta_pc_deg: Annotated[Turn, "Orientation of the camera on the platform."] = 0.0
    r_A: Annotated[float, In("m", ge=0.0), "Exit points."] = 0.0
    r_B: Annotated[float, In("m", ge=0.0), "Anchor points."] = 0.0
    r_s: Annotated[float, In("m", ge=0.0), "Position of the object seen by the camera."] = 0.0
    d_theta_s_deg: Annotated[Turn, "Orientation of the object seen by the camera."] = 0.0
    encoders_deg: Annotated[
        np.ndarray,
        In("deg", 2, ge=0.0),
        "Encoders of the joints, pan and tilt, of a camera that turns on such.",
    ] = values(0.0, 0.0)
    exits: Annotated[
        str,
        OneOf(DIRECTIONS),
        "How exit points are wrong: each by itself in a ball, all by one common shift, or"
        " each in a cube.",
    ] = "independent"
    anchors: Annotated[str, OneOf(DIRECTIONS), "The same for anchor points."] = "independent"

    def bounds(self) -> PerturbationBounds:
        """The bounds in SI units."""
        lengths = {name: getattr(self, name) for name in ("r_bp", "r_pc", "r_A", "r_B", "r_s")}
        turns = {
            name: float(np.radians(getattr(self, f"{name}_deg")))
            for name in ("d_theta_bp", "d_theta_pc", "d_theta_s")
        }
        joints = encoder_turn(*np.radians(self.encoders_deg))
        return PerturbationBounds(
            **lengths, **turns, d_theta_joints=joints, exits=self.exits, anchors=self.anchors
        )


@settings
class GridSettings:
    """A box of positions of the platform."""

    lower: Annotated[np.ndarray, In("m", 3), "Lower corner in W."]
    upper: Annotated[np.ndarray, In("m", 3), "Upper corner in W."]
    step: Annotated[np.ndarray, In("m", 3, gt=0.0), "Distance between neighbours along x, y, z."]


@settings
class WorkspaceSettings:
    """Grid and bounds of a robot."""

    source: Annotated[Text, "Where the values stand."] = ""
    grid: Annotated[GridSettings, "Places of the platform."]
    bounds: Annotated[BoundsSettings, "Perturbation bounds."]


@dataclass(frozen=True, eq=False)
class WorkspaceDefaults:
    """Grid and perturbation bounds of a robot, and where they come from.

    The grid has corners lower and upper, and a step between neighbours, shape (3,) each [m].
    """

    lower: Array
    upper: Array
    step: Array
    bounds: PerturbationBounds
    source: str


def load_bounds(path: Path) -> PerturbationBounds:
    """Reads a file of perturbation bounds; its keys are those of `BoundsSettings`.

    Raises:
        BoundsFileError: The file cannot be read, or a value is not accepted.
    """
    if not path.is_file():
        raise BoundsFileError(f"{path}: there is no such file of perturbation bounds")
    return load_typed(BoundsSettings, path, error=BoundsFileError).bounds()


def workspace_defaults(robot: Robot, name: Robot | str | Path) -> WorkspaceDefaults:
    """The servoing thesis' grid and bounds for a robot.

    A robot that the thesis does not have gets a grid in its frame and the bounds of the spatial or
    planar robots there, which were chosen for a frame of 1.2 m.

    Args:
        robot: The robot.
        name: Its name in the catalogue, the path of its file, or itself, with its name.
    """
    name = name.name if isinstance(name, Robot) else str(name)
    path = robot_file(name).parent / FILE if name in robot_names() else None
    if path is not None and path.is_file():
        settings = load_typed(WorkspaceSettings, path, error=BoundsFileError)
        grid, bounds = settings.grid, settings.bounds.bounds()
        return WorkspaceDefaults(grid.lower, grid.upper, grid.step, bounds, settings.source)
    size = robot.frame.upper - robot.frame.lower
    lower, upper = robot.frame.lower + INSET * size, robot.frame.upper - INSET * size
    lower[2] = robot.frame.lower[2]
    near, far = robot.reach()
    still = near == far
    lower[still] = upper[still] = near[still]
    step = (upper - lower) / (np.array(COUNTS) - 1)
    step[step == 0.0] = 1.0  # one point along z
    return WorkspaceDefaults(
        lower, upper, step,
        PLANAR_BASELINE if robot.motion_type().is_horizontal_body else BASELINE,
        "grid from the robot's frame; bounds of the servoing thesis' robots, frame 1.2 m",
    )  # fmt: skip

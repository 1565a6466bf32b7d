"""Options of `cdpr plan`, and what their words mean."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from pydrake.math import RigidTransform

from cdpr_drake.analyses.plans import CORNERS, LEAST, FreeSettings
from cdpr_drake.analyses.workspaces import load_obstacles
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import parse_numbers, parse_pose
from cdpr_drake.errors import CdprError

PathOption = Annotated[
    Path | None,
    typer.Option(help="Poses: .csv of x,y,z[,phi,theta,psi] [m, deg], or G-code of G0 and G1."),
]
Waypoints = Annotated[
    str | None,
    typer.Option(help="Poses x,y,z or x,y,z,phi,theta,psi [m, deg], with ; between them."),
]
Corners = Annotated[
    str,
    typer.Option(
        help="At the poses: smooth (a spline), blend (lines, corners rounded) or rest (lines, "
        "a rest in each corner).",
        autocompletion=words_among(CORNERS),
    ),
]
Tolerance = Annotated[float, typer.Option(help="How far rounded corners may pass from a pose [m].")]
CableSpeed = Annotated[
    float | None,
    typer.Option(help="Largest cable speed; without, at the motors' rated one [m/s]."),
]
CableAcceleration = Annotated[
    float | None, typer.Option(help="Largest cable acceleration; without, none [m/s^2].")
]
Speed = Annotated[float | None, typer.Option(help="Largest speed of Po; without, none [m/s].")]
Reserve = Annotated[float, typer.Option(help="Share of all limits that is left to feedback.")]
Stations = Annotated[int, typer.Option(help="Points at which limits are asked.")]
Pulleys = Annotated[bool, typer.Option(help="Cables run over the robot's pulleys.")]
Track = Annotated[bool, typer.Option(help="Also have the simulated robot track the plan at 1 kHz.")]
Out = Annotated[
    Path | None, typer.Option(help="Results folder; without, plans/ROBOT, or ROBOT-2, ...")
]
Free = Annotated[
    bool, typer.Option("--free", help="The path is free: from one pose to another, no path given.")
]
From = Annotated[
    str | None, typer.Option("--from", help="With --free: pose at the start, as of --waypoints.")
]
To = Annotated[
    str | None, typer.Option("--to", help="With --free: pose at the end, as of --waypoints.")
]
Least = Annotated[
    str | None,
    typer.Option(
        help="With --free: least time (without this option), tension (mean square, needs "
        "--duration) or energy (that over the time).",
        autocompletion=words_among(LEAST),
    ),
]
Duration = Annotated[
    float | None, typer.Option(help="With --free: time that the motion takes [s].")
]
Clearance = Annotated[
    float | None,
    typer.Option(
        help="With --free: least distance of cables from each other, and of cables and platform "
        "from --obstacles [m]."
    ),
]
Obstacles = Annotated[
    Path | None,
    typer.Option(help="With --free: boxes in the way, YAML as of cdpr workspace --obstacles."),
]
KeepInView = Annotated[
    str | None,
    typer.Option(
        help="With --free: points x,y,z of W [m], with ; between them, that the camera on the "
        "platform sees all along."
    ),
]
Camera = Annotated[
    str | None, typer.Option(help="With --keep-in-view: which mounting; without, the only one.")
]
Nearest = Annotated[
    float | None, typer.Option(help="With --keep-in-view: least depth of the points [m].")
]
Knots = Annotated[int | None, typer.Option(help="With --free: instants at which limits are asked.")]


@dataclass(frozen=True)
class FreeWords:
    """What users wrote of a free path; None: nothing."""

    start: str | None
    goal: str | None
    least: str | None
    duration: float | None
    clearance: float | None
    obstacles: Path | None
    keep_in_view: str | None
    camera: str | None
    nearest: float | None
    knots: int | None

    OPTIONS = (
        "--from", "--to", "--least", "--duration", "--clearance", "--obstacles", "--keep-in-view",
        "--camera", "--nearest", "--knots",
    )  # fmt: skip

    def given(self) -> list[str]:
        """Names of the options that were given."""
        names = list(self.__dataclass_fields__)
        return [
            option
            for option, name in zip(self.OPTIONS, names, strict=True)
            if getattr(self, name) is not None
        ]

    def settings(self) -> FreeSettings:
        """What is asked.

        Raises:
            CdprError: Something is missing or not accepted; names the option.
        """
        if self.start is None or self.goal is None:
            missing = "--from" if self.start is None else "--to"
            raise CdprError(f"{missing}: found none with --free; accepted: a pose")
        if self.keep_in_view is None and (self.camera or self.nearest) is not None:
            raise CdprError(
                "--keep-in-view: found none with --camera or --nearest; accepted: points"
            )
        chosen = {
            name: value
            for name in ("least", "duration", "clearance", "camera", "nearest", "knots")
            if (value := getattr(self, name)) is not None
        }
        points = None
        if self.keep_in_view is not None:
            points = np.array(
                [
                    parse_numbers("--keep-in-view", word, (3,), "points x,y,z [m], with ; between")
                    for word in self.keep_in_view.split(";")
                ]
            ).T
        obstacles = None if self.obstacles is None else load_obstacles(self.obstacles)
        return FreeSettings(
            start=one_pose("--from", self.start), goal=one_pose("--to", self.goal),
            in_view=points, obstacles=obstacles, **chosen,
        )  # fmt: skip

    def as_dict(self) -> dict[str, object]:
        """For JSON, by the names of the options."""
        names = list(self.__dataclass_fields__)
        values = [getattr(self, name) for name in names]
        return {
            option.removeprefix("--").replace("-", "_"): str(v) if isinstance(v, Path) else v
            for option, v in zip(self.OPTIONS, values, strict=True)
        }


def one_pose(option: str, words: str) -> RigidTransform:
    """A pose of an option; raises as `parse_pose`, under its name."""
    try:
        return parse_pose(words)
    except CdprError as problem:
        raise CdprError(str(problem).replace("--pose", option, 1)) from problem

"""What may change in a design and what is wanted of it, as a YAML file."""

from pathlib import Path
from typing import Annotated

import numpy as np

from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.errors import DesignError
from cdpr_drake.schema.declarations import In, OneOf, Text, filled, settings, values
from cdpr_drake.schema.typed_yaml import load_typed

AXES = {"x": (0,), "y": (1,), "z": (2,), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
"""Symmetries by name: normals of planes, and axes that half a turn turns round."""

EVOLUTION, BY_SLOPES = "evolution", "slopes"
SEARCHES = (EVOLUTION, BY_SLOPES)
"""How designs are sought."""


@settings
class MovedSettings:
    """Points that may move, each within a box about where it is."""

    reach: Annotated[np.ndarray, In("m", 3, ge=0.0), "How far, either way along x, y, z."] = values(
        0.0, 0.0, 0.0
    )
    cables: Annotated[list[Text], "Of which cables; none: of all."] = filled(list)


@settings
class MirrorSettings:
    """A symmetry that a design keeps if the robot has it."""

    axis: Annotated[
        str,
        OneOf(AXES),
        "x, y, z: normal of a plane, in W and in P; xy, xz, yz: half a turn about the third axis.",
    ]
    pairs: Annotated[
        list[Text], "Cables that are images of each other, such as C1-C4; or C1-C1."
    ] = filled(list)


@settings
class WinchSettings:
    """Sizes of drum and motor; what is left out stays.

    Where one changes, the largest accepted tension is what the motor's rated torque pulls.
    """

    drum_radius: Annotated[np.ndarray | None, In("m", 2, gt=0.0), "Least and largest."] = None
    gear_ratio: Annotated[np.ndarray | None, In("-", 2, gt=0.0), "Least and largest."] = None
    motor_torque: Annotated[np.ndarray | None, In("N m", 2, gt=0.0), "Least and largest."] = None


@settings
class GoalSettings:
    """Something that is wanted, in comparison with the robot as it is."""

    name: Annotated[str, OneOf(GOALS), "One of the goals."]
    weight: Annotated[float, In("-", gt=0.0), "How much it counts."] = 1.0


@settings
class PosesSettings:
    """Poses at which a design is judged; null: the box of the robot's workspace questions."""

    lower: Annotated[np.ndarray | None, In("m", 3), "Lower corner in W."] = None
    upper: Annotated[np.ndarray | None, In("m", 3), "Upper corner in W."] = None
    counts: Annotated[np.ndarray, In("-", 3, ge=1.0), "Points along x, y, z."] = values(7, 7, 5)
    turn_deg: Annotated[
        float,
        In("deg", ge=0.0, le=90.0),
        "Judged level and turned by so much either way about x, y and z.",
    ] = 0.0


@settings
class DesignSettings:
    """What may change in a design, what is wanted of it, and how long to search."""

    title: Annotated[Text, "What it is, in one line."] = ""
    exit_points: Annotated[MovedSettings, "Exit points."] = filled(MovedSettings)
    anchor_points: Annotated[MovedSettings, "Anchor points."] = filled(MovedSettings)
    mirrors: Annotated[list[MirrorSettings], "Symmetries of the moves."] = filled(list)
    cables: Annotated[
        list[Text], "Sets of cables to try, such as C1,C3,C5,C7; none: all cables."
    ] = filled(list)
    winch: Annotated[WinchSettings, "Drum and motor."] = filled(WinchSettings)
    goals: Annotated[list[GoalSettings], "What is wanted; scores are weighted sums."]
    poses: Annotated[PosesSettings, "Where."] = filled(PosesSettings)
    force: Annotated[float, In("N", ge=0), "Forces to resist, up to so much along each axis."] = 0.0
    moment: Annotated[float, In("N m", ge=0), "Moments to resist, about each axis."] = 0.0
    search: Annotated[
        str,
        OneOf(SEARCHES),
        "evolution: CMA-ES, for any goals; slopes: sequential linear programs by exact "
        "slopes, for capacity-margin alone, with far fewer designs.",
    ] = EVOLUTION
    generations: Annotated[
        int,
        In(ge=1),
        "Generations of the search, or designs of one by slopes, for each set of cables.",
    ] = 60
    population: Annotated[int | None, In(), "Designs of a generation; null: as CMA-ES has it."] = (
        None
    )
    seed: Annotated[int, In(ge=0), "Of the search."] = 0

    @property
    def goal_names(self) -> tuple[str, ...]:
        """Names of the goals."""
        return tuple(goal.name for goal in self.goals)


def load_design_settings(path: Path) -> DesignSettings:
    """Reads a file of design parameters.

    Raises:
        DesignError: The file cannot be read, or a value is not accepted.
    """
    if not path.is_file():
        raise DesignError(f"{path}: there is no such file of design parameters")
    return load_typed(DesignSettings, path, error=DesignError)

"""What may change in a design and what is wanted of it, as a YAML file.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.errors import DesignError
from cdpr_drake.schema.fields import array, number, section, sections, text, texts, whole
from cdpr_drake.schema.typed_yaml import load_typed

AXES = {"x": (0,), "y": (1,), "z": (2,), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
"""Symmetries by name: normals of planes, and axes that half a turn turns round."""

EVOLUTION, BY_SLOPES = "evolution", "slopes"
SEARCHES = (EVOLUTION, BY_SLOPES)
"""How designs are sought."""


@dataclass(kw_only=True)
class MovedSettings:
    """Points that may move, each within a box about where it is."""

    reach: np.ndarray = array(
        "How far, either way along x, y, z.", "m", (3,), [0.0, 0.0, 0.0], at_least=0.0
    )
    cables: list[str] = texts("Of which cables; none: of all.")


@dataclass(kw_only=True)
class MirrorSettings:
    """A symmetry that a design keeps if the robot has it."""

    axis: str = text(
        "x, y, z: normal of a plane, in W and in P; xy, xz, yz: half a turn about the third axis.",
        choices=tuple(AXES),
    )
    pairs: list[str] = texts("Cables that are images of each other, such as C1-C4; or C1-C1.")


@dataclass(kw_only=True)
class WinchSettings:
    """Sizes of drum and motor; what is left out stays.

    Where one changes, the largest accepted tension is what the motor's rated torque pulls.
    """

    drum_radius: np.ndarray | None = array("Least and largest.", "m", (2,), None, above=0.0)
    gear_ratio: np.ndarray | None = array("Least and largest.", "-", (2,), None, above=0.0)
    motor_torque: np.ndarray | None = array("Least and largest.", "N m", (2,), None, above=0.0)


@dataclass(kw_only=True)
class GoalSettings:
    """Something that is wanted, in comparison with the robot as it is."""

    name: str = text("One of the goals.", choices=GOALS)
    weight: float = number("How much it counts.", "-", 1.0, above=0.0)


@dataclass(kw_only=True)
class PosesSettings:
    """Poses at which a design is judged; null: the box of the robot's workspace questions."""

    lower: np.ndarray | None = array("Lower corner in W.", "m", (3,), None)
    upper: np.ndarray | None = array("Upper corner in W.", "m", (3,), None)
    counts: np.ndarray = array("Points along x, y, z.", "-", (3,), [7, 7, 5], at_least=1.0)
    turn_deg: float = number(
        "Judged level and turned by so much either way about x, y and z.",
        "deg",
        0.0,
        at_least=0.0,
        at_most=90.0,
    )


@dataclass(kw_only=True)
class DesignSettings:
    """What may change in a design, what is wanted of it, and how long to search."""

    title: str = text("What it is, in one line.", "")
    exit_points: MovedSettings = section("Exit points.", MovedSettings, required=False)
    anchor_points: MovedSettings = section("Anchor points.", MovedSettings, required=False)
    mirrors: list[MirrorSettings] = sections("Symmetries of the moves.", required=False)
    cables: list[str] = texts("Sets of cables to try, such as C1,C3,C5,C7; none: all cables.")
    winch: WinchSettings = section("Drum and motor.", WinchSettings, required=False)
    goals: list[GoalSettings] = sections("What is wanted; scores are weighted sums.")
    poses: PosesSettings = section("Where.", PosesSettings, required=False)
    force: float = number("Forces to resist, up to so much along each axis.", "N", 0.0, at_least=0)
    moment: float = number("Moments to resist, about each axis.", "N m", 0.0, at_least=0)
    search: str = text(
        "evolution: CMA-ES, for any goals; slopes: sequential linear programs by exact slopes, for "
        "capacity-margin alone, with far fewer designs.",
        EVOLUTION,
        choices=SEARCHES,
    )
    generations: int = whole(
        "Generations of the search, or designs of one by slopes, for each set of cables.",
        60,
        at_least=1,
    )
    population: int | None = whole("Designs of a generation; null: as CMA-ES has it.", None)
    seed: int = whole("Of the search.", 0, at_least=0)

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

"""The schema of a mechanism's file: any plant of Drake, and cables between its frames.

`Robot` is one platform on cables from the world; a `Mechanism` names a file of bodies and joints,
and cables that run between any of its frames. Both share materials and tension bounds.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.models.materials import CableMaterial, OwnMaterial, own_material
from cdpr_drake.models.robot_schema import Pose, TensionBounds
from cdpr_drake.schema.fields import (
    array,
    file_name,
    named_numbers,
    named_sections,
    named_texts,
    number,
    optional_section,
    section,
    sections,
    text,
)
from cdpr_drake.summaries import Summarized

WORLD = "world"
"""Name of the world's frame in files of mechanisms."""


@dataclass(kw_only=True)
class Eyelet:
    """A point that a cable runs through without friction."""

    frame: str = text("Frame that carries it.")
    point: np.ndarray = array("Where it is in that frame.", "m", (3,))


@dataclass(kw_only=True)
class EndPulley:
    """Swivelling pulleys at the exit or the anchor points of all cables."""

    radius: float = number("Radius of the groove.", "m", at_least=0.0)
    swivel_axis: np.ndarray = array(
        "Axis about which a pulley swivels, in the frame of its point, in the direction in which "
        "the cable arrives from where it is wound or fixed; of any length.",
        "-",
        (3,),
        (0.0, 0.0, 1.0),
    )


@dataclass(kw_only=True)
class MechanismCable:
    """One cable, from a point in a frame, through eyelets, to a point in a frame."""

    name: str = file_name("Name, once in a mechanism.")
    exit_point: np.ndarray = array("Exit point in `exit_frame`.", "m", (3,))
    exit_frame: str = text(
        "Frame or body of the exit point, as model::frame, or as frame where that is one.", WORLD
    )
    via: list[Eyelet] = sections("Eyelets from the exit to the anchor point.", required=False)
    anchor_point: np.ndarray = array("Anchor point in `anchor_frame`.", "m", (3,))
    anchor_frame: str = text("Frame or body of the anchor point.")
    swivel_axis: np.ndarray | None = array(
        "Swivel axis of its pulley, in `exit_frame`; null: that of `pulley`.", "-", (3,), None
    )
    pulley_radius: float | None = number(
        "Radius of the groove of its pulley; null: that of `pulley`.", "m", None, at_least=0.0
    )
    anchor_swivel_axis: np.ndarray | None = array(
        "Swivel axis of its pulley at the anchor point, in `anchor_frame`; null: that of "
        "`anchor_pulley`.",
        "-",
        (3,),
        None,
    )
    anchor_pulley_radius: float | None = number(
        "Radius of the groove of its pulley at the anchor point; null: that of `anchor_pulley`.",
        "m",
        None,
        at_least=0.0,
    )
    material: OwnMaterial | None = optional_section(
        "What it is made of where that differs from `cable`; null: nothing differs."
    )

    def route(self) -> list[tuple[str, str, Array]]:
        """Its points: key in the file, frame and point, from the exit to the anchor point."""
        return [
            ("exit_frame", self.exit_frame, self.exit_point),
            *((f"via[{k}].frame", each.frame, each.point) for k, each in enumerate(self.via)),
            ("anchor_frame", self.anchor_frame, self.anchor_point),
        ]


@dataclass(kw_only=True)
class MechanismHome:
    """Where joints and bodies are at home."""

    joints: dict[str, np.ndarray] = named_numbers(
        "Positions of joints by name, model::joint: a number, or a list where a joint has several.",
        "rad, m",
    )
    bodies: dict[str, Pose] = named_sections(
        "Poses in W of bodies that no joint carries, by name, model::body."
    )


@dataclass(kw_only=True, repr=False)
class Mechanism(Summarized):
    """A plant of Drake with cables between its frames."""

    name: str = file_name("Name, the same as that of its folder.")
    title: str = text("What it is, in one line.", "")
    mechanism: str = text(
        "File of its bodies and joints: Drake's model directives, URDF, SDFormat or MJCF; relative "
        "to this file, or package://."
    )
    packages: dict[str, str] = named_texts(
        "Folders of packages by name, relative to this file, for package:// beside those with a "
        "package.xml beside or above this file."
    )
    gravity: float = number("Acceleration along `gravity_direction`.", "m/s^2", 9.81, at_least=0.0)
    gravity_direction: np.ndarray = array(
        "Where gravity points in W, of any length.", "-", (3,), (0.0, 0.0, -1.0)
    )
    cable: CableMaterial = section(
        "Material of the cables; the key `material` of a cable goes before it.", CableMaterial
    )
    pulley: EndPulley | None = optional_section(
        "Pulleys at the exit points; null: the cables leave from fixed points."
    )
    anchor_pulley: EndPulley | None = optional_section(
        "Pulleys at the anchor points; null: the cables are fixed there."
    )
    tension_bounds: TensionBounds = section("Accepted tensions.", TensionBounds)
    home: MechanismHome = section(
        "Positions to start from; what it does not name is as `mechanism` says.",
        MechanismHome,
        required=False,
    )
    cables: list[MechanismCable] = sections("The cables, in the order of all vectors of m.")
    assumptions: str = text("Values that no source gives, and what they were taken from.", "")

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        low, high = self.tension_limits()
        eyelets = sum(len(cable.via) for cable in self.cables)
        frames = sorted({where for cable in self.cables for _, where, _ in cable.route()})
        return f"Mechanism {self.name}: {self.title}".rstrip(": "), [
            ("bodies", Path(self.mechanism).name),
            ("cables", f"{len(self.cables)}, over {eyelets} eyelets"),
            ("frames", ", ".join(frames)),
            ("tensions", f"{low:g} to {high:g} N"),
        ]

    def materials(self) -> list[CableMaterial]:
        """What each cable is made of, m of them."""
        return [own_material(self.cable, cable.material) for cable in self.cables]

    def stiffness(self) -> Array:
        """Axial stiffness E S of every cable, shape (m,) [N]."""
        return np.array([material.axial_stiffness() for material in self.materials()])

    def tension_limits(self, given: tuple[float, float] | None = None) -> tuple[float, float]:
        """Smallest and largest tension [N]: the given ones, or those that the file accepts."""
        return given or (self.tension_bounds.lower, self.tension_bounds.upper)

    def down(self) -> Array:
        """Direction of gravity in W, a unit vector, shape (3,)."""
        return np.asarray(self.gravity_direction / np.linalg.norm(self.gravity_direction) + 0.0)

    def gravity_vector(self) -> Array:
        """Acceleration of a falling body in W, shape (3,) [m/s^2]."""
        return np.asarray(self.gravity * self.down())

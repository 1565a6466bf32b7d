"""The schema of a mechanism's file: any plant of Drake, and cables between its frames.

`Robot` is one platform on cables from the world; a `Mechanism` names a file of bodies and joints,
and cables that run between any of its frames. Both share materials and tension bounds.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.models.cable_schema import CableMaterial, OwnMaterial, TensionBounds, own_material
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import (
    Direction,
    In,
    Name,
    Point,
    Refusal,
    Scope,
    Text,
    filled,
    repeated,
    settings,
    values,
)
from cdpr_drake.schema.input_files import input_there
from cdpr_drake.summaries import Summarized

URL = "package://"
"""How the name of a file of a package begins."""

MODEL_SUFFIXES = (".dmd.yaml", ".dmd.yml", ".urdf", ".sdf", ".xml")
"""Of files of bodies and joints: Drake's model directives, URDF, SDFormat, MJCF."""

WORLD = "world"
"""Name of the world's frame in files of mechanisms."""


@settings
class Eyelet:
    """A point that a cable runs through without friction."""

    frame: Annotated[Text, "Frame that carries it."]
    point: Annotated[Point, "Where it is in that frame."]


@settings
class EndPulley:
    """Swivelling pulleys at the exit or the anchor points of all cables."""

    radius: Annotated[float, In("m", ge=0.0), "Radius of the groove."]
    swivel_axis: Annotated[
        Direction,
        "Axis about which a pulley swivels, in the frame of its point, in the direction "
        "in which the cable arrives from where it is wound or fixed; of any length.",
    ] = values(0.0, 0.0, 1.0)


@settings
class MechanismCable:
    """One cable, from a point in a frame, through eyelets, to a point in a frame."""

    name: Annotated[Name, "Name, once in a mechanism."]
    exit_point: Annotated[Point, "Exit point in `exit_frame`."]
    exit_frame: Annotated[
        Text, "Frame or body of the exit point, as model::frame, or as frame where that is one."
    ] = WORLD
    via: Annotated[list[Eyelet], "Eyelets from the exit to the anchor point."] = filled(list)
    anchor_point: Annotated[Point, "Anchor point in `anchor_frame`."]
    anchor_frame: Annotated[Text, "Frame or body of the anchor point."]
    swivel_axis: Annotated[
        Direction | None,
        "Swivel axis of its pulley, in `exit_frame`; null: that of `pulley`.",
    ] = None
    pulley_radius: Annotated[
        float | None, In("m", ge=0.0), "Radius of the groove of its pulley; null: that of `pulley`."
    ] = None
    anchor_swivel_axis: Annotated[
        Direction | None,
        "Swivel axis of its pulley at the anchor point, in `anchor_frame`; null: that of "
        "`anchor_pulley`.",
    ] = None
    anchor_pulley_radius: Annotated[
        float | None,
        In("m", ge=0.0),
        "Radius of the groove of its pulley at the anchor point; null: that of `anchor_pulley`.",
    ] = None
    material: Annotated[
        OwnMaterial | None,
        "Its material where that differs from `cable`; null: nothing differs.",
    ] = None

    def route(self) -> list[tuple[str, str, Array]]:
        """Its points: key in the file, frame and point, from the exit to the anchor point."""
        return [
            ("exit_frame", self.exit_frame, self.exit_point),
            *((f"via[{k}].frame", each.frame, each.point) for k, each in enumerate(self.via)),
            ("anchor_frame", self.anchor_frame, self.anchor_point),
        ]


@settings
class MechanismHome:
    """Where joints and bodies are at home."""

    joints: Annotated[
        dict[str, np.ndarray],
        In("rad, m", None, single=True),
        "Positions of joints by name, model::joint: a number, or a list where a joint has several.",
    ] = filled(dict)
    bodies: Annotated[
        dict[str, Pose], "Poses in W of bodies that no joint carries, by name, model::body."
    ] = filled(dict)


@settings(repr=False)
class Mechanism(Summarized):
    """A plant of Drake with cables between its frames."""

    name: Annotated[Name, "Name, the same as that of its folder."]
    title: Annotated[Text, "Title in one line."] = ""
    mechanism: Annotated[
        Text,
        "File of its bodies and joints: Drake's model directives, URDF, SDFormat or MJCF;"
        " relative to this file, or package://.",
    ]
    packages: Annotated[
        dict[str, Text],
        "Folders of packages by name, relative to this file, in addition to "
        "those with a package.xml in its folder or above.",
    ] = filled(dict)
    gravity: Annotated[
        float, In("m/s^2", ge=0.0, le=1e3), "Acceleration along `gravity_direction`."
    ] = 9.81
    gravity_direction: Annotated[Direction, "Direction of gravity in W, of any length."] = values(
        0.0, 0.0, -1.0
    )
    cable: Annotated[
        CableMaterial, "Material of the cables; a cable's own `material` overrides it."
    ]
    pulley: Annotated[
        EndPulley | None, "Pulleys at the exit points; null: the cables leave from fixed points."
    ] = None
    anchor_pulley: Annotated[
        EndPulley | None, "Pulleys at the anchor points; null: the cables are fixed there."
    ] = None
    tension_bounds: Annotated[TensionBounds, "Accepted tensions."]
    home: Annotated[
        MechanismHome, "Positions to start from; what it does not name is as `mechanism` says."
    ] = filled(MechanismHome)
    cables: Annotated[list[MechanismCable], "The m cables; all vectors of cables have this order."]
    assumptions: Annotated[Text, "Assumed values, and the reason for each."] = ""

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Cables, names and files that no mechanism has; Drake refuses bodies as it reads them."""
        if not self.cables:
            yield "cables", "none", "at least one cable"
        yield from repeated((cable.name for cable in self.cables), "cables[{}].name")
        if self.cable.behaviour is not None:
            yield "cable.behaviour", "a section", "null: mechanisms have elastic cables"
        if not self.mechanism.lower().endswith(MODEL_SUFFIXES):
            yield "mechanism", self.mechanism, f"a file that ends in {', '.join(MODEL_SUFFIXES)}"
        elif self.mechanism.startswith(URL):
            known = ", ".join(self.packages) or "none is known"
            yield "mechanism", self.mechanism, f"a file of a package: {known}; or the key packages"
        elif not input_there(Path(self.mechanism)):
            yield "mechanism", self.mechanism, "a file that is there"

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """Title and rows of its table."""
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
        """Materials of the m cables."""
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

"""The schema of a platform: mass, box and shape, damping and friction of what it hangs on."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.models.shapes import FITS, PlatformShape
from cdpr_drake.schema.declarations import (
    LONGEST,
    In,
    OneOf,
    Refusal,
    Scope,
    number_words,
    settings,
)

if TYPE_CHECKING:  # statics need none of it
    from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis

BOX_INERTIA, SHAPE_INERTIA = "box", "shape"

TRIANGLE_ROUNDING = 1e-15
"""Moments of inertia of a plate meet the triangle inequality exactly, up to rounding."""


@settings
class HysteresisSettings:
    """Friction against turns of the platform; see `dynamics.contact_hysteresis`."""

    tilt: Annotated[
        float,
        In("N m/rad", ge=0.0, le=1000000.0),
        "Stiffness of contacts that stick, about x and y of P.",
    ] = 0.0
    turn: Annotated[
        float,
        In("N m/rad", ge=0.0, le=1000000.0),
        "Stiffness of contacts that stick, about z of P.",
    ] = 0.0
    slip: Annotated[
        float,
        In("rad", ge=0.0001, le=10.0),
        "Turn at which contacts slip; the largest moment is this times the stiffness.",
    ] = 0.1

    def contacts(self) -> "ContactHysteresis":
        """These numbers as the law takes them."""
        from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis

        return ContactHysteresis(tilt=self.tilt, turn=self.turn, slip=self.slip)


@settings
class Platform:
    """The moving platform; its frame P lies at the middle of the bottom face, z up, unless
    `box_center` says otherwise."""

    mass: Annotated[float, In("kg", gt=0.0, le=1e7), "Mass."]
    size: Annotated[
        np.ndarray, In("m", 3, gt=0.0, le=LONGEST), "Edges of its box along x, y, z of P."
    ]
    box_center: Annotated[
        np.ndarray | None,
        In("m", 3),
        "Middle of the box in P, its edges along the axes of P; null: half its height above Po.",
    ] = None
    center_of_mass: Annotated[
        np.ndarray | None,
        In("m", 3),
        "Centre of mass in P; null: the middle of the box, or Po of a point mass.",
    ] = None
    inertia: Annotated[
        np.ndarray | None,
        In("kg m^2", 6),
        "Moments (xx, yy, zz) and products (xy, xz, yz) of inertia about the centre of "
        "mass, axes of P; null: those of a solid box.",
    ] = None
    shape: Annotated[
        PlatformShape | None,
        "Visual shape within the box, drawn instead of it; null: the box.",
    ] = None
    inertia_of: Annotated[
        str,
        OneOf((BOX_INERTIA, SHAPE_INERTIA)),
        "Homogeneous body that gives inertia and centre of mass where they are not given.",
    ] = BOX_INERTIA
    hysteresis: Annotated[
        HysteresisSettings | None,
        "Dahl friction against its turns, in knots, joints, bending ropes and hanging wires; "
        "null: none.",
    ] = None

    def middle(self) -> Array:
        """Middle of the box in P, shape (3,) [m]."""
        if self.box_center is not None:
            return np.asarray(self.box_center, float)
        return np.array([0.0, 0.0, self.size[2] / 2.0])

    def rotational_inertia(self) -> Array:
        """About the centre of mass, axes of P, shape (3, 3) [kg m^2]; of a box if not given."""
        if self.inertia is None:
            x, y, z = np.square(self.size)
            return self.mass / 12.0 * np.diag([y + z, x + z, x + y])
        xx, yy, zz, xy, xz, yz = self.inertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def has_possible_inertia(self) -> bool:
        """True if a body of positive mass can have these moments of inertia."""
        least, middle, most = np.linalg.eigvalsh(self.rotational_inertia())
        return bool(least > 0.0 and least + middle >= most * (1.0 - TRIANGLE_ROUNDING))

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Moments of inertia that no body has, and a shape that reaches out of the box."""
        if self.inertia is not None and not self.has_possible_inertia():
            accepted = "positive principal moments, none larger than the sum of the other two"
            yield "inertia", number_words(self.inertia), accepted
        is_of_shape = self.inertia_of == SHAPE_INERTIA
        if self.shape is None and is_of_shape:
            yield "inertia_of", "shape", "box, or a section platform.shape"
        if self.shape is None or any(self.shape.refusals(scope)):
            return
        center, edges = self.middle(), np.asarray(self.size, float)
        lowest, highest = center - edges / 2.0, center + edges / 2.0
        slack = FITS * float(np.max(edges))
        lower, upper = self.shape.extent(center)
        if np.any(lower < lowest - slack) or np.any(upper > highest + slack):
            found = f"reaching from {number_words(lower)} to {number_words(upper)} m"
            box = f"{number_words(lowest)} to {number_words(highest)} m"
            yield "shape", found, f"within {box}, the box, with which pulleys and clearances reckon"
        if is_of_shape:
            self.shape.inertia(self.mass, center)


@settings
class PlatformDamping:
    """Viscous damping of the platform's motion about Po, by air, pulleys and joints."""

    translation: Annotated[float, In("N s/m", ge=0.0), "Force per velocity of Po."] = 0.0
    rotation: Annotated[float, In("N m s/rad", ge=0.0), "Moment per angular velocity."] = 0.0

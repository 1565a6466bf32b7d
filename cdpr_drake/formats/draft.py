"""A robot as a file of another tool gives it: what is there, and what is not."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_type import MotionType
from cdpr_drake.models.foreign_text import cable_name


@dataclass(kw_only=True)
class DraftCable:
    """One cable of a draft; None is what the file does not give.

    Attributes:
        name: Name.
        exit_point: p_WA, shape (3,) [m].
        anchor_point: p_PB, shape (3,) [m].
        lower: Smallest tension [N].
        upper: Largest tension [N].
        pulley_radius: Radius of the pulley's groove [m].
        swivel_axis: Direction in W in which the cable arrives at the exit point, shape (3,).
        anchor_pulley_radius: Radius of the groove of its pulley at the platform [m].
        anchor_swivel_axis: Direction in P in which the cable arrives at the anchor point from
            within the platform, shape (3,).
        material: What the file says of this cable's material alone, by the keys of a robot file's
            section `cable`, in SI units.
        drum_radius: Of its own drum, without cable on it [m].
        mechanical_advantage: Parts of line side by side.
        point_std: Standard deviation of p_WA less p_PB along each axis of W, shape (3,) [m]; NaN
            where it was not fitted.
        radius_std: Of its drum's radius [m].
    """

    name: str
    exit_point: Array
    anchor_point: Array
    lower: float | None = None
    upper: float | None = None
    pulley_radius: float | None = None
    swivel_axis: Array | None = None
    anchor_pulley_radius: float | None = None
    anchor_swivel_axis: Array | None = None
    material: dict[str, float] = field(default_factory=dict)
    drum_radius: float | None = None
    mechanical_advantage: float | None = None
    point_std: Array = field(default_factory=lambda: np.full(3, np.nan))
    radius_std: float = np.nan


@dataclass(kw_only=True)
class RobotDraft:
    """What a file says of a robot, in SI units; None is what it does not say.

    The platform's frame P is the file's own; its box may lie anywhere in it.

    Attributes:
        name: Name, letters, digits and underscores.
        title: One line.
        tool: The format, in words.
        motion: A motion type, as `3R3T`.
        axis: Of the motion types that have one, shape (3,); None: z.
        origin: A point of the line or plane, shape (3,) [m].
        cables: The cables.
        mass: Of the platform [kg].
        center_of_mass: p_PPcm, shape (3,) [m].
        inertia: Moments (xx, yy, zz), products (xy, xz, yz) about the centre of mass in P,
            shape (6,) [kg m^2].
        box_size: Edges of the platform's box along the axes of P, shape (3,) [m].
        box_center: Its middle in P, shape (3,) [m].
        plane_height: Height of Po of a planar robot [m].
        home_position: p_WP of the home pose, shape (3,) [m].
        R_WP: Rotation of the home pose, shape (3, 3).
        frame_lower: Lower corner of the frame in W, shape (3,) [m].
        frame_upper: Upper corner, shape (3,) [m].
        beam: Thickness of its beams [m].
        diameter: Of the cables [m].
        youngs_modulus: Of the cables [Pa].
        linear_density: Of the cables [kg/m].
        breaking_load: Of the cables [N].
        drum_radius: Of the winches [m].
        arm: Length of arms that swivel about exit points, across the swivel axes [m].
        gear_ratio: Motor turns per drum turn.
        layers: Of line on the drums, by the keys of a robot file's `winch.layers`.
        motor_speed_rpm: Rated speed of the motors [1/min].
        cable_speed: Largest speed of the cables [m/s], for files without motors.
        motor_inertia: Rotor, gear and drum at the motor's shaft [kg m^2].
        gravity: Acceleration [m/s^2].
        gravity_direction: In W, shape (3,); None: -z.
        remarks: What the file has that was read otherwise, or not kept; a sentence each.
    """

    name: str
    tool: str
    title: str = ""
    motion: str | None = None
    axis: Array | None = None
    origin: Array | None = None
    cables: list[DraftCable] = field(default_factory=list)
    mass: float | None = None
    center_of_mass: Array | None = None
    inertia: Array | None = None
    box_size: Array | None = None
    box_center: Array | None = None
    plane_height: float | None = None
    home_position: Array | None = None
    R_WP: Array | None = None
    frame_lower: Array | None = None
    frame_upper: Array | None = None
    beam: float | None = None
    diameter: float | None = None
    youngs_modulus: float | None = None
    linear_density: float | None = None
    breaking_load: float | None = None
    drum_radius: float | None = None
    arm: float | None = None
    gear_ratio: float | None = None
    layers: dict[str, float] | None = None
    motor_speed_rpm: float | None = None
    cable_speed: float | None = None
    motor_inertia: float | None = None
    gravity: float | None = None
    gravity_direction: Array | None = None
    remarks: list[str] = field(default_factory=list)

    def motion_type(self) -> MotionType:
        """Its motion type; 3R3T where the file does not say."""
        x, y, z = (0.0, 0.0, 1.0) if self.axis is None else self.axis
        return MotionType(self.motion or "3R3T", (float(x), float(y), float(z)))

    def tell_cables_apart(self) -> list[str]:
        """Gives cables names that they can have here, each once; remarks on those that change."""
        said = []
        for place, cable in enumerate(self.cables, start=1):
            name = cable_name(cable.name, place)
            if name != cable.name:
                said.append(f"Cable {cable.name!r} became {name}.")
                cable.name = name
        taken = {cable.name for cable in self.cables}
        seen: set[str] = set()
        for place, cable in enumerate(self.cables, start=1):
            if cable.name in seen:
                free = (f"C{number}" for number in range(place, place + len(self.cables) + 1))
                name = next(name for name in free if name not in taken)
                said.append(
                    f"Cable {place} has the name {cable.name} of another; it became {name}."
                )
                cable.name = name
                taken.add(name)
            seen.add(cable.name)
        return said

    def settle_pulleys(self) -> bool:
        """Whether any cable has a pulley; then the others are given one of radius 0, a point."""
        if all(cable.pulley_radius is None for cable in self.cables):
            return False
        for cable in self.cables:
            cable.pulley_radius = cable.pulley_radius or 0.0
        return True

    def is_level(self) -> bool:
        """Whether it moves in a horizontal plane."""
        return self.motion_type().is_plane and self.motion_type().axis == (0.0, 0.0, 1.0)

    def down(self) -> Array:
        """Direction of gravity in W, a unit vector."""
        if self.gravity_direction is None:
            return np.array([0.0, 0.0, -1.0])
        return np.asarray(self.gravity_direction / np.linalg.norm(self.gravity_direction), float)

    def exit_points(self) -> Array:
        """p_WA, shape (3, m) [m]."""
        return np.array([cable.exit_point for cable in self.cables], float).reshape(-1, 3).T

    def anchor_points(self) -> Array:
        """p_PB, shape (3, m) [m]."""
        return np.array([cable.anchor_point for cable in self.cables], float).reshape(-1, 3).T


def deviation_lines(mark: str, key: str, std: float) -> list[str]:
    """A comment with a standard deviation [m] for a firmware's file; none where it is NaN.

    It has a line of its own: FluidNC takes all up to the end of a line for a value.
    """
    return [f"{mark} {key}: standard deviation {1e3 * std:.2g} mm"] if np.isfinite(std) else []

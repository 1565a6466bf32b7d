"""The schema of a robot file: what a cable robot is, with units and accepted ranges.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables import axial_stiffness
from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry import (
    ALL_ROWS,
    MOTION_TYPES,
    PLANAR_ROWS,
    CableSet,
    MotionType,
    PlatformJoint,
)
from cdpr_drake.models.winch_schema import Winch
from cdpr_drake.schema import array, file_name, number, section, sections, text
from cdpr_drake.spatial import pose_from_angles
from cdpr_drake.winches import Drum, WinchLaw

BEAM_SHARE = 1.0 / 30.0
"""Thickness of a beam of the longest edge, as of ACROBOT, where a file does not give it."""


@dataclass(kw_only=True)
class Pose:
    """A pose as the literature of cable robots writes it, R = Rx(phi) Ry(theta) Rz(psi)."""

    position: np.ndarray = array("Position (x, y, z).", "m", (3,))
    angles_deg: np.ndarray = array("Angles (phi, theta, psi).", "deg", (3,), (0.0, 0.0, 0.0))

    def transform(self) -> RigidTransform:
        """The pose as a RigidTransform."""
        return pose_from_angles(self.position, np.radians(self.angles_deg))


@dataclass(kw_only=True)
class Platform:
    """The moving platform; its frame P lies at the middle of the bottom face, z up, unless
    `box_center` says otherwise."""

    mass: float = number("Mass.", "kg", above=0.0)
    size: np.ndarray = array("Edges of its box along x, y, z of P.", "m", (3,), above=0.0)
    box_center: np.ndarray | None = array(
        "Middle of the box in P, its edges along the axes of P; null: half its height above Po.",
        "m",
        (3,),
        None,
    )
    center_of_mass: np.ndarray | None = array(
        "Centre of mass in P; null: the middle of the box, of a point mass Po.", "m", (3,), None
    )
    inertia: np.ndarray | None = array(
        "Moments (xx, yy, zz) and products (xy, xz, yz) of inertia about the centre of mass, "
        "axes of P; null: those of a solid box.",
        "kg m^2",
        (6,),
        None,
    )


@dataclass(kw_only=True)
class CableMaterial:
    """What the cables are made of; one material for all cables of a robot."""

    youngs_modulus: float = number("Young's modulus.", "Pa", above=0.0)
    diameter: float = number("Diameter.", "m", above=0.0)
    linear_density: float = number("Mass per length.", "kg/m", above=0.0)
    retardation_time: float = number(
        "Time T of the viscous damping, tension = E S (strain + T strain rate).",
        "s",
        at_least=0.0,
        at_most=1.0,  # creep rather than damping; and steps would be nanoseconds
    )
    breaking_load: float | None = number(
        "Tension at which a cable breaks; null where unpublished.", "N", None, above=0.0
    )


@dataclass(kw_only=True)
class Pulley:
    """The swivelling pulleys at the exit points."""

    radius: float = number("Radius of the groove.", "m", at_least=0.0)
    swivel_axis: np.ndarray = array(
        "Direction in W in which the cable arrives at the exit point from its winch, and about "
        "which the pulley swivels; of any length.",
        "-",
        (3,),
        (0.0, 0.0, 1.0),
    )


@dataclass(kw_only=True)
class TensionBounds:
    """Tensions that the robot may hold."""

    lower: float = number("Smallest tension.", "N", at_least=0.0)
    upper: float = number("Largest tension.", "N", above=0.0)


@dataclass(kw_only=True)
class Cable:
    """One cable: where it leaves the frame and where it holds the platform."""

    name: str = text("Name, once in a robot.")
    exit_point: np.ndarray = array("Exit point A in W.", "m", (3,))
    anchor_point: np.ndarray = array("Anchor point B in P.", "m", (3,))
    swivel_axis: np.ndarray | None = array(
        "Swivel axis of its pulley; null: that of `pulley`.", "-", (3,), None
    )
    pulley_radius: float | None = number(
        "Radius of the groove of its pulley; null: that of `pulley`.", "m", None, at_least=0.0
    )


@dataclass(kw_only=True)
class CameraMount:
    """A camera of the catalogue and where it is mounted."""

    name: str = text("Name of the mounting, once in a robot.")
    model: str = text("Camera of the catalogue.")
    parent: str = text("What carries it.", "platform", choices=("platform", "world"))
    pose: Pose = section("Pose of the camera frame C in the parent, z forward, y down.", Pose)


@dataclass(kw_only=True)
class Frame:
    """The robot's frame, a box of beams that the platform must stay in."""

    lower: np.ndarray = array("Lower corner in W.", "m", (3,))
    upper: np.ndarray = array("Upper corner in W.", "m", (3,))
    beam: float | None = number(
        "Thickness of the beams, for drawing; null: a share of the longest edge.",
        "m",
        None,
        above=0.0,
    )

    def beam_width(self) -> float:
        """Thickness of the beams that are drawn [m]."""
        if self.beam is not None:
            return self.beam
        return BEAM_SHARE * float(np.max(self.upper - self.lower))


@dataclass(kw_only=True)
class Robot:
    """A cable-driven parallel robot."""

    name: str = file_name("Name, the same as that of its folder.")
    title: str = text("What it is, in one line.", "")
    motion: str = text(
        "Motion type: of a point mass 1T, 2T, 3T; of a body in a plane 2T1R, also named 1R2T; of a "
        "beam 2R3T; of a body in space 3R3T.",
        "3R3T",
        choices=tuple(MOTION_TYPES),
    )
    axis: np.ndarray | None = array(
        "Of 1T the direction of the line in W, of 2T, 2T1R and 1R2T the normal of the plane in W, "
        "of 2R3T that of the beam in P, of any length; null: z. Line and plane go through the home "
        "position.",
        "-",
        (3,),
        None,
    )
    plane_height: float | None = number(
        "Height of Po in W for a robot in a horizontal plane; null otherwise.", "m", None
    )
    gravity: float = number("Acceleration along `gravity_direction`.", "m/s^2", 9.81, at_least=0.0)
    gravity_direction: np.ndarray = array(
        "Where gravity points in W, of any length.", "-", (3,), (0.0, 0.0, -1.0)
    )
    platform: Platform = section("The moving platform.", Platform)
    cable: CableMaterial = section("Material of the cables.", CableMaterial)
    pulley: Pulley = section("Pulleys.", Pulley)
    winch: Winch = section("Winches.", Winch)
    tension_bounds: TensionBounds = section("Accepted tensions.", TensionBounds)
    frame: Frame = section("The frame.", Frame)
    home: Pose = section("A pose well inside the workspace.", Pose)
    cables: list[Cable] = sections("The cables, in the order of all vectors of m.")
    cameras: list[CameraMount] = sections("Camera mountings.", required=False)
    slack_readings: np.ndarray | None = array(
        "What tension sensors read while the cables are slack; null: zero.", "N", (None,), None
    )
    assumptions: str = text("Values that no source gives, and what they were taken from.", "")

    def exit_points(self) -> Array:
        """p_WA, shape (3, m) [m]."""
        return np.array([cable.exit_point for cable in self.cables], float).T

    def anchor_points(self) -> Array:
        """p_PB, shape (3, m) [m]."""
        return np.array([cable.anchor_point for cable in self.cables], float).T

    def stiffness(self) -> Array:
        """Axial stiffness E S of every cable, shape (m,) [N]."""
        one = axial_stiffness(self.cable.youngs_modulus, self.cable.diameter)
        return np.full(len(self.cables), one)

    def cable_set(self) -> CableSet:
        """The cables with all their constants, over the robot's pulleys.

        `robot.cable_set().without_pulleys()` are the same cables from fixed exit points.
        """
        axes = [
            self.pulley.swivel_axis if cable.swivel_axis is None else cable.swivel_axis
            for cable in self.cables
        ]
        breaking_load = self.cable.breaking_load
        return CableSet.make(
            self.exit_points(),
            self.anchor_points(),
            self.stiffness(),
            retardation=self.cable.retardation_time,
            pulley_radius=np.array(
                [
                    self.pulley.radius if cable.pulley_radius is None else cable.pulley_radius
                    for cable in self.cables
                ]
            ),
            linear_weight=self.cable.linear_density * self.gravity,
            swivel_axis=np.array([axis / np.linalg.norm(axis) for axis in axes], float).T,
            breaking_load=np.inf if breaking_load is None else breaking_load,
            down=self.down(),
        )

    def tension_limits(self, given: tuple[float, float] | None = None) -> tuple[float, float]:
        """Smallest and largest tension [N]: the given ones, or those that the robot may hold."""
        return given or (self.tension_bounds.lower, self.tension_bounds.upper)

    def center_of_mass(self) -> Array:
        """p_PPcm, shape (3,) [m]; where the file gives none, the middle of the box."""
        if self.platform.center_of_mass is None:
            return np.zeros(3) if self.motion_type().is_point else self.box_center()
        return np.asarray(self.platform.center_of_mass, float)

    def box_center(self) -> Array:
        """Middle of the platform's box in P, shape (3,) [m]."""
        if self.platform.box_center is None:
            return np.array([0.0, 0.0, self.platform.size[2] / 2.0])
        return np.asarray(self.platform.box_center, float)

    def drum(self) -> Drum:
        """Drum and gear of the winches."""
        return self.winch.drum(self.cable.diameter)

    def winch_law(self) -> WinchLaw:
        """The winches with their motors.

        Raises:
            RobotFileError: The file does not give the inertia of the motors.
        """
        law = self.winch.law(self.cable.diameter)
        if law is None:
            raise RobotFileError(
                f"robot {self.name}: winch.inertia: found null; accepted: a number > 0 [kg m^2], "
                "which winches with motors need"
            )
        return law

    def motion_type(self) -> MotionType:
        """Which motions the platform has."""
        x, y, z = (0.0, 0.0, 1.0) if self.axis is None else self.axis
        return MotionType(self.motion, (float(x), float(y), float(z)))

    def is_underactuated(self) -> bool:
        """Whether there are fewer cables than degrees of freedom: the weight does the rest."""
        return len(self.cables) < self.motion_type().freedom

    def is_planar(self) -> bool:
        """Whether the platform is a body in a horizontal plane, as servos know it beside 3R3T."""
        return self.motion_type().is_horizontal_body

    def servo_rows(self, asks: str) -> tuple[int, ...]:
        """Rows of twists of a body that servos, computed torque and stability know: all, or three.

        Args:
            asks: What asks, for the error.

        Raises:
            RobotFileError: The robot is of another motion type, or its plane is not horizontal.
        """
        rows = self.motion_type().rows
        if rows not in (ALL_ROWS, PLANAR_ROWS):
            axis = "" if self.axis is None else f", axis {np.round(self.axis, 6).tolist()}"
            raise RobotFileError(
                f"robot {self.name}: motion: found {self.motion}{axis}; accepted by {asks}: 3R3T, "
                "or 2T1R in a horizontal plane"
            )
        return rows

    def joint(self) -> PlatformJoint:
        """What the platform moves by in a simulation."""
        return PlatformJoint.of(self.motion_type(), self.home.transform(), self.plane_height)

    def reach(self) -> tuple[Array, Array]:
        """Corners of the frame, as far as the motion type lets Po go along axes of W [m].

        A horizontal plane is at its height, other planes and lines go through the home position;
        those that lie along no axes of W leave the frame as it is.
        """
        lower, upper = np.array(self.frame.lower, float), np.array(self.frame.upper, float)
        at = np.array(self.home.position, float)
        if self.plane_height is not None:
            at[2] = self.plane_height
        motion = self.motion_type()
        if motion.rows is not None:
            still = [k for k in range(3) if 3 + k not in motion.rows]
            lower[still] = upper[still] = at[still]
        return lower, upper

    def down(self) -> tuple[float, float, float]:
        """Direction of gravity in W, a unit vector."""
        x, y, z = self.gravity_direction / np.linalg.norm(self.gravity_direction) + 0.0
        return float(x), float(y), float(z)

    def gravity_vector(self) -> Array:
        """Acceleration of a falling body in W, shape (3,) [m/s^2]."""
        return self.gravity * np.array(self.down())

    def camera_mount(self, name: str) -> CameraMount:
        """The mounting of that name; the names are checked when a scenario is read."""
        return next(mount for mount in self.cameras if mount.name == name)

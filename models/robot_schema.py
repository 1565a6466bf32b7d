"""The schema of a robot file: what a cable robot is, with units and accepted ranges."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import CableBehaviour
from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.errors import RobotFileError, TensionProblemError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import MOTION_TYPES, MotionType
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import ALL_ROWS, PLANAR_ROWS
from cdpr_drake.models.cable_schema import (
    Cable,
    CableMaterial,
    PlatformPulley,
    Pulley,
    TensionBounds,
    own_material,
)
from cdpr_drake.models.platform_schema import SHAPE_INERTIA, Platform, PlatformDamping
from cdpr_drake.models.robot_refusals import robot_refusals
from cdpr_drake.models.shapes import Frame
from cdpr_drake.models.winch_schema import Winch
from cdpr_drake.schema.declarations import (
    Direction,
    In,
    Name,
    OneOf,
    Point,
    Refusal,
    Scope,
    Text,
    filled,
    settings,
    values,
)
from cdpr_drake.summaries import Summarized, numbers

if TYPE_CHECKING:  # statics need none of them
    from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
    from cdpr_drake.geometry.platform_joint import PlatformJoint
    from cdpr_drake.winches.drum import Drum
    from cdpr_drake.winches.groups import WinchGroups
    from cdpr_drake.winches.motor import WinchLaw


@settings
class Pose:
    """A pose as the literature of cable robots writes it, R = Rx(phi) Ry(theta) Rz(psi)."""

    position: Annotated[Point, "Position (x, y, z)."]
    angles_deg: Annotated[np.ndarray, In("deg", 3), "Angles (phi, theta, psi)."] = values(
        0.0, 0.0, 0.0
    )

    def transform(self) -> RigidTransform:
        """The pose as a RigidTransform."""
        return pose_from_angles(self.position, np.radians(self.angles_deg))


@settings
class CameraMount:
    """A camera of the catalogue, or of a file, and where it is mounted."""

    name: Annotated[Text, "Name of the mounting, once in a robot."]
    model: Annotated[Text, "Camera of the catalogue, or path of a camera file."]
    parent: Annotated[str, OneOf(("platform", "world")), "Body that carries it."] = "platform"
    pose: Annotated[Pose, "Pose of the camera frame C in the parent, z forward, y down."]

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Cameras of no catalogue, and wrong files."""
        from cdpr_drake.models.camera_files import CAMERA_SUFFIXES, camera_names

        if self.model.lower().endswith(CAMERA_SUFFIXES):
            from cdpr_drake.models.camera_catalogue import load_camera

            load_camera(self.model)
        elif self.model not in camera_names():
            names = ", ".join(camera_names())
            yield "model", self.model, f"one of {names}, or the path of a camera file"


@settings(repr=False)
class Robot(Summarized):
    """A cable-driven parallel robot."""

    name: Annotated[Name, "Name, the same as that of its folder."]
    title: Annotated[Text, "Title in one line."] = ""
    motion: Annotated[
        str,
        OneOf(MOTION_TYPES),
        "Motion type: of a point mass 1T, 2T, 3T; of a body in a plane 2T1R, also named "
        "1R2T; of a beam 2R3T; of a body in space 3R3T.",
    ] = "3R3T"
    axis: Annotated[
        Direction | None,
        "Axis of the motion type, of any length: direction of the line in W (1T), normal of the "
        "plane in W (2T, 2T1R, 1R2T), axis of the beam in P (2R3T); null: z. Line and plane go "
        "through the home position.",
    ] = None
    plane_height: Annotated[
        float | None,
        In("m"),
        "Height of Po in W for a robot in a horizontal plane; null otherwise.",
    ] = None
    gravity: Annotated[
        float, In("m/s^2", ge=0.0, le=1e3), "Acceleration along `gravity_direction`."
    ] = 9.81
    gravity_direction: Annotated[Direction, "Direction of gravity in W, of any length."] = values(
        0.0, 0.0, -1.0
    )
    platform: Annotated[Platform, "The moving platform."]
    cable: Annotated[
        CableMaterial, "Material of the cables; a cable's own `material` overrides it."
    ]
    cable_model: Annotated[
        str | None,
        OneOf(tuple((name for name, model in CABLE_MODELS.items() if model.extensible))),
        "Law of tension and length of a cable, in simulations and at rest; scenarios and "
        "options override it. Default: straight cables without weight.",
    ] = None
    damping: Annotated[
        PlatformDamping,
        "Viscous damping of the platform in simulations, in addition to its cables; "
        "scenarios override it.",
    ] = filled(PlatformDamping)
    pulley: Annotated[Pulley, "Pulleys."]
    platform_pulley: Annotated[
        PlatformPulley | None, "Pulleys at the anchor points; null: the cables are fixed there."
    ] = None
    winch: Annotated[Winch, "Winches."]
    tension_bounds: Annotated[TensionBounds, "Accepted tensions."]
    frame: Annotated[Frame, "The frame."]
    home: Annotated[Pose, "A pose well inside the workspace."]
    cables: Annotated[list[Cable], "The m cables; all vectors of cables have this order."]
    cameras: Annotated[list[CameraMount], "Camera mountings."] = filled(list)
    slack_readings: Annotated[
        np.ndarray | None,
        In("N", None),
        "Readings of the tension sensors while the cables are slack; null: zero.",
    ] = None
    assumptions: Annotated[Text, "Assumed values, and the reason for each."] = ""

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Combinations of sections that no robot has."""
        yield from robot_refusals(self)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """Title and rows of its table."""
        low, high = self.tension_limits()
        radii = sorted({float(radius) for radius in self.cable_set().pulley_radius})
        size, m = numbers(self.platform.size), len(self.cables)
        pulleys = f"radius {numbers(radii)} m" if max(radii) > 0.0 else "none, fixed exit points"
        frame = f"({numbers(self.frame.lower)}) to ({numbers(self.frame.upper)}) m"
        return f"Robot {self.name}: {self.title}".rstrip(": "), [
            ("motion", f"{self.motion}, {m} cable{'s' * (m != 1)}"),
            ("platform", f"{self.platform.mass:g} kg, box ({size}) m"),
            ("home", f"({numbers(self.home.position)}) m, ({numbers(self.home.angles_deg)}) deg"),
            ("frame", frame),
            ("tensions", f"{low:g} to {high:g} N"),
            ("pulleys", pulleys),
            ("cables", f"diameter {1e3 * self.cable.diameter:g} mm, "
             f"E {1e-9 * self.cable.youngs_modulus:g} GPa"),
            ("cameras", ", ".join(mount.name for mount in self.cameras) or "none"),
            ("not in its file", "; ".join(f"{k}: {v}" for k, v in self.filled_in().items())
             or "nothing"),
        ]  # fmt: skip

    def filled_in(self) -> dict[str, str]:
        """Values that simulations depend on and the file does not give, by key, in words."""
        platform, found = self.platform, dict[str, str]()
        shape, point = platform.inertia_of == SHAPE_INERTIA, self.motion_type().is_point
        if platform.center_of_mass is None:
            where = "that of its shape" if shape else "Po" if point else "the middle of its box"
            found["platform.center_of_mass"] = f"{where}, ({numbers(self.center_of_mass())}) m"
        if platform.inertia is None and not point:
            found["platform.inertia"] = f"that of {'its shape' if shape else 'a solid box'}"
        if self.cable_model is None:
            found["cable_model"] = "straight, without weight"
        if self.damping == PlatformDamping():
            found["damping"] = "none"
        if self.winch.inertia is not None and self.winch.friction is None:
            found["winch.friction"] = "none"
        return found

    def exit_points(self) -> Array:
        """p_WA where rails stand as the file says, shape (3, m) [m]."""
        return np.array(
            [
                cable.exit_point if cable.rail is None else cable.exit_point + cable.rail.shift()
                for cable in self.cables
            ],
            float,
        ).T

    def anchor_points(self) -> Array:
        """p_PB, shape (3, m) [m]."""
        return np.array([cable.anchor_point for cable in self.cables], float).T

    def materials(self) -> list[CableMaterial]:
        """Materials of the m cables."""
        return [own_material(self.cable, cable.material) for cable in self.cables]

    def cable_behaviour(self) -> CableBehaviour:
        """Effects in addition to the elastic law; none where the file gives no section."""
        settings = self.cable.behaviour
        return CableBehaviour() if settings is None else CableBehaviour(**vars(settings))

    def contact_hysteresis(self) -> "ContactHysteresis | None":
        """Friction against turns of the platform; None where the file gives none."""
        settings = self.platform.hysteresis
        contacts = None if settings is None else settings.contacts()
        return contacts if contacts is not None and contacts.is_there() else None

    def diameters(self) -> Array:
        """Diameters of the cables, shape (m,) [m]."""
        return np.array([material.diameter for material in self.materials()])

    def stiffness(self) -> Array:
        """Axial stiffness E S of every cable, shape (m,) [N]."""
        return np.array([material.axial_stiffness() for material in self.materials()])

    def knows_breaking_loads(self) -> bool:
        """True if the file gives the breaking load of any cable."""
        return any(material.breaking_load is not None for material in self.materials())

    def cable_set(self, pulleys: bool = True) -> CableSet:
        """The cables with all their constants.

        Args:
            pulleys: True: over the robot's pulleys. False: pulleys are ignored, and cables run
                from fixed exit points to fixed anchor points.
        """
        common = self.platform_pulley or PlatformPulley(radius=0.0)
        materials = self.materials()
        loads = [material.breaking_load for material in materials]
        cables = CableSet.make(
            self.exit_points(),
            self.anchor_points(),
            self.stiffness(),
            retardation=np.array([material.retardation_time for material in materials]),
            pulley_radius=np.array(self._each("pulley_radius", self.pulley.radius)),
            linear_weight=np.array([each.linear_density * self.gravity for each in materials]),
            swivel_axis=_unit_columns(self._each("swivel_axis", self.pulley.swivel_axis)),
            arm=self.pulley.arm,
            breaking_load=np.array([np.inf if load is None else load for load in loads]),
            down=self.down(),
        ).over_platform_pulleys(
            np.array(self._each("anchor_pulley_radius", common.radius)),
            _unit_columns(self._each("anchor_swivel_axis", common.swivel_axis)),
        )
        return cables if pulleys else cables.without_pulleys()

    def _each(self, name: str, common: Any) -> list[Any]:
        """A value of each cable: its own, or the common one where it has none."""
        own = [getattr(cable, name) for cable in self.cables]
        return [common if value is None else value for value in own]

    def geometry_words(self, pulleys: bool = True) -> str:
        """Geometry of a result in words: "with pulleys of 20 mm", "pulleys ignored", ...

        Args:
            pulleys: False if the result was computed with `cable_set(pulleys=False)`.
        """
        return self.cable_set().geometry_words(pulleys)

    def tension_limits(self, given: tuple[float, float] | None = None) -> tuple[float, float]:
        """Smallest and largest tension [N]: the given ones, or those that the robot may hold."""
        return given or (self.tension_bounds.lower, self.tension_bounds.upper)

    def center_of_mass(self) -> Array:
        """p_PPcm, shape (3,) [m]; where the file gives none, the middle of the box."""
        platform = self.platform
        if platform.center_of_mass is None:
            if platform.inertia_of == SHAPE_INERTIA:
                assert platform.shape is not None
                inertia = platform.shape.inertia(platform.mass, self.box_center())
                return np.array(inertia.get_com())
            return np.zeros(3) if self.motion_type().is_point else self.box_center()
        return np.asarray(self.platform.center_of_mass, float)

    def box_center(self) -> Array:
        """Middle of the platform's box in P, shape (3,) [m]."""
        return self.platform.middle()

    def drum(self) -> "Drum":
        """Drums and gears of the winches, blocks and tackles included."""
        return self.winch.drum(self._drum_diameter(), *self._own_drums())

    def winch_law(self) -> "WinchLaw":
        """The winches with their motors.

        Raises:
            RobotFileError: The file does not give the inertia of the motors.
        """
        groups = self.winch_groups()
        shared = groups if groups.are_shared() else None
        law = self.winch.law(self._drum_diameter(), shared, *self._own_drums())
        if law is None:
            raise RobotFileError(
                f"robot {self.name}: winch.inertia: found null; accepted: a number > 0 [kg m^2], "
                "which winches with motors need"
            )
        return law

    def winch_groups(self) -> "WinchGroups":
        """The winch of each cable."""
        from cdpr_drake.winches.groups import WinchGroups

        return WinchGroups.of_names([cable.winch for cable in self.cables])

    def _drum_diameter(self) -> float | Array:
        """Of the cable on the drums [m]: one number where all are alike, else shape (m,)."""
        diameters = self.diameters()
        alike = bool(np.all(diameters == diameters[0]))
        return float(diameters[0]) if alike else diameters

    def _own_drums(self) -> tuple[Array | None, Array | None]:
        """Radii of the drums [m] and mechanical advantages, shape (m,); None where all are the
        winch's, and 1."""
        own = any(cable.drum_radius is not None for cable in self.cables)
        advantages = np.array([cable.mechanical_advantage for cable in self.cables])
        return (
            np.array(self._each("drum_radius", self.winch.drum_radius)) if own else None,
            None if np.all(advantages == 1.0) else advantages,
        )

    def motion_type(self) -> MotionType:
        """The motion type with its axis."""
        x, y, z = (0.0, 0.0, 1.0) if self.axis is None else self.axis
        return MotionType(self.motion, (float(x), float(y), float(z)))

    def is_underactuated(self) -> bool:
        """True if there are fewer cables than degrees of freedom, so that the weight poses it."""
        return len(self.cables) < self.motion_type().freedom

    def is_planar(self) -> bool:
        """True if the platform is a body in a horizontal plane, which servos accept like 3R3T."""
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

    def joint(self) -> "PlatformJoint":
        """The joint of the platform in a simulation."""
        from cdpr_drake.geometry.platform_joint import PlatformJoint

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

    def wrench_matrix(self, pose: object = None, pulleys: bool = True) -> Array:
        """Wrench matrix W at a pose: tensions t load the platform with W t.

        W = -J^T with the Jacobian J of the cables' lengths, l_dot = J V_WP.

        Args:
            pose: X_WP as `pose_of` takes it [m]; None: the home pose.
            pulleys: False for cables that run straight from their exit points.

        Returns:
            Shape (n, m): rows of moments about Po [m] first, then of forces [-], in W; columns in
            the order of the cables. A robot with n < 6 degrees of freedom has the rows that
            `MotionType.components` says: in a horizontal plane the moment about z, f_x and f_y.

        Raises:
            TensionProblemError: It is no pose.
            CableGeometryError: A cable cannot run there.

        Source: servoing thesis (1.15) to (1.20).
        """
        X_WP = pose_of(self.home, pose)
        J = cable_jacobian(X_WP, self.cable_set(pulleys))
        W: Array = self.motion_type().components(-J.T, X_WP.rotation().matrix())
        return W

    def camera_mount(self, name: str) -> CameraMount:
        """The mounting of a name, which scenarios check when they are read."""
        return next(mount for mount in self.cameras if mount.name == name)


def _unit_columns(axes: list[Array]) -> Array:
    """Unit vectors along axes, shape (3, m); an axis of many cables is measured once."""
    distinct = {id(axis): axis for axis in axes}
    units = {key: axis / np.linalg.norm(axis) for key, axis in distinct.items()}
    return np.array([units[id(axis)] for axis in axes], float).T


ROTATION_TOLERANCE = 1e-6
"""How far a rotation that is given by numbers may be off an orthonormal one [-]."""

EXACT_ROTATION = 1e-14
"""A rotation that is off by less is taken as it is, else the nearest one [-]."""


def pose_of(home: Pose, pose: object = None) -> RigidTransform:
    """X_WP of a pose that is given in one of several ways.

    Args:
        home: The home pose.
        pose: X_WP as 3 numbers, position [m] at angles of zero; as 6 numbers, position [m] and
            angles (phi, theta, psi) [deg], as a `Pose` has them; as `Pose`, RigidTransform or
            matrix of shape (4, 4) [m]; None: the home pose.

    Raises:
        TensionProblemError: It is none of these, or no pose.
    """
    if pose is None:
        return home.transform()
    if isinstance(pose, RigidTransform):
        return pose
    if isinstance(pose, Pose):
        return pose.transform()
    accepted = (
        "x, y, z [m], or x, y, z, phi, theta, psi [m, deg], a Pose, a RigidTransform, a matrix of "
        "shape (4, 4), or None for the home pose"
    )
    try:
        matrix = np.asarray(pose, float)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape in ((3,), (6,)) and np.all(np.isfinite(matrix)):
        angles = matrix[3:] if matrix.size == 6 else np.zeros(3)
        return pose_from_angles(matrix[:3], np.radians(angles))
    if matrix.shape != (4, 4):
        shape = f" of shape {matrix.shape}" if matrix.size else ""
        raise TensionProblemError(
            f"pose: found a {type(pose).__name__}{shape}; accepted: {accepted}"
        )
    R = matrix[:3, :3]
    off = float(np.max(np.abs(R @ R.T - np.eye(3))))
    if (
        not off <= ROTATION_TOLERANCE
        or np.linalg.det(R) < 0.0
        or not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0))
    ):
        raise TensionProblemError(
            "pose: found a matrix that is no pose; accepted: a rotation, a position [m], and the "
            "last row 0 0 0 1"
        )
    if off > EXACT_ROTATION:
        R = RotationMatrix.ProjectToRotationMatrix(R).matrix()
    return RigidTransform(RotationMatrix(R), matrix[:3, 3])

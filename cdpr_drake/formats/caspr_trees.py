"""CASPR models of several bodies, and of joints that leave a body less than cables could move.

A model is a tree of links. The frame of a link lies at the joint that carries it: in its parent's
frame it is at `location` plus the joint's translation, and turned by the joint's rotation. Points
of cables are given in these frames, from the joint or from the link's centre of mass; link 0 is the
world. A cable runs through its points freely, with one force. Gravity is 9.81 m/s^2 along -z.

Every joint is a chain of moves along and turns about axes, the outermost first, each by one of its
coordinates. With R_x, R_y, R_z rotations about fixed axes of the frame before:

    R_X           R_x(q1)                     P_X, P_XZ, T_XYZ   moves by q1, q2, q3
    R_AXIS        about `axis`, of length 1   P_AXIS             along `axis`
    U_XZ          R_x(q1) R_z(q2)             PLANAR_XZ          moves by q1, q2, then R_y(q3)
    S_EULER_XYZ   R_x(q1) R_y(q2) R_z(q3)     SPATIAL_EULER_XYZ  moves by q1..q3, then
    S_FIXED_XYZ   R_z(q3) R_y(q2) R_x(q1)                        R_x(q4) R_y(q5) R_z(q6)

Joints by quaternions, which CASPR has given up, move alike; they are read as their Euler angles.

Source: github.com/darwinlau/CASPR, src/Model/Bodies/Joints (`RelRotationMatrix` and
`RelTranslationVector` of each), src/Model/Bodies/RigidBody/BodyModelRigid.m, and
src/Model/Cables/CableAttachments.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RollPitchYaw, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.formats.caspr_pulleys import (
    PULLEYS,
    read_pulley,
    short_name,
    triple,
)
from cdpr_drake.formats.unread import mark, mark_below, not_kept, watched
from cdpr_drake.models.foreign_text import (
    cable_name,
    child_text,
    fail,
    number,
    numbers,
    read_xml,
)

PRESENTATION = {"@num", "@id", "@name", "@view_angle", "@display_range"}
"""What only names or counts things, or says how they are drawn: a frame comes first."""

GRAVITY = 9.81
"""Of CASPR, along -z [m/s^2]."""

SMALLEST_SHARE = 1e-12
"""Moments of inertia that break the rules of bodies by less, as a share of the largest, are rounded
numbers: files of CASPR have four digits or more."""

THINNEST = 1e-6
"""Repaired bodies extend in every direction by this share, squared, of their largest extent."""

_AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Step:
    """A move along or a turn about one axis, as part of a joint.

    Attributes:
        turns: It is a turn; else a move.
        axis: In the frame before it, of length 1.
        coordinate: Which of the joint's coordinates it goes by, from 0.
    """

    turns: bool
    axis: tuple[float, float, float]
    coordinate: int


def _steps(moves: str, turns: str, turned: tuple[int, ...] = ()) -> tuple[Step, ...]:
    """Moves by the first coordinates, then turns by those that follow, or by those given."""
    order = turned or tuple(range(len(moves), len(moves) + len(turns)))
    return (
        *(Step(False, _AXES[letter], k) for k, letter in enumerate(moves)),
        *(Step(True, _AXES[letter], k) for letter, k in zip(turns, order, strict=True)),
    )


KINDS: dict[str, tuple[Step, ...]] = {
    **{f"R_{a}": _steps("", a) for a in "XYZ"},
    **{f"U_{a}": _steps("", a) for a in ("XY", "YZ", "XZ")},
    **{f"P_{a}": _steps(a, "") for a in ("X", "Y", "Z", "XY", "YZ", "XZ")},
    "PLANAR_XY": _steps("XY", "Z"),
    "PLANAR_YZ": _steps("YZ", "X"),
    "PLANAR_XZ": _steps("XZ", "Y"),
    "T_XYZ": _steps("XYZ", ""),
    "S_EULER_XYZ": _steps("", "XYZ"),
    "S_FIXED_XYZ": _steps("", "ZYX", (2, 1, 0)),
    "SPATIAL_EULER_XYZ": _steps("XYZ", "XYZ"),
}
"""Joints along axes of their frames, by CASPR's names, as chains from the outermost step on."""

AXIS_KINDS = {"R_AXIS": True, "P_AXIS": False}
"""Joints with an axis of their own, and whether they turn."""

QUATERNIONS = {"S_QUATERNION": "S_EULER_XYZ", "SPATIAL_QUATERNION": "SPATIAL_EULER_XYZ"}
"""Joints by quaternions, and those that move alike."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CasprJoint:
    """The joint that carries a link.

    Attributes:
        kind: CASPR's name of it.
        steps: What it does, the outermost first.
        initial: q_initial, shape (n,) [m, rad].
        lower: q_min, shape (n,); None: not given.
        upper: q_max, shape (n,); None: not given.
        actuated: Whether a motor moves it besides the cables.
    """

    kind: str
    steps: tuple[Step, ...]
    initial: Array
    lower: Array | None = None
    upper: Array | None = None
    actuated: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class CasprLink:
    """A link of a model.

    Attributes:
        name: Its name.
        parent: Number of the link that carries it; 0: the world.
        location: Where its joint is in the parent's frame, shape (3,) [m].
        joint: Its joint.
        mass: Mass [kg].
        com: Centre of mass in its frame, shape (3,) [m].
        end: Its end, which CASPR draws, in its frame, shape (3,) [m].
        inertia: Moments (xx, yy, zz), products (xy, xz, yz) about the centre of mass along the axes
            of its frame, shape (6,) [kg m^2].
    """

    name: str
    parent: int
    location: Array
    joint: CasprJoint
    mass: float
    com: Array
    end: Array
    inertia: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class CasprCable:
    """A cable of a model.

    Attributes:
        name: Its name.
        links: Numbers of the links that its points are on, from the first on.
        points: The points in the frames of these links, shape (3, k) [m].
        lower: Smallest force [N]; None: not given.
        upper: Largest force [N]; None: not given.
        stiffness: Stiffness times length, E S [N]; None: it does not stretch.
        diameter: Diameter [m]; None: not given.
        pulley_radius: Radius of a pulley at the first point [m]; 0: none.
        entry: Direction in which the cable comes to that pulley, in W, of length 1, shape (3,).
    """

    name: str
    links: tuple[int, ...]
    points: Array
    lower: float | None = None
    upper: float | None = None
    stiffness: float | None = None
    diameter: float | None = None
    pulley_radius: float = 0.0
    entry: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))


@dataclass(frozen=True, kw_only=True, eq=False)
class CasprTree:
    """A model: links by their numbers, from 1 on, and one set of cables.

    Attributes:
        name: Name of the model.
        links: The links; the first has number 1.
        cables: The cables.
        cable_set: Name of their set.
        display: Corners of what CASPR shows, x x y y z z, shape (6,) [m]; None: not given.
        remarks: What the file has that was read otherwise, or not kept; a sentence each.
    """

    name: str
    links: tuple[CasprLink, ...]
    cables: tuple[CasprCable, ...]
    cable_set: str
    display: Array | None = None
    remarks: tuple[str, ...] = ()

    @property
    def coordinates(self) -> int:
        """Degrees of freedom n of all joints."""
        return sum(len(link.joint.steps) for link in self.links)


def read_tree(
    bodies: Path,
    cables: Path,
    name: str,
    cable_set: str | None = None,
    repair_inertia: bool = False,
) -> CasprTree:
    """Reads the links of a model and one set of its cables.

    Args:
        bodies: File of its links.
        cables: File of its cables.
        name: Name of the model.
        cable_set: The set of cables; None: the default one of the file.
        repair_inertia: Whether moments of inertia that no body can have, and those of rods without
            thickness, become the nearest that a body with a thickness can have; a remark each.

    Raises:
        RobotFileError: A file is not accepted; names element, value and what is accepted.
    """
    remarks: list[str] = []
    root = watched(read_xml(bodies))
    links = _links(bodies, root, repair_inertia, remarks)
    system = root if root.tag == "links" else root.find("links")
    words = "" if system is None else system.get("display_range") or ""
    display = numbers(bodies, "display_range", words, 6) if words.strip() else None
    chosen, found = _cables(cables, cable_set, links, remarks)
    remarks += not_kept(root, PRESENTATION)
    return CasprTree(
        name=name, links=links, cables=found, cable_set=chosen, display=display,
        remarks=tuple(remarks),
    )  # fmt: skip


def _links(path: Path, root: ET.Element, repair: bool, remarks: list[str]) -> tuple[CasprLink, ...]:
    by_number: dict[int, CasprLink] = {}
    for item in root.iter("link_rigid"):
        where = f"link {item.get('num', '?')}"
        num = _whole(path, f"{where}, num", item.get("num"), 1, "a whole number from 1 on")
        if num in by_number:
            raise fail(path, f"{where}, num", num, "numbers that are given once")
        by_number[num] = _link(path, item, where, repair, remarks)
    if not by_number:
        raise fail(path, "link_rigid", "none", "at least one link")
    count = len(by_number)
    if sorted(by_number) != list(range(1, count + 1)):
        raise fail(path, "link_rigid, num", sorted(by_number), f"all of 1 to {count}")
    for num, link in by_number.items():
        seen, at = {num}, link.parent
        while at != 0:
            if at not in by_number:
                raise fail(path, f"link {num}, parent.num", link.parent,
                           f"0, the world, or a link, 1 to {count}")  # fmt: skip
            if at in seen:
                raise fail(path, f"link {num}, parent.num", link.parent,
                           "a link that is carried by the world in the end")  # fmt: skip
            seen.add(at)
            at = by_number[at].parent
    return tuple(by_number[num] for num in range(1, count + 1))


def _link(path: Path, item: ET.Element, where: str, repair: bool, remarks: list[str]) -> CasprLink:
    name = item.get("name") or where
    physical, parent = item.find("physical"), item.find("parent")
    if physical is None or parent is None:
        missing = "physical" if physical is None else "parent"
        raise fail(path, where, f"no {missing}", f"an element <{missing}>")
    mass = number(path, f"{where}, mass", child_text(path, physical, "mass", f"{where}, mass"))
    if mass < 0.0:
        raise fail(path, f"{where}, mass", f"{mass:g}", "at least 0 [kg]")
    com = triple(path, physical, "com_location", where)
    end = triple(path, physical, "end_location", where) if (
        (physical.findtext("end_location") or "").strip()
    ) else np.zeros(3)  # fmt: skip
    num = child_text(path, parent, "num", f"{where}, parent.num")
    inertia = _inertia(path, physical, where, mass, com)
    if repair:
        inertia, words = possible_inertia(inertia), _shown(inertia)
        if _shown(inertia) != words:
            remarks.append(
                f"{where}: principal moments {words} were changed to {_shown(inertia)} kg m^2, the "
                "nearest that a body with a thickness can have."
            )
    elif excess(inertia) > SMALLEST_SHARE:
        raise fail(
            path, f"{where}, inertia", _shown(inertia),
            "principal moments about the centre of mass that a body can have, none above the sum "
            "of the two others; --repair-inertia takes the nearest such ones",
        )  # fmt: skip
    return CasprLink(
        name=name,
        parent=_whole(path, f"{where}, parent.num", num, 0, "a whole number from 0 on"),
        location=triple(path, parent, "location", where),
        joint=_joint(path, item, where, remarks),
        mass=mass,
        com=com,
        end=end,
        inertia=inertia,
    )


def _inertia(path: Path, physical: ET.Element, where: str, mass: float, com: Array) -> Array:
    """Moments and products about the centre of mass, as the file has them."""
    item = physical.find("inertia")
    if item is None:
        raise fail(path, where, "no inertia", "an element <inertia>")
    keys = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    given = np.array(
        [
            number(path, f"{where}, {key}", child_text(path, item, key, f"{where}, {key}"))
            for key in keys
        ]
    )
    reference = item.get("ref", "")
    if reference not in ("com", "joint"):
        raise fail(path, f"{where}, inertia.ref", reference, "com or joint")
    if reference == "joint":
        given = given - mass * _of_point(com)
    return given


def excess(inertia: Array) -> float:
    """By how much a body's extent is below zero in some direction, as a share of its largest.

    Args:
        inertia: Moments and products about the centre of mass, shape (6,).

    Returns:
        At most 0 for bodies that can be; 0 for those without thickness.
    """
    extents = np.linalg.eigvalsh(_second_moments(inertia))
    largest = float(np.max(np.abs(extents)))
    return float(-extents[0]) / largest if largest > 0.0 else 0.0


def possible_inertia(inertia: Array) -> Array:
    """The nearest moments and products of a body that extends in every direction, shape (6,).

    The integral of r r' over the mass, I_3 tr(I) / 2 - I, is positive definite for such a body. Of
    it the eigenvalues below `THINNEST` of the largest are raised to that.

    Args:
        inertia: Moments and products about the centre of mass, shape (6,); zero stays zero.
    """
    values, V = np.linalg.eigh(_second_moments(inertia))
    least = THINNEST * float(values[-1])
    if least <= 0.0 or values[0] >= least:
        return inertia
    S = V @ np.diag(np.maximum(values, least)) @ V.T
    R = np.trace(S) * np.eye(3) - S
    return np.array([R[0, 0], R[1, 1], R[2, 2], R[0, 1], R[0, 2], R[1, 2]])


def _second_moments(inertia: Array) -> Array:
    J = matrix_of(inertia)
    return np.asarray(np.trace(J) / 2.0 * np.eye(3) - J)


def _shown(inertia: Array) -> str:
    return ", ".join(f"{value:.5g}" for value in np.linalg.eigvalsh(matrix_of(inertia)) + 0.0)


def _of_point(p: Array) -> Array:
    """Moments and products of 1 kg at a point."""
    x, y, z = p
    return np.array([y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z])


def matrix_of(inertia: Array) -> Array:
    """Moments and products, shape (6,), as a matrix, shape (3, 3)."""
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _joint(path: Path, item: ET.Element, where: str, remarks: list[str]) -> CasprJoint:
    found = item.find("joint")
    if found is None:
        raise fail(path, where, "no joint", "an element <joint type=...>")
    kind = found.get("type", "").strip().upper()
    given = found.get("q_initial")
    if kind in QUATERNIONS:
        q = _euler_of(
            numbers(path, f"{where}, joint.q_initial", given or "", 4 + 3 * (kind[1] == "P"))
        )
        remarks.append(
            f"{where}: the joint {kind} was read as {QUATERNIONS[kind]}, which moves alike; its "
            "limits were left out."
        )
        kind = QUATERNIONS[kind]
        mark(found, "q_min", "q_max")
        return CasprJoint(kind=kind, steps=KINDS[kind], initial=q, actuated=_actuated(found))
    steps = KINDS.get(kind, ())
    words = found.get("axis")
    if kind in AXIS_KINDS:
        axis = numbers(path, f"{where}, joint.axis", words or "", 3)
        if not np.any(axis):
            raise fail(path, f"{where}, joint.axis", words, "a vector that is not zero")
        x, y, z = axis / np.linalg.norm(axis)
        steps = (Step(AXIS_KINDS[kind], (float(x), float(y), float(z)), 0),)
    elif not steps:
        known = ", ".join((*KINDS, *AXIS_KINDS, *QUATERNIONS))
        raise fail(path, f"{where}, joint.type", kind, known)
    elif words:
        raise fail(path, f"{where}, joint.axis", words, "an axis of R_AXIS and P_AXIS only")
    n = len(steps)
    q = numbers(path, f"{where}, joint.q_initial", given or "", n)
    lower, upper = (
        numbers(path, f"{where}, joint.{key}", found.get(key), n) if found.get(key) else None
        for key in ("q_min", "q_max")
    )
    if lower is not None and upper is not None and np.any(lower > upper):
        raise fail(path, f"{where}, joint.q_min", found.get("q_min"),
                   f"at most q_max, {found.get('q_max')}")  # fmt: skip
    return CasprJoint(
        kind=kind, steps=steps, initial=q, lower=lower, upper=upper, actuated=_actuated(found)
    )


def _actuated(item: ET.Element) -> bool:
    return item.get("actuated", "") == "true"


def _euler_of(q: Array) -> Array:
    """Coordinates by Euler angles of those by a quaternion, moves before it kept."""
    R = RotationMatrix(Quaternion(q[-4:] / np.linalg.norm(q[-4:])))
    return np.concatenate([q[:-4], euler_xyz(R.matrix())])


def euler_xyz(R: Array) -> Array:
    """Angles of R = R_x R_y R_z [rad], the middle one within a right angle, shape (3,)."""
    return -np.asarray(RollPitchYaw(RotationMatrix(R.T)).vector())


def _cables(
    path: Path, wanted: str | None, links: tuple[CasprLink, ...], remarks: list[str]
) -> tuple[str, tuple[CasprCable, ...]]:
    """The name of a set of cables, and its cables."""
    root = watched(read_xml(path))
    sets = {item.get("id", ""): item for item in root.iter("cable_set")}
    if not sets:
        raise fail(path, "cable_set", "none", "at least one")
    name = wanted or root.get("default_cable_set") or next(iter(sets))
    if name not in sets:
        raise fail(path, "default_cable_set" if wanted is None else "cable set", name,
                   "one of " + ", ".join(sets))  # fmt: skip
    filled = [other for other, item in sets.items() if any(_is_cable(child) for child in item)]
    if name not in filled:
        others = "; sets of this file with cables: " + ", ".join(filled) if filled else ""
        raise fail(path, f"cable_set {name}", "no cable", "at least one" + others)
    if len(filled) > 1:
        rest = ", ".join(other for other in filled if other != name)
        remarks.append(f"Cables of the set {name}; the file also has {rest}.")
    for other, item in sets.items():
        if other != name:
            mark_below(item)
    cables: list[CasprCable] = []
    varying: set[str] = set()
    for item in sets[name]:
        if not _is_cable(item):
            if item.tag.startswith("cable_"):
                what = item.get("name", "a spring")
                remarks.append(f"{what}, a passive spring, was left out.")
                mark_below(item)
            continue
        if item.tag not in ("cable_ideal", "cable_linear_spring"):
            varying.add(item.tag)
        cables.append(_cable(path, item, len(cables) + 1, links, remarks))
    if varying:
        remarks.append(
            f"Cables are of the kind {', '.join(sorted(varying))}, whose stiffness depends on "
            "their force; it was not kept."
        )
    remarks += not_kept(root, PRESENTATION)
    return name, _told_apart(cables, remarks)


def _told_apart(cables: list[CasprCable], remarks: list[str]) -> tuple[CasprCable, ...]:
    """Names of cables here, each once; CASPR tells them by their place."""
    known: set[str] = set()
    found = []
    for place, cable in enumerate(cables, 1):
        short = short_name(cable.name)
        name = cable_name(short, place)
        if name != short:
            remarks.append(f"Cable {cable.name!r} became {name}.")
        if name in known:
            name = f"{name}_{place}"
            remarks.append(f"Cable {place} is the second {cable.name!r}; it is called {name!r}.")
        known.add(name)
        found.append(replace(cable, name=name))
    return tuple(found)


def _is_cable(item: ET.Element) -> bool:
    return item.tag.startswith("cable_") and "passive" not in item.tag


def _cable(
    path: Path,
    item: ET.Element,
    place: int,
    links: tuple[CasprLink, ...],
    remarks: list[str],
) -> CasprCable:
    name = item.get("name") or f"cable {place}"
    reference = item.get("attachment_reference", "")
    if reference not in ("com", "joint"):
        raise fail(path, f"{name}, attachment_reference", reference, "com or joint")
    numbers_of, points = [], []
    radius, entry = 0.0, np.array([0.0, 0.0, 1.0])
    holder = item.find("attachments")
    for index, attachment in enumerate(() if holder is None else holder):
        where = f"{name}, attachment {index + 1}"
        if attachment.tag in PULLEYS and index == 0:
            pulley = read_pulley(path, attachment, where, remarks)
            radius, entry = pulley.radius, pulley.entry
            numbers_of.append(0)
            points.append(pulley.point)
            continue
        if attachment.tag != "attachment":
            first = " or ".join(f"<{tag}>" for tag in PULLEYS)
            raise fail(path, where, f"<{attachment.tag}>",
                       f"<attachment>, or as the first one {first}")  # fmt: skip
        link = _whole(path, f"{where}, link", child_text(path, attachment, "link", where), 0,
                      f"0, the world, or a link, 1 to {len(links)}", len(links))  # fmt: skip
        point = triple(path, attachment, "location", where)
        if link and reference == "com":
            point = links[link - 1].com + point
        numbers_of.append(link)
        points.append(point)
    if len(points) < 2:
        raise fail(path, f"{name}, attachments", len(points), "at least two")
    given: dict[str, float | None] = {}
    for key in ("force_min", "force_max", "K", "diameter"):
        text = (item.findtext(f"properties/{key}") or "").strip()
        given[key] = number(path, f"{name}, {key}", text) if text else None
    spring = item.tag == "cable_linear_spring"
    if spring and not (given["K"] or 0.0) > 0.0:
        raise fail(path, f"{name}, K", given["K"], "above 0 [N]")
    low, high = given["force_min"], given["force_max"]
    if low is not None and high is not None and low > high:
        raise fail(path, f"{name}, force_min", f"{low:g}", f"at most force_max, {high:g} [N]")
    return CasprCable(
        name=name, links=tuple(numbers_of), points=np.array(points).T, lower=low, upper=high,
        stiffness=given["K"] if spring else None,
        diameter=given["diameter"] or None, pulley_radius=radius, entry=entry,
    )  # fmt: skip


def _whole(
    path: Path, where: str, value: object, least: int, accepted: str, most: int | None = None
) -> int:
    found = number(path, where, value)
    if found != int(found) or found < least or (most is not None and found > most):
        raise fail(path, where, value, accepted)
    return int(found)

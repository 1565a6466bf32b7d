"""Writes robots as SDFormat, with a chain of joints for each cable, and as URDF.

A cable is a guide that turns about the exit point on a universal joint, and a rod that slides in it
and holds the platform at its end by a ball joint, as the Gazebo simulator's models; rods are as
long as the frame's diagonal. Guides and rods weigh a gram, since links without mass make Gazebo
end. Drake has no loops of joints: for its parser the ball joint is a ball constraint, and guides
need no mass.

Source: Gazebo thesis 5.4, 5.5, where (5.5) should read e = z x u, normalised, and (5.2) prints A
for B; SDFormat 1.9; Drake's parsing documentation for its own elements.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from itertools import product

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.formats.draft import DraftCable, RobotDraft

LINK_MASS = 1e-3
"""Of a guide and of a rod [kg]; Gazebo thesis 5.5."""

FRAME_MASS = 5000.0
"""Of the frame, which is fixed to the world [kg]; Gazebo thesis 5.5."""

_GUIDE_INERTIA = 1e-6


def write_sdformat(draft: RobotDraft, *, for_drake: bool = False) -> str:
    """The robot as SDFormat 1.9, at its home pose.

    It holds points, box, mass, inertia, centre of mass, home pose, frame, diameters, largest
    tension and cable speed; neither elasticity, pulleys nor winches.

    Args:
        draft: The robot.
        for_drake: Whether ball constraints of Drake close the loops instead of ball joints.
    """
    attributes = {"version": "1.9"}
    if for_drake:
        attributes["xmlns:drake"] = "http://drake.mit.edu"
    sdf = ET.Element("sdf", attributes)
    model = ET.SubElement(sdf, "model", name=draft.name)
    _frame_link(model, draft)
    fixed = ET.SubElement(model, "joint", name="frame_to_world", type="fixed")
    _texts(fixed, parent="world", child="frame")
    X_WP = _home(draft)
    _platform_link(model, draft, X_WP)
    diagonal = float(np.linalg.norm(_corners(draft)[1] - _corners(draft)[0]))
    for cable in draft.cables:
        for word, link_name, point in (
            ("exit", "frame", cable.exit_point),
            ("anchor", "platform", cable.anchor_point),
        ):
            frame = ET.SubElement(
                model, "frame", name=f"{word}_{cable.name}", attached_to=link_name
            )
            ET.SubElement(frame, "pose").text = _pose(RigidTransform(point))
        _chain(model, draft, cable, X_WP, diagonal, for_drake=for_drake)
    ET.indent(sdf, "  ")
    return '<?xml version="1.0"?>\n' + ET.tostring(sdf, encoding="unicode") + "\n"


def _corners(draft: RobotDraft) -> tuple[Array, Array]:
    assert draft.frame_lower is not None
    assert draft.frame_upper is not None
    return np.asarray(draft.frame_lower, float), np.asarray(draft.frame_upper, float)


def _home(draft: RobotDraft) -> RigidTransform:
    assert draft.home_position is not None
    assert draft.R_WP is not None
    return RigidTransform(RotationMatrix(draft.R_WP), draft.home_position)


def _frame_link(model: ET.Element, draft: RobotDraft) -> None:
    """The frame with its twelve segments."""
    link = ET.SubElement(model, "link", name="frame")
    _inertial(link, FRAME_MASS, np.array([FRAME_MASS] * 3 + [0.0] * 3))
    for number, (X, length) in enumerate(_beams(draft)):
        visual = ET.SubElement(link, "visual", name=f"segment_{number + 1}")
        ET.SubElement(visual, "pose").text = _pose(X)
        _cylinder(visual, _beam_radius(draft), length)


def _beam_radius(draft: RobotDraft) -> float:
    return float(draft.beam or 0.04) / 2.0


def _beams(draft: RobotDraft) -> Iterator[tuple[RigidTransform, float]]:
    """Poses of the frame's twelve beams, along their z, and their lengths [m]."""
    for start, end in _segments(*_corners(draft)):
        along = end - start
        length = float(np.linalg.norm(along))
        R = RotationMatrix.MakeFromOneVector(along / length, 2)
        yield RigidTransform(R, (start + end) / 2.0), length


def _segments(lower: Array, upper: Array) -> Iterator[tuple[Array, Array]]:
    for axis in range(3):
        for signs in product((0, 1), repeat=2):
            start = np.array(lower)
            others = [k for k in range(3) if k != axis]
            for k, sign in zip(others, signs, strict=True):
                start[k] = upper[k] if sign else lower[k]
            end = np.array(start)
            end[axis] = upper[axis]
            yield start, end


def _platform_link(model: ET.Element, draft: RobotDraft, X_WP: RigidTransform) -> None:
    assert draft.inertia is not None
    assert draft.center_of_mass is not None
    assert draft.box_size is not None
    assert draft.box_center is not None
    link = ET.SubElement(model, "link", name="platform")
    ET.SubElement(link, "pose").text = _pose(X_WP)
    _inertial(link, float(draft.mass or 0.0), draft.inertia, draft.center_of_mass)
    for kind in ("visual", "collision"):
        shape = ET.SubElement(link, kind, name=f"platform_{kind}")
        ET.SubElement(shape, "pose").text = _pose(RigidTransform(draft.box_center))
        box = ET.SubElement(ET.SubElement(shape, "geometry"), "box")
        _texts(box, size=_words(draft.box_size))


def _chain(
    model: ET.Element,
    draft: RobotDraft,
    cable: DraftCable,
    X_WP: RigidTransform,
    longest: float,
    *,
    for_drake: bool,
) -> None:
    """Guide, rod and the joints of a cable, which may become as long as said [m]."""
    name, p_WA, p_WB = cable.name, cable.exit_point, X_WP.multiply(cable.anchor_point)
    along = p_WB - p_WA
    length = float(np.linalg.norm(along))
    R = RotationMatrix.MakeFromOneVector(along / length, 2)
    guide = ET.SubElement(model, "link", name=f"guide_{name}")
    ET.SubElement(guide, "pose").text = _pose(RigidTransform(R, p_WA))
    if for_drake:
        _inertial(guide, 0.0, np.zeros(6))
    else:
        _inertial(guide, LINK_MASS, np.array([_GUIDE_INERTIA] * 3 + [0.0] * 3))
    rod = ET.SubElement(model, "link", name=f"rod_{name}")  # its frame lies at its end B
    ET.SubElement(rod, "pose").text = _pose(RigidTransform(R, p_WB))
    about = LINK_MASS * length**2 / 12.0
    thin = 0.0 if for_drake else _GUIDE_INERTIA
    middle = np.array([0.0, 0.0, -length / 2.0])
    _inertial(rod, LINK_MASS, np.array([about, about, thin, 0.0, 0.0, 0.0]), middle)
    visual = ET.SubElement(rod, "visual", name="cable")
    ET.SubElement(visual, "pose").text = _pose(RigidTransform(middle))
    _cylinder(visual, cable.material.get("diameter", draft.diameter or 0.01) / 2.0, length)
    turn = ET.SubElement(model, "joint", name=f"turn_{name}", type="universal")
    _texts(turn, parent="frame", child=f"guide_{name}")
    for tag, xyz in (("axis", "1 0 0"), ("axis2", "0 1 0")):
        axis = ET.SubElement(turn, tag)
        _texts(axis, xyz=xyz)
        _texts(ET.SubElement(axis, "limit"), effort="0")
    slide = ET.SubElement(model, "joint", name=name, type="prismatic")
    _texts(slide, parent=f"guide_{name}", child=f"rod_{name}")
    axis = ET.SubElement(slide, "axis")
    _texts(axis, xyz="0 0 1")
    limit = ET.SubElement(axis, "limit")
    _texts(limit, lower=repr(-length), upper=repr(max(longest - length, 0.0)),
           effort=repr(float(cable.upper or 0.0)),
           velocity=repr(float(draft.cable_speed or 0.0)))  # fmt: skip
    if for_drake:
        ball = ET.SubElement(model, "drake:ball_constraint")
        for key, text in (("body_A", f"rod_{name}"), ("body_B", "platform"),
                          ("p_AP", "0 0 0"), ("p_BQ", _words(cable.anchor_point))):  # fmt: skip
            ET.SubElement(ball, f"drake:ball_constraint_{key}").text = text
        return
    hold = ET.SubElement(model, "joint", name=f"hold_{name}", type="ball")
    _texts(hold, parent="platform", child=f"rod_{name}")


def write_urdf(draft: RobotDraft) -> str:
    """The platform as URDF, with a link of a name for each exit and anchor point.

    It holds points, box, mass, inertia, centre of mass, home pose and frame; no cables: URDF has no
    loops. All links are one tree, as ROS' parser demands: the frame is fixed to the link `world`,
    and the platform is on a floating joint there, with the home pose as its origin. MuJoCo makes a
    free joint of it. Drake has no such joint, and warns of one that it is not told to ignore; a
    body without a joint is free there.
    """
    assert draft.inertia is not None
    assert draft.center_of_mass is not None
    assert draft.box_size is not None
    assert draft.box_center is not None
    robot = ET.Element("robot", name=draft.name)
    ET.SubElement(robot, "link", name="world")
    frame = ET.SubElement(robot, "link", name="frame")
    for X, length in _beams(draft):
        visual = ET.SubElement(frame, "visual")
        ET.SubElement(visual, "origin", _origin(X))
        ET.SubElement(ET.SubElement(visual, "geometry"), "cylinder",
                      radius=repr(_beam_radius(draft)), length=repr(length))  # fmt: skip
    link = ET.SubElement(robot, "link", name="platform")
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=_words(draft.center_of_mass), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(float(draft.mass or 0.0)))
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    ET.SubElement(
        inertial, "inertia",
        {key: repr(float(value)) for key, value in zip(keys, draft.inertia, strict=True)},
    )  # fmt: skip
    for kind in ("visual", "collision"):
        shape = ET.SubElement(link, kind)
        ET.SubElement(shape, "origin", xyz=_words(draft.box_center), rpy="0 0 0")
        ET.SubElement(ET.SubElement(shape, "geometry"), "box", size=_words(draft.box_size))
    _urdf_joint(robot, "frame_to_world", "fixed", ("world", "frame"), RigidTransform())
    free = _urdf_joint(robot, "platform_in_world", "floating", ("world", "platform"), _home(draft))
    free.set("drake_ignore", "true")
    for cable in draft.cables:
        for word, parent, point in (
            ("exit", "frame", cable.exit_point),
            ("anchor", "platform", cable.anchor_point),
        ):
            name = f"{word}_{cable.name}"
            ET.SubElement(robot, "link", name=name)
            _urdf_joint(robot, f"{name}_fixed", "fixed", (parent, name), RigidTransform(point))
    ET.indent(robot, "  ")
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _urdf_joint(
    robot: ET.Element, name: str, kind: str, links: tuple[str, str], X: RigidTransform
) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(joint, "parent", link=links[0])
    ET.SubElement(joint, "child", link=links[1])
    ET.SubElement(joint, "origin", _origin(X))
    return joint


def _origin(X: RigidTransform) -> dict[str, str]:
    rpy = RollPitchYaw(X.rotation()).vector()
    return {"xyz": _words(X.translation()), "rpy": _words(rpy)}


def _inertial(link: ET.Element, mass: float, inertia: Array, com: Array | None = None) -> None:
    inertial = ET.SubElement(link, "inertial")
    if com is not None:
        ET.SubElement(inertial, "pose").text = _pose(RigidTransform(com))
    _texts(inertial, mass=repr(float(mass)))
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    words = {key: repr(float(value)) for key, value in zip(keys, inertia, strict=True)}
    _texts(ET.SubElement(inertial, "inertia"), **words)


def _cylinder(visual: ET.Element, radius: float, length: float) -> None:
    cylinder = ET.SubElement(ET.SubElement(visual, "geometry"), "cylinder")
    _texts(cylinder, radius=repr(float(radius)), length=repr(float(length)))


def _texts(element: ET.Element, /, **children: str) -> None:
    for tag, text in children.items():
        ET.SubElement(element, tag).text = text


def _pose(X: RigidTransform) -> str:
    return _words([*X.translation(), *RollPitchYaw(X.rotation()).vector()])


def _words(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values, float))

"""The links and joints of a CASPR model as MJCF, which Drake's parser and MuJoCo read.

MJCF lets several joints carry one body, the outermost first, as the joints of CASPR are chains of
moves and turns. So each coordinate of CASPR is the one of a joint here, at the same value, and
rates are the same, too; Drake puts massless bodies between the joints, which the other formats
that it reads would have to name. A body with several joints lies in the origin of the body that
carries it, if need be in one that is fixed there: Drake 1.51 puts all but the last of its joints
into that origin, wherever `pos` says. MuJoCo wants links with a thickness.

Source: mujoco.readthedocs.io, XML reference; github.com/darwinlau/CASPR, src/Model/Bodies.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np

from cdpr_drake.formats.caspr_trees import GRAVITY, CasprJoint, CasprLink, CasprTree, Step
from cdpr_drake.models.foreign_text import robot_name

_BASE = "_base"
_LETTERS = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}


def link_names(tree: CasprTree) -> tuple[str, ...]:
    """Names of the links as bodies have them: letters, digits and underscores, each once.

    Names stay different from those of the massless bodies, which bear the link's name and a number,
    as Drake gives it, or `_base`.
    """
    names: list[str] = []
    for number, link in enumerate(tree.links, 1):
        name = re.sub(r"\W+", "_", link.name, flags=re.ASCII).strip("_") or f"link_{number}"
        while name in names or name.lower() == "world":
            name = f"{name}_{number}"
        names.append(name)
    while clashing := [
        k for k, link in enumerate(tree.links) if not _own_names(names[k], link).isdisjoint(names)
    ]:
        for k in clashing:
            names[k] += "_"
    return tuple(names)


def _own_names(name: str, link: CasprLink) -> set[str]:
    """Names of the massless bodies of a link, beside its own."""
    return {f"{name}{_BASE}", *(f"{name}{i}" for i in range(len(link.joint.steps)))}


def joint_names(tree: CasprTree) -> tuple[tuple[str, ...], ...]:
    """Names of the joints of each link, by its coordinates.

    They are the link's name with x, y, z for moves and rx, ry, rz for turns about axes of the
    frame, `move` and `turn` along and about others.
    """
    return tuple(
        tuple(
            f"{name}_{_letter(step)}"
            for step in sorted(link.joint.steps, key=lambda step: step.coordinate)
        )
        for name, link in zip(link_names(tree), tree.links, strict=True)
    )


def _letter(step: Step) -> str:
    letter = _LETTERS.get(step.axis)
    if letter is None:
        return "turn" if step.turns else "move"
    return f"r{letter}" if step.turns else letter


def initial_joints(tree: CasprTree) -> dict[str, float]:
    """Positions of the joints at q_initial, by their names [m, rad]."""
    return {
        name: float(value)
        for names, link in zip(joint_names(tree), tree.links, strict=True)
        for name, value in zip(names, link.joint.initial, strict=True)
    }


def write_mechanism(tree: CasprTree) -> str:
    """The MJCF file of a model's links and joints, with motors on joints that are actuated."""
    root = ET.Element("mujoco", model=robot_name(tree.name))
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", gravity=f"0 0 {-GRAVITY!r}")
    bodies = [ET.SubElement(root, "worldbody")]
    motors: list[str] = []
    names, joints = link_names(tree), joint_names(tree)
    waiting = list(range(1, len(tree.links) + 1))
    made = {0: bodies[0]}
    while waiting:  # parents may have higher numbers
        number = next(k for k in waiting if tree.links[k - 1].parent in made)
        waiting.remove(number)
        link = tree.links[number - 1]
        carrier, place = made[link.parent], link.location
        if len(link.joint.steps) > 1 and np.any(place):
            name = names[number - 1] + _BASE
            carrier = ET.SubElement(carrier, "body", name=name, pos=_words(place))
            place = np.zeros(3)
        body = ET.SubElement(carrier, "body", name=names[number - 1], pos=_words(place))
        made[number] = body
        if link.mass > 0.0:
            ET.SubElement(
                body, "inertial", pos=_words(link.com), mass=repr(link.mass),
                fullinertia=_words(link.inertia),
            )  # fmt: skip
        for step in link.joint.steps:
            k = step.coordinate
            joint = ET.SubElement(
                body, "joint", name=joints[number - 1][k], type="hinge" if step.turns else "slide",
                axis=_words(step.axis),
            )  # fmt: skip
            limits = held_limits(link.joint, k)
            if limits is not None:
                joint.set("range", _words(limits))
            if link.joint.actuated:
                motors.append(joints[number - 1][k])
    if motors:
        actuator = ET.SubElement(root, "actuator")
        for name in motors:
            ET.SubElement(actuator, "motor", name=name, joint=name)
    ET.indent(root, "  ")
    return ET.tostring(root, encoding="unicode") + "\n"


def held_limits(joint: CasprJoint, coordinate: int) -> tuple[float, float] | None:
    """Limits of a coordinate; None: none are given, or it starts beyond them."""
    if joint.lower is None or joint.upper is None:
        return None
    low, high = float(joint.lower[coordinate]), float(joint.upper[coordinate])
    return (low, high) if low <= joint.initial[coordinate] <= high else None


def limit_remarks(tree: CasprTree) -> list[str]:
    """Which joints start beyond their limits, a sentence for all of them, if any."""
    found = [
        name
        for names, link in zip(joint_names(tree), tree.links, strict=True)
        for k, name in enumerate(names)
        if link.joint.lower is not None
        and link.joint.upper is not None
        and held_limits(link.joint, k) is None
    ]
    if not found:
        return []
    return [f"Limits of joints that start beyond them were left out: {', '.join(found)}."]


def _words(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)

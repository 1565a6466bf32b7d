"""Robots in MuJoCo's MJCF: a body and spatial tendons, each from a site of the world to one of it.

MuJoCo itself compiles the file, so defaults, includes, degrees and Euler sequences mean what they
mean there. The platform is the body that moves and what is fixed to it; bodies that it carries on
joints are fixed where they stand. A keyframe `home`, or the only one, has the home pose.

Source: MuJoCo's XML reference, `tendon/spatial`.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.formats.draft import DraftCable, RobotDraft
from cdpr_drake.formats.mjcf_parts import (
    SMALLEST,
    Compiled,
    compiled_model,
    home_key,
    mark_used,
    told_by_mujoco,
)
from cdpr_drake.formats.platform_motion import moved_by_joints, set_motion
from cdpr_drake.formats.unread import not_kept
from cdpr_drake.models.foreign_text import fail, robot_name

TOOL = "MJCF"

_STIFFEST = 1e13
"""Young's modulus [Pa] above which springs are no cables of the width that is drawn."""

_SAME = 1e-9
"""Share by which moduli that follow from stiffness, length and width are alike."""

_LEVEL = 1e-9
"""How far a box may be turned against P."""


def read_mjcf(path: Path) -> RobotDraft:
    """Reads a robot in MJCF.

    Raises:
        RobotFileError: MuJoCo is not installed or cannot read the file, or its tendons do not
            hold one body.
    """
    with told_by_mujoco() as warnings:
        draft = _read(path)
    draft.remarks += [f"MuJoCo warns: {words}" for words in warnings]
    return draft


def _read(path: Path) -> RobotDraft:
    compiled, document, missing = compiled_model(path)
    mujoco, model, data = compiled
    draft = RobotDraft(name=robot_name(path.stem), tool=TOOL, title=f"from {path.name}")
    draft.remarks += missing
    key = home_key(model)
    if key is not None:
        mujoco.mj_resetDataKeyframe(model, data, key)
        draft.remarks.append(f"Home is the keyframe {model.key(key).name or key}.")
    mujoco.mj_forward(model, data)
    gravity = np.array(model.opt.gravity)
    draft.gravity = float(np.linalg.norm(gravity))
    if np.any(np.abs(gravity[:2]) > 1e-9) or gravity[2] > 0.0:
        draft.gravity_direction = gravity
    anchors: dict[str, int] = {}
    springless = {model.tendon(k).name or f"C{k + 1}" for k in range(model.ntendon)
                  if model.tendon_stiffness[k] == 0.0}  # fmt: skip
    for index in range(model.ntendon):
        _tendon(path, compiled, index, draft, anchors)
    if not draft.cables:
        raise fail(path, "tendon", "no spatial tendon", "one for each cable")
    limp = [name for name in anchors if name in springless]
    if draft.youngs_modulus is not None and limp:
        draft.remarks.append(f"Tendons without stiffness got that of the first one that has some: "
                             f"{', '.join(limp)}.")  # fmt: skip
    body = _root(path, compiled, anchors)
    composite = _composite(model, body)
    _anchor_points(compiled, body, anchors, draft)
    _motion(path, compiled, body, draft)
    _inertia(compiled, body, composite, draft)
    _box(compiled, body, composite, draft)
    mark_used(document, compiled, body, composite, key, draft)
    draft.remarks += not_kept(document, PRESENTATION)
    return draft


PRESENTATION = {
    "visual", "statistic", "asset", "light", "size", "mesh", "material", "texture", "@name",
    "@class", "@rgba", "@material", "@group", "@model", "@user", "@childclass", "site@size",
    "site@type", "@color",
}  # fmt: skip
"""What only says how things look or are called."""


def _joints(compiled: Compiled, body: int) -> list[tuple[str, str]]:
    """Kinds and names of the joints of a body."""
    mujoco, model, _ = compiled
    words = {
        int(mujoco.mjtJoint.mjJNT_FREE): "free",
        int(mujoco.mjtJoint.mjJNT_BALL): "ball",
        int(mujoco.mjtJoint.mjJNT_SLIDE): "slide",
        int(mujoco.mjtJoint.mjJNT_HINGE): "hinge",
    }
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    return [
        (words[int(model.jnt_type[k])], model.joint(k).name or str(k))
        for k in range(first, first + count)
    ]


def _joint_words(compiled: Compiled, body: int) -> str:
    return ", ".join(f"{kind} joint {name}" for kind, name in _joints(compiled, body))


def _name(model: Any, body: int) -> str:
    return str(model.body(body).name or body)


def _tendon(
    path: Path, compiled: Compiled, index: int, draft: RobotDraft, anchors: dict[str, int]
) -> None:
    """Adds the cable of a tendon, and its site on the platform to the anchors."""
    mujoco, model, data = compiled
    tendon = model.tendon(index)
    name = tendon.name or f"C{index + 1}"
    start, count = int(model.tendon_adr[index]), int(model.tendon_num[index])
    kinds = model.wrap_type[start : start + count]
    if np.any(kinds == mujoco.mjtWrap.mjWRAP_JOINT):
        draft.remarks.append(f"Tendon {name} couples joints and is no cable; left out.")
        return
    for k in range(start, start + count):
        kind, thing = model.wrap_type[k], int(model.wrap_objid[k])
        if kind == mujoco.mjtWrap.mjWRAP_PULLEY:
            raise fail(path, f"tendon {name}", f"a pulley of divisor {model.wrap_prm[k]:g}",
                       "sites only, without branches")  # fmt: skip
        if kind != mujoco.mjtWrap.mjWRAP_SITE:
            geom = model.geom(thing).name or thing
            raise fail(path, f"tendon {name}", f"a wrap round the geom {geom}",
                       "sites only; a pulley is given as the radius of an exit point")  # fmt: skip
    sites = [int(site) for site in model.wrap_objid[start : start + count]]
    fixed = [int(model.body_weldid[model.site_bodyid[site]]) == 0 for site in sites]
    if fixed[0] is False:
        sites, fixed = sites[::-1], fixed[::-1]
    moving = [site for site, still in zip(sites, fixed, strict=True) if not still]
    if not moving:
        body = int(model.site_bodyid[sites[-1]])
        raise fail(path, f"tendon {name}", f"body {_name(model, body)} without a joint",
                   "a platform that can move")  # fmt: skip
    if len(moving) != 1 or fixed != sorted(fixed, reverse=True) or len(sites) < 2:
        roots = dict.fromkeys(int(model.body_weldid[model.site_bodyid[site]]) for site in moving)
        words = [f"{_name(model, root)} ({_joint_words(compiled, root)})" for root in roots]
        raise moved_by_joints(
            path, f"tendon {name}", f"{len(moving)} sites on moving bodies, {', '.join(words)}"
        )
    if len(sites) > 2:
        draft.remarks.append(f"{name} runs over {len(sites) - 1} sites of the world; it leaves "
                             "from the last one.")  # fmt: skip
    anchors[name] = moving[0]
    lower, upper = _forces(mujoco, model, index)
    draft.cables.append(
        DraftCable(
            name=name, exit_point=np.array(data.site_xpos[sites[-2]]), anchor_point=np.zeros(3),
            lower=lower, upper=upper, material=_material(model, index, draft),
        )
    )  # fmt: skip


def _root(path: Path, compiled: Compiled, anchors: dict[str, int]) -> int:
    """The body that carries all anchors, which are on it or on bodies fixed to it."""
    _, model, _ = compiled
    roots = dict.fromkeys(int(model.body_weldid[model.site_bodyid[s]]) for s in anchors.values())
    if len(roots) > 1:
        words = [f"{_name(model, body)} ({_joint_words(compiled, body)})" for body in roots]
        raise moved_by_joints(path, "tendon", f"tendons to {', '.join(words)}")
    body = next(iter(roots))
    parent = int(model.body_weldid[model.body_parentid[body]])
    if parent != 0:
        raise fail(
            path, f"body {_name(model, body)}",
            f"on {_name(model, parent)} ({_joint_words(compiled, parent)})",
            "a body that moves against the world; a mechanism file takes bodies on moving ones",
        )  # fmt: skip
    return body


def _composite(model: Any, body: int) -> list[int]:
    """A body and all that it carries; ids of MuJoCo grow from parents to children."""
    found = [body]
    for other in range(body + 1, model.nbody):
        if int(model.body_parentid[other]) in found:
            found.append(other)
    return found


def _anchor_points(
    compiled: Compiled, body: int, anchors: dict[str, int], draft: RobotDraft
) -> None:
    data = compiled.data
    R_WB = np.array(data.xmat[body]).reshape(3, 3)
    for cable, site in zip(draft.cables, anchors.values(), strict=True):
        cable.anchor_point = R_WB.T @ (data.site_xpos[site] - data.xpos[body])


def _material(model: Any, tendon: int, draft: RobotDraft) -> dict[str, float]:
    """What a tendon's width and spring say of it where that is not the first one's.

    E S is its stiffness times the length up to which it is slack.
    """
    diameter = 2.0 * float(model.tendon_width[tendon])
    draft.diameter = draft.diameter or diameter
    own = {} if diameter == draft.diameter else {"diameter": diameter}
    loose = float(model.tendon_lengthspring[tendon, 1])
    modulus = float(model.tendon_stiffness[tendon]) * loose / (np.pi * diameter**2 / 4.0)
    if modulus > _STIFFEST:
        draft.remarks.append(f"The stiffness of tendon {tendon + 1} would be a Young's modulus of "
                             f"{modulus:.3g} Pa and was not kept.")  # fmt: skip
    elif modulus > 0.0:
        draft.youngs_modulus = draft.youngs_modulus or modulus
        if abs(modulus - draft.youngs_modulus) > _SAME * modulus:
            own["youngs_modulus"] = modulus
    return own


def _forces(mujoco: Any, model: Any, tendon: int) -> tuple[float | None, float | None]:
    """Tension limits of a tendon's motor, if it has one; MuJoCo's pulling forces are negative."""
    named = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, SMALLEST)
    for k in range(model.nu):
        if model.actuator_trntype[k] != mujoco.mjtTrn.mjTRN_TENDON:
            continue
        if int(model.actuator_trnid[k, 0]) != tendon or not model.actuator_forcelimited[k]:
            continue
        forces = -model.actuator_gear[k, 0] * model.actuator_forcerange[k]
        low, high = float(np.min(forces)), float(np.max(forces))
        if named >= 0:
            low = model.numeric_data[model.numeric_adr[named]]
        if high > 0.0:
            return max(float(low), 0.0), float(high)
    return None, None


def _motion(path: Path, compiled: Compiled, body: int, draft: RobotDraft) -> None:
    """Motion type and home pose."""
    _, model, data = compiled
    joints = _joints(compiled, body)
    first = int(model.body_jntadr[body])
    axes = np.array(data.xaxis[first : first + len(joints)]).reshape(-1, 3)
    kinds = [kind for kind, _ in joints]
    if kinds == ["free"]:
        draft.motion = "3R3T"
    else:
        known = set(kinds) <= {"slide", "hinge"}
        set_motion(
            path, draft, _joint_words(compiled, body),
            [axis for kind, axis in zip(kinds, axes, strict=True) if kind == "slide" and known],
            [axis for kind, axis in zip(kinds, axes, strict=True) if kind == "hinge"],
            np.array(data.xpos[body]),
        )  # fmt: skip
    draft.home_position = np.array(data.xpos[body])
    draft.R_WP = np.array(data.xmat[body]).reshape(3, 3)


def _inertia(compiled: Compiled, body: int, composite: list[int], draft: RobotDraft) -> None:
    """Mass, centre of mass and inertia of all bodies that move as one, by parallel axes."""
    _, model, data = compiled
    R_PW = np.array(data.xmat[body]).reshape(3, 3).T
    masses = np.array(model.body_mass)[composite]
    points = (np.array(data.xipos)[composite] - data.xpos[body]) @ R_PW.T
    draft.mass = float(np.sum(masses))
    draft.center_of_mass = com = masses @ points / draft.mass
    inertia = np.zeros((3, 3))
    for k, part in enumerate(composite):
        R, d = R_PW @ np.array(data.ximat[part]).reshape(3, 3), points[k] - com
        inertia += R @ np.diag(model.body_inertia[part]) @ R.T
        inertia += masses[k] * (float(d @ d) * np.eye(3) - np.outer(d, d))
    draft.inertia = inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    parts = [part for part, mass in zip(composite, masses, strict=True) if mass > 0.0]
    if len(parts) > 1:
        words = ", ".join(f"{_name(model, k)} {model.body_mass[k]:g} kg" for k in parts)
        draft.remarks.append(f"The platform is the sum of bodies fixed to each other: {words}.")
    for part in composite[1:]:
        if int(model.body_jntnum[part]):
            draft.remarks.append(
                f"Body {_name(model, part)}, on {_joint_words(compiled, part)}, was fixed where it "
                "stands; it counts as part of the platform."
            )


def _box(compiled: Compiled, body: int, composite: list[int], draft: RobotDraft) -> None:
    """The first box along axes of P; a remark on shapes that are none."""
    mujoco, model, data = compiled
    R_PW = np.array(data.xmat[body]).reshape(3, 3).T
    others = 0
    for geom in (
        g for part in composite for g in range(model.ngeom) if model.geom_bodyid[g] == part
    ):
        R = R_PW @ np.array(data.geom_xmat[geom]).reshape(3, 3)
        is_box = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX
        if draft.box_size is None and is_box and np.max(np.abs(R - np.eye(3))) < _LEVEL:
            draft.box_size = 2.0 * np.array(model.geom_size[geom])
            draft.box_center = R_PW @ (data.geom_xpos[geom] - data.xpos[body])
        else:
            others += 1
    if others:
        draft.remarks.append(f"Shapes of the platform that are not its box count for its mass "
                             f"alone: {others}.")  # fmt: skip


def write_mjcf(draft: RobotDraft, stiffness: Array, lengths: Array) -> str:
    """The robot as MJCF with a tendon for each cable, at rest at its home pose.

    A tendon is a spring that only pulls, of E S / l about its unstrained length l, with a motor
    for tension on top, up to the robot's largest, which adds nothing at zero control; the smallest
    tension is a custom number. It holds points, mass, inertia, home pose, gravity, box,
    diameters, Young's moduli and tension limits; neither pulleys, winches, what cables weigh nor
    their damping, which MuJoCo would give to slack tendons as well.

    Args:
        draft: The robot.
        stiffness: E S of each cable, shape (m,) [N].
        lengths: Unstrained lengths, shape (m,) [m].
    """
    assert draft.home_position is not None
    assert draft.R_WP is not None
    assert draft.inertia is not None
    assert draft.center_of_mass is not None
    assert draft.box_size is not None
    assert draft.box_center is not None
    root = ET.Element("mujoco", model=draft.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", gravity=_words((draft.gravity or 0.0) * draft.down()),
                  timestep="0.0001", integrator="implicitfast")  # fmt: skip
    world = ET.SubElement(root, "worldbody")
    ET.SubElement(world, "light", pos="0 0 10", dir="0 0 -1")
    for cable in draft.cables:
        ET.SubElement(world, "site", name=f"exit_{cable.name}", pos=_words(cable.exit_point))
    body = ET.SubElement(
        world,
        "body",
        name="platform",
        pos=_words(draft.home_position),
        quat=_quaternion(draft.R_WP),
    )
    motion, R_PW = draft.motion_type(), draft.R_WP.T
    if motion.num_turns < 2:
        twists = motion.basis(draft.R_WP)
        names = ("x", "y", "z")[: motion.num_moves]
        for name, axis in zip(names, twists[3:, motion.num_turns :].T, strict=True):
            ET.SubElement(body, "joint", name=name, type="slide", axis=_words(R_PW @ axis))
        if motion.num_turns:
            ET.SubElement(body, "joint", name="turn", type="hinge",
                          axis=_words(R_PW @ twists[:3, 0]))  # fmt: skip
    else:
        ET.SubElement(body, "freejoint")
    ET.SubElement(
        body, "inertial", pos=_words(draft.center_of_mass), mass=_words([draft.mass or 0.0]),
        fullinertia=_words(draft.inertia),
    )  # fmt: skip
    ET.SubElement(
        body, "geom", type="box", size=_words(draft.box_size / 2.0), pos=_words(draft.box_center),
        contype="0", conaffinity="0", rgba="0.85 0.55 0.15 0.5",
    )  # fmt: skip
    for cable in draft.cables:
        ET.SubElement(body, "site", name=f"anchor_{cable.name}", pos=_words(cable.anchor_point))
    tendons = ET.SubElement(root, "tendon")
    actuators = ET.SubElement(root, "actuator")
    for k, cable in enumerate(draft.cables):
        spatial = ET.SubElement(
            tendons, "spatial", name=cable.name,
            width=_words([cable.material.get("diameter", draft.diameter or 0.002) / 2.0]),
            stiffness=_words([stiffness[k] / lengths[k]]), springlength=_words([0.0, lengths[k]]),
        )  # fmt: skip
        ET.SubElement(spatial, "site", site=f"exit_{cable.name}")
        ET.SubElement(spatial, "site", site=f"anchor_{cable.name}")
        ET.SubElement(
            actuators, "motor", name=f"tension_{cable.name}", tendon=cable.name, gear="1",
            forcerange=_words([-(cable.upper or 0.0), 0.0]),
        )  # fmt: skip
    ET.SubElement(ET.SubElement(root, "custom"), "numeric", name=SMALLEST,
                  data=_words(draft.cables[0].lower or 0.0))  # fmt: skip
    ET.indent(root, "  ")
    return ET.tostring(root, encoding="unicode") + "\n"


def _quaternion(R: Array) -> str:
    return _words(RotationMatrix(R).ToQuaternion().wxyz())


def _words(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.atleast_1d(np.asarray(values, float)))

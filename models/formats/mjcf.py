"""Robots in MuJoCo's MJCF: a body and spatial tendons, each from a site of the world to one of it.

MuJoCo itself compiles the file, so defaults, includes, degrees and Euler sequences mean what they
mean there.

Source: MuJoCo's XML reference, `tendon/spatial`.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydrake.math import RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.formats.draft import DraftCable, RobotDraft
from cdpr_drake.models.formats.reading import fail, read_xml, robot_name

TOOL = "MJCF"

SMALLEST = "smallest_tension"
"""The custom number that has the robot's smallest tension [N]: a motor with a smallest pull above 0
would pull when nothing is commanded."""

_STIFFEST = 1e13
"""Young's modulus [Pa] above which springs are no cables of the width that is drawn."""

_SAME = 1e-9
"""Share by which moduli that follow from stiffness, length and width are alike."""

_ACROSS = 1e-6
"""How far axes of joints may be off each other, or off an axis of W."""


class _Compiled(NamedTuple):
    """MuJoCo, a compiled model, and its data at the initial pose."""

    mujoco: Any
    model: Any
    data: Any


def read_mjcf(path: Path) -> RobotDraft:
    """Reads a robot in MJCF.

    Raises:
        RobotFileError: MuJoCo is not installed or cannot read the file, or its tendons do not
            hold one body.
    """
    read_xml(path)  # for its message where it is not well-formed
    try:
        import mujoco
    except ImportError as problem:
        raise RobotFileError(
            f"{path}: MJCF is read by MuJoCo, which is not installed; pip install cdpr_drake[mjcf]"
        ) from problem
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as problem:
        words = " ".join(str(problem).split())
        raise RobotFileError(f"{path}: MuJoCo cannot read it: {words[:300]}") from problem
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    draft = RobotDraft(name=robot_name(path.stem), tool=TOOL, title=f"from {path.name}")
    gravity = np.array(model.opt.gravity)
    draft.gravity = float(np.linalg.norm(gravity))
    if np.any(np.abs(gravity[:2]) > 1e-9) or gravity[2] > 0.0:
        draft.gravity_direction = gravity
    bodies: set[int] = set()
    compiled = _Compiled(mujoco, model, data)
    for index in range(model.ntendon):
        _tendon(path, compiled, index, draft, bodies)
    if not draft.cables:
        raise fail(path, "tendon", "no spatial tendon", "one for each cable")
    if len(bodies) != 1:
        names = ", ".join(model.body(body).name or str(body) for body in sorted(bodies))
        raise fail(path, "tendon", f"tendons to {names}", "tendons to one body, the platform")
    _platform(path, compiled, bodies.pop(), draft)
    return draft


def _tendon(
    path: Path, compiled: _Compiled, index: int, draft: RobotDraft, bodies: set[int]
) -> None:
    """Adds the cable of a tendon, and its body to the bodies."""
    mujoco, model, data = compiled
    tendon = model.tendon(index)
    name = tendon.name or f"C{index + 1}"
    start, count = int(model.tendon_adr[index]), int(model.tendon_num[index])
    kinds = model.wrap_type[start : start + count]
    if np.any(kinds == mujoco.mjtWrap.mjWRAP_JOINT):
        draft.remarks.append(f"Tendon {name} couples joints and is no cable; left out.")
        return
    if np.any(kinds != mujoco.mjtWrap.mjWRAP_SITE):
        raise fail(path, f"tendon {name}", "pulleys or wrapping geometry", "sites only")
    sites = [int(site) for site in model.wrap_objid[start : start + count]]
    fixed = [int(model.body_weldid[model.site_bodyid[site]]) == 0 for site in sites]
    if fixed[0] is False:
        sites, fixed = sites[::-1], fixed[::-1]
    moving = [site for site, still in zip(sites, fixed, strict=True) if not still]
    if len(moving) != 1 or fixed != sorted(fixed, reverse=True) or len(sites) < 2:
        raise fail(path, f"tendon {name}", f"{len(moving)} sites on moving bodies",
                   "sites of the world, then one of the platform")  # fmt: skip
    if len(sites) > 2:
        draft.remarks.append(f"{name} runs over {len(sites) - 1} sites of the world; it leaves "
                             "from the last one.")  # fmt: skip
    body = int(model.site_bodyid[moving[0]])
    bodies.add(body)
    R_WB = np.array(data.xmat[body]).reshape(3, 3)
    anchor = R_WB.T @ (data.site_xpos[moving[0]] - data.xpos[body])
    lower, upper = _forces(mujoco, model, index)
    draft.cables.append(
        DraftCable(
            name=name, exit_point=np.array(data.site_xpos[sites[-2]]), anchor_point=anchor,
            lower=lower, upper=upper, material=_material(model, index, draft),
        )
    )  # fmt: skip


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
        low, high = -model.actuator_forcerange[k, 1], -model.actuator_forcerange[k, 0]
        if named >= 0:
            low = model.numeric_data[model.numeric_adr[named]]
        if high > 0.0:
            return max(float(low), 0.0), float(high)
    return None, None


def _platform(path: Path, compiled: _Compiled, body: int, draft: RobotDraft) -> None:
    mujoco, model, data = compiled
    if int(model.body_parentid[body]) != 0:
        raise fail(path, f"body {model.body(body).name}", "a parent that moves", "a free body")
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    kinds = [int(kind) for kind in model.jnt_type[first : first + count]]
    axes = np.array(data.xaxis[first : first + count]).reshape(-1, 3)
    free, slide, hinge = (
        int(mujoco.mjtJoint.mjJNT_FREE),
        int(mujoco.mjtJoint.mjJNT_SLIDE),
        int(mujoco.mjtJoint.mjJNT_HINGE),
    )
    along = [axis for kind, axis in zip(kinds, axes, strict=True) if kind == slide]
    about = [axis for kind, axis in zip(kinds, axes, strict=True) if kind == hinge]
    motion = None if len(along) + len(about) < count else _motion_of(along, about)
    if kinds == [free]:
        draft.motion = "3R3T"
    elif motion is None:
        raise fail(path, f"body {model.body(body).name}", f"{count} joints of its kinds",
                   "a free joint, slides across each other, or two of them and a hinge about what "
                   "is across both")  # fmt: skip
    else:
        draft.motion, draft.axis, draft.origin = *motion, np.array(data.xpos[body])
        if draft.is_level():
            draft.plane_height = float(data.xpos[body][2])
    draft.home_position = np.array(data.xpos[body])
    draft.R_WP = np.array(data.xmat[body]).reshape(3, 3)
    draft.mass = float(model.body_mass[body])
    draft.center_of_mass = np.array(model.body_ipos[body])
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, model.body_iquat[body])
    about_com = R.reshape(3, 3) @ np.diag(model.body_inertia[body]) @ R.reshape(3, 3).T
    draft.inertia = about_com[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    for geom in range(model.ngeom):
        same = int(model.geom_bodyid[geom]) == body
        if same and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
            draft.box_size = 2.0 * np.array(model.geom_size[geom])
            draft.box_center = np.array(model.geom_pos[geom])
            return


def _motion_of(along: list[Array], about: list[Array]) -> tuple[str, Array | None] | None:
    """Motion type and its axis from axes of slides and hinges in W; None where there is none."""
    if len(about) > 1 or not along:
        return None
    A = np.array(along)
    if len(along) > 3 or np.max(np.abs(A @ A.T - np.eye(len(along)))) > _ACROSS:
        return None
    if len(along) == 3:
        return None if about else ("3T", None)
    if len(along) == 1:
        return None if about else ("1T", _positive(A[0]))
    normal = _positive(np.cross(A[0], A[1]))
    if not about:
        return "2T", normal
    return ("2T1R", normal) if abs(abs(normal @ about[0]) - 1.0) < _ACROSS else None


def _positive(axis: Array) -> Array:
    """An axis or its opposite, the largest component above 0, exact where it is one of W."""
    axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
    near = np.round(axis)
    return near if np.allclose(axis, near, atol=_ACROSS) else axis


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

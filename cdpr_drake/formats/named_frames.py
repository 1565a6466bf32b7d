"""Robots in SDFormat or URDF: a platform and named frames for exit and anchor points.

A frame, or a link that is fixed to another, is an exit point where its name is `exit_`, `frame_`,
`base_` or `A` and the cable's name, and an anchor point where it is `anchor_`, `platform_` or `B`
and the same name. Drake's parser reads the file, so frames may be relative to each other, in
included models, or links of URDF. Files of the Gazebo simulator, whose cables are chains of links
`virt_X` and `virt_Xpf`, are read without a parser of joints, since their loops have none in Drake.

Source: SDFormat 1.12; Gazebo thesis 5.4 and the simulator's files for the chains.
"""

from __future__ import annotations

import copy
import re
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path

import numpy as np
from pydrake.geometry import Box, Cylinder, Role, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import PackageMap, Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, FrameIndex, PrismaticJoint
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.formats.carried_bodies import (
    CarriedBodies,
    find_carried,
    set_carried_motion,
    set_composite_inertia,
)
from cdpr_drake.formats.draft import DraftCable, RobotDraft
from cdpr_drake.formats.unread import TEXT, mark, mark_below, not_kept, watched
from cdpr_drake.models.drake_parsing import drake_refusals, parse_models
from cdpr_drake.models.file_kinds import is_sdformat
from cdpr_drake.models.foreign_text import fail, numbers, read_xml, robot_name

SDF_TOOL = "SDFormat"
URDF_TOOL = "URDF"

_CABLE = r"[_ -]|{0}[_ -]?(?=\d)|{0}[_-])(?P<cable>.+)$"
_EXIT = re.compile(r"^(?:(?:exit(?:_?point)?|frame|base)" + _CABLE.format("A"), re.IGNORECASE)
_ANCHOR = re.compile(r"^(?:(?:anchor(?:_?point)?|platform)" + _CABLE.format("B"), re.IGNORECASE)


def read_named_frames(path: Path) -> RobotDraft:
    """Reads a robot in SDFormat or URDF.

    Raises:
        RobotFileError: Drake cannot read the file, or its frames do not make a cable robot.
    """
    with drake_refusals(f"{path}: Drake cannot read it"):
        return _read_draft(path)


def _read_draft(path: Path) -> RobotDraft:
    root = read_xml(path)
    tool = SDF_TOOL if is_sdformat(root) else URDF_TOOL
    model = root.find("model") if is_sdformat(root) else root
    if is_sdformat(root) and model is not None and _chains(model):
        return _read_chains(path, watched(root))
    words = path.stem if model is None else model.get("name") or path.stem
    draft = RobotDraft(name=robot_name(words), tool=tool, title=words)
    scene_graph = SceneGraph()
    plant = MultibodyPlant(0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    whole, unread = copy.deepcopy(root), list[str]()
    balls = _without_balls(root)
    parse_models(parser, path, ET.tostring(root, encoding="unicode") if balls else None, "sdf")
    plant.Finalize()
    exits, anchors = _points(plant)
    names = [name for name in exits if name in anchors]
    if not names:
        raise fail(
            path, "frames", f"{len(exits)} exit and {len(anchors)} anchor points of one name",
            "frames exit_NAME on the frame and anchor_NAME on the platform, of each cable",
        )  # fmt: skip
    lonely = sorted(set(exits) ^ set(anchors))
    if lonely:
        draft.remarks.append("No cable was made of frames without a partner: " + ", ".join(lonely))
    carried = find_carried(
        path, plant, {name: exits[name].body() for name in names},
        {name: anchors[name].body() for name in names},
    )  # fmt: skip
    draft.remarks += carried.remarks
    context = plant.CreateDefaultContext()
    _place_floating(path, root, plant, context)
    X_WP = plant.EvalBodyPoseInWorld(context, carried.platform)
    draft.home_position, draft.R_WP = X_WP.translation(), X_WP.rotation().matrix()
    for name in names:
        p_WB = anchors[name].CalcPoseInWorld(context).translation()
        draft.cables.append(
            DraftCable(
                name=name,
                exit_point=exits[name].CalcPoseInWorld(context).translation(),
                anchor_point=X_WP.inverse().multiply(p_WB),
            )
        )
    set_carried_motion(path, plant, context, carried, draft)
    set_composite_inertia(plant, context, carried, draft)
    _limits(plant, draft)
    _box(plant, scene_graph, context, carried, draft)
    _frame(plant, scene_graph, context, draft)
    _diameters(plant, scene_graph, draft)
    gravity = _gravity(path, root, np.array(plant.gravity_field().gravity_vector()))
    draft.gravity = float(np.linalg.norm(gravity))
    if np.any(gravity[:2] != 0.0) or gravity[2] > 0.0:
        draft.gravity_direction = gravity
    _include(whole, parser.package_map(), unread, [0])
    seen = watched(whole)
    _mark_used(seen, carried, draft)
    draft.remarks += not_kept(seen, _PRESENTATION)
    if unread:
        draft.remarks.append(
            "Of these included files only bodies, joints and frames were read, and what else they "
            f"hold is not named: {', '.join(unread)}."
        )
    return draft


_MOST_INCLUDES = 1000
"""Included files that are looked into for what is not kept."""


def _include(root: ET.Element, packages: PackageMap, unread: list[str], count: list[int]) -> None:
    """Puts models of included files into their elements `include`.

    Args:
        root: A document; changed.
        packages: Those that Drake's parser knows.
        unread: Gets the names of files that are not found.
        count: How many there were so far.
    """
    for item in list(root.iter("include")):
        uri = (item.findtext("uri") or "").strip()
        file = _included_file(uri, packages)
        count[0] += 1
        if file is None or count[0] > _MOST_INCLUDES:
            unread.append(uri)
            continue
        inner = read_xml(file)
        _include(inner, packages, unread, count)
        item.extend([inner] if inner.tag == "robot" else inner.findall("model"))


def _included_file(uri: str, packages: PackageMap) -> Path | None:
    """The file that Drake's parser includes; None: it is not found."""
    file = Path(uri.removeprefix("file://"))
    if uri.startswith(("package://", "model://")):
        try:
            file = Path(packages.ResolveUrl(uri))
        except RuntimeError:
            return None
    if file.is_dir() and (file / "model.config").is_file():
        file = file / (read_xml(file / "model.config").findtext("sdf") or "")
    return file if file.is_file() else None


_PRESENTATION = {
    "visual", "material", "light", "scene", "gui", "@name", "@version", "@xmlns", "@canonical_link",
    "author", "description",
}  # fmt: skip
"""What only says how things look or are called."""

_STRUCTURE = {
    "parent",
    "child",
    "origin",
    "pose",
    "frame",
    "name",
    "placement_frame",
    "static",
    "uri",
}
"""Elements that say where things are and how included ones are called, which Drake uses."""


def _gravity(path: Path, root: ET.Element, plain: Array) -> Array:
    """Acceleration of a falling body in W; of a world of SDFormat as that says, else Drake's."""
    words = root.findtext("world/gravity")
    return plain if words is None else numbers(path, "world, gravity", words, 3)


def _mark_used(seen: ET.Element, carried: CarriedBodies, draft: RobotDraft) -> None:
    """Counts as used what Drake and this reader took; names bodies and joints that were not."""
    cables = {cable.name for cable in draft.cables}
    stand_ins = {f"{word}_{name}" for name in cables for word in ("guide", "rod", "turn", "hold")}
    chains = {body.name() for body in carried.others} & stand_ins
    others = [body.name() for body in carried.others if body.name() not in chains]
    if chains:
        draft.remarks.append("Chains of links in the place of cables became cables; what the "
                             "links weigh was not kept.")  # fmt: skip
    if others:
        draft.remarks.append(f"Links that no cable holds were not kept: {', '.join(others)}.")
    composite = {body.name() for body in carried.composite}
    carrying = {joint.name() for joint in carried.carrying}
    fixed = {joint.name() for joint in carried.fixed}
    left = {*chains, *others}
    for item in seen.iter():
        tag, name = str(item.tag), item.attrib.get("name", "")
        if tag in _STRUCTURE or tag in ("robot", "sdf", "model", "include"):
            mark(item)
        elif tag == "link" and name in left:
            mark_below(item)
        elif tag == "link":
            mark(item)
            for part in item.findall("inertial") if name in composite else ():
                mark_below(part)
            for part in item.findall("collision") if name in composite else ():
                if _is_box(part, draft):
                    mark_below(part)
        elif tag == "joint" and item.find("parent") is not None:
            ends = {end.get("link", "") or end.findtext(".", "") for end in item
                    if end.tag in ("parent", "child")}  # fmt: skip
            kind = item.attrib.get("type")
            if ends & left or name in fixed or kind == "fixed":
                mark_below(item)
            elif kind == "floating" or name in carrying:
                mark(item)
                for axis in item.iter("axis"):
                    mark(axis, "xyz", TEXT)
                for xyz in item.iter("xyz"):
                    mark(xyz)
        elif tag == "gravity" and seen.find("world/gravity") is item:
            mark(item)
        elif tag == "transmission":
            actuated = item.find("joint")
            if actuated is not None and actuated.attrib.get("name") in cables:
                mark_below(item)
        elif tag.endswith("ball_constraint") and chains:
            mark_below(item)
    for item in seen.iter():
        if isinstance(item.tag, str) and item.tag == "world" and item.find("model") is not None:
            mark(item)


def _is_box(collision: ET.Element, draft: RobotDraft) -> bool:
    """Whether a collision shape is the box that the platform got."""
    box = collision.find("geometry/box")
    if box is None or draft.box_size is None:
        return False
    words = box.get("size", "") or box.findtext("size", "")
    try:
        return np.array_equal(np.array(words.split(), float), draft.box_size)
    except ValueError:
        return False


def _without_balls(root: ET.Element) -> int:
    """Takes ball joints out that close loops, which Drake has not; returns how many.

    Such a joint is not the only one of its child.
    """
    children = Counter(joint.findtext("child", "") for joint in root.iter("joint"))
    found = 0
    for parent in list(root.iter()):
        for joint in parent.findall("joint"):
            if joint.get("type") == "ball" and children[joint.findtext("child", "")] > 1:
                parent.remove(joint)
                found += 1
    return found


def _place_floating(path: Path, root: ET.Element, plant: MultibodyPlant, context: Context) -> None:
    """Puts bodies where floating joints of URDF have them.

    Drake leaves such bodies free.
    """
    found: dict[str, tuple[str, RigidTransform]] = {}
    for joint in root.findall("joint"):
        parent, child, origin = joint.find("parent"), joint.find("child"), joint.find("origin")
        if joint.get("type") != "floating" or parent is None or child is None or origin is None:
            continue
        ends = parent.get("link", ""), child.get("link", "")
        if all(plant.NumBodiesWithName(name) == 1 for name in ends):
            found[ends[1]] = ends[0], _origin(path, "floating joint", origin)
    for _ in found:  # a parent may stand on another one's joint
        for child_name, (parent_name, X) in found.items():
            body = plant.GetBodyByName(child_name)
            if body.is_floating_base_body():
                X_WF = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(parent_name))
                plant.SetFreeBodyPose(context, body, X_WF.multiply(X))


def _origin(path: Path, where: str, origin: ET.Element) -> RigidTransform:
    """A pose as URDF has it."""
    xyz = numbers(path, f"{where}, xyz", origin.get("xyz", "0 0 0"), 3)
    rpy = numbers(path, f"{where}, rpy", origin.get("rpy", "0 0 0"), 3)
    return RigidTransform(RollPitchYaw(rpy), xyz)


_Points = dict[str, Frame]


def _points(plant: MultibodyPlant) -> tuple[_Points, _Points]:
    """Frames of exit and anchor points by the cable's name; no link is one that is alone."""
    exits: _Points = {}
    anchors: _Points = {}
    joints = {
        frame.index()
        for index in plant.GetJointIndices()
        for frame in (
            plant.get_joint(index).frame_on_parent(), plant.get_joint(index).frame_on_child()
        )
    }  # fmt: skip
    for k in range(plant.num_frames()):
        frame = plant.get_frame(FrameIndex(k))
        if frame.is_body_frame():
            alone = len(plant.GetBodiesWeldedTo(frame.body())) == 1
            if alone and frame.body().is_floating_base_body():
                continue
        elif FrameIndex(k) in joints:
            continue
        for pattern, found in ((_EXIT, exits), (_ANCHOR, anchors)):
            match = pattern.match(frame.name())
            if match:
                found[match["cable"]] = frame
    return exits, anchors


def is_frame_name(cable: str) -> bool:
    """Whether frames `exit_NAME` and `anchor_NAME` are read as those of the cable of that name."""
    found = _EXIT.match(f"exit_{cable}"), _ANCHOR.match(f"anchor_{cable}")
    return all(match is not None and match["cable"] == cable for match in found)


def _limits(plant: MultibodyPlant, draft: RobotDraft) -> None:
    """Largest tension and speed from the actuator of a joint that bears the cable's name."""
    efforts = {
        plant.get_joint_actuator(index).joint().name(): plant.get_joint_actuator(index)
        for index in plant.GetJointActuatorIndices()
    }
    for cable in draft.cables:
        actuator = efforts.get(cable.name)
        if actuator is not None and 0.0 < actuator.effort_limit() < np.inf:
            cable.upper = float(actuator.effort_limit())
            joint = actuator.joint()
            if isinstance(joint, PrismaticJoint) and 0.0 < joint.velocity_upper_limit() < np.inf:
                draft.cable_speed = float(joint.velocity_upper_limit())


def _cylinders(
    plant: MultibodyPlant, scene_graph: SceneGraph, name: str
) -> list[tuple[RigidTransform, Cylinder]]:
    """Cylinders that are drawn of the one link of a name, with their poses in it."""
    if plant.NumBodiesWithName(name) != 1:
        return []
    inspector = scene_graph.model_inspector()
    frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(name).index())
    found = [
        (inspector.GetPoseInFrame(item), inspector.GetShape(item))
        for item in inspector.GetGeometries(frame, Role.kIllustration)
    ]
    return [(X, shape) for X, shape in found if isinstance(shape, Cylinder)]


def _frame(
    plant: MultibodyPlant, scene_graph: SceneGraph, context: Context, draft: RobotDraft
) -> None:
    """The frame from twelve beams on the edges of a box, on a link of that name."""
    beams = _cylinders(plant, scene_graph, "frame")
    if len(beams) != 12:
        return
    body = plant.GetBodyByName("frame")
    X_WF = plant.EvalBodyPoseInWorld(context, body)
    ends = np.array(
        [
            X_WF.multiply(X.multiply(np.array([0.0, 0.0, sign * shape.length() / 2.0])))
            for X, shape in beams
            for sign in (-1.0, 1.0)
        ]
    )
    draft.frame_lower, draft.frame_upper = ends.min(axis=0), ends.max(axis=0)
    draft.beam = 2.0 * float(beams[0][1].radius())


def _diameters(plant: MultibodyPlant, scene_graph: SceneGraph, draft: RobotDraft) -> None:
    """Diameters from the cylinders of links `rod_NAME`."""
    for cable in draft.cables:
        rods = _cylinders(plant, scene_graph, f"rod_{cable.name}")
        if len(rods) == 1:
            diameter = 2.0 * float(rods[0][1].radius())
            draft.diameter = draft.diameter or diameter
            if diameter != draft.diameter:
                cable.material["diameter"] = diameter


def _box(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    context: Context,
    carried: CarriedBodies,
    draft: RobotDraft,
) -> None:
    """The platform's box: the first one along axes of P, of P's own link if that has one."""
    inspector = scene_graph.model_inspector()
    X_PW = plant.EvalBodyPoseInWorld(context, carried.platform).inverse()
    bodies = sorted(carried.composite, key=lambda body: body.index() != carried.platform.index())
    for body in bodies:
        X_PB = X_PW.multiply(plant.EvalBodyPoseInWorld(context, body))
        frame = plant.GetBodyFrameIdOrThrow(body.index())
        for role in (Role.kIllustration, Role.kProximity):
            for geometry in inspector.GetGeometries(frame, role):
                shape = inspector.GetShape(geometry)
                X_PG = X_PB.multiply(inspector.GetPoseInFrame(geometry))
                if isinstance(shape, Box) and X_PG.rotation().IsNearlyIdentity(1e-9):
                    draft.box_size = np.array(shape.size(), float)
                    draft.box_center = X_PG.translation()
                    return


def _chains(model: ET.Element) -> list[str]:
    """Numbers of the cables that are chains of links, as the Gazebo simulator writes them."""
    names = {link.get("name", "") for link in model.iter("link")}
    numbered = (name.removeprefix("virt_X") for name in names if re.match(r"^virt_X\d+$", name))
    return sorted((n for n in numbered if f"virt_Xpf{n}" in names), key=int)


def _pose(path: Path, link: ET.Element) -> RigidTransform:
    values = numbers(
        path, f"link {link.get('name')}, pose", link.findtext("pose") or "0 0 0 0 0 0", 6
    )
    return RigidTransform(RollPitchYaw(values[3:]), values[:3])


def _read_chains(path: Path, root: ET.Element) -> RobotDraft:
    model = root.find("model")
    assert model is not None
    words = Path(model.get("name") or path.stem).stem
    draft = RobotDraft(name=robot_name(words), tool=SDF_TOOL, title=words, motion="3R3T")
    links = {link.get("name", ""): link for link in model.iter("link")}
    platform = links.get("platform")
    if platform is None:
        raise fail(path, "link platform", "none", "a link of that name")
    X_WP = _pose(path, platform)
    draft.home_position, draft.R_WP = X_WP.translation(), X_WP.rotation().matrix()
    for number in _chains(model):
        anchor = _pose(path, links[f"virt_Xpf{number}"]).translation()
        draft.cables.append(
            DraftCable(
                name=f"C{int(number) + 1}",
                exit_point=_pose(path, links[f"virt_X{number}"]).translation(),
                anchor_point=X_WP.inverse().multiply(anchor),
            )
        )
    inertial = platform.find("inertial")
    draft.mass = float(
        numbers(path, "platform mass", platform.findtext("inertial/mass") or "", 1)[0]
    )
    draft.center_of_mass = np.zeros(3)
    if inertial is not None and inertial.find("inertia") is not None:
        draft.inertia = np.array(
            [
                float(
                    numbers(path, f"platform {key}", inertial.findtext(f"inertia/{key}") or "0", 1)[
                        0
                    ]
                )
                for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
            ]
        )
    size = platform.findtext(".//box/size")
    if size is not None:
        draft.box_size, draft.box_center = numbers(path, "platform box", size, 3), np.zeros(3)
    draft.remarks.append("Chains of joints in the place of cables became cables; what their links "
                         "weigh was not kept.")  # fmt: skip
    _chain_cables(path, model, draft)
    parts = {name for name in links if name.startswith(("virt_", "cable"))}
    for item in model:
        ends = {item.findtext("parent", ""), item.findtext("child", "")}
        if item.get("name") in parts or (item.tag == "joint" and ends & parts):
            mark_below(item)
    for item in (root, model):
        mark(item)
    draft.remarks += not_kept(root, _PRESENTATION)
    return draft


def _chain_cables(path: Path, model: ET.Element, draft: RobotDraft) -> None:
    """Radius, force and speed limits from the first chain."""
    for joint in model.iter("joint"):
        if joint.get("type") == "prismatic":
            effort = joint.findtext("axis/limit/effort")
            if effort is not None and float(numbers(path, "effort", effort, 1)[0]) > 0.0:
                for cable in draft.cables:
                    cable.upper = float(numbers(path, "effort", effort, 1)[0])
            speed = joint.findtext("axis/limit/velocity")
            if speed is not None and float(numbers(path, "velocity", speed, 1)[0]) > 0.0:
                draft.cable_speed = float(numbers(path, "velocity", speed, 1)[0])
            break
    for link in model.iter("link"):
        radius = link.findtext(".//cylinder/radius")
        if re.match(r"^cable\d+$", link.get("name", "")) and radius is not None:
            draft.diameter = 2.0 * float(numbers(path, "cable radius", radius, 1)[0])
            return

"""Robots in SDFormat or URDF: a platform and named frames for exit and anchor points.

A frame, or a link that is fixed to another, is an exit point where its name is `exit_`, `frame_`,
`base_` or `A` and the cable's name, and an anchor point where it is `anchor_`, `platform_` or `B`
and the same name. Drake's parser reads the file, so frames may be relative to each other, in
included models, or links of URDF. Files of the Gazebo simulator, whose cables are chains of links
`virt_X` and `virt_Xpf`, are read without a parser of joints, since their loops have none in Drake.

Source: SDFormat 1.12; Gazebo thesis 5.4 and the simulator's files for the chains.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from pydrake.geometry import Box, Cylinder, Role, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FrameIndex, PrismaticJoint, RigidBody

from cdpr_drake.models.drake_parsing import drake_refusals, parse_models
from cdpr_drake.models.formats.draft import DraftCable, RobotDraft
from cdpr_drake.models.formats.file_kinds import is_sdformat
from cdpr_drake.models.formats.reading import fail, numbers, read_xml, robot_name

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
        return _read_chains(path, model)
    words = path.stem if model is None else model.get("name") or path.stem
    draft = RobotDraft(name=robot_name(words), tool=tool, title=words, motion="3R3T")
    scene_graph = SceneGraph()
    plant = MultibodyPlant(0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
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
    body = _platform(path, [anchors[name][0] for name in names])
    context = plant.CreateDefaultContext()
    X_WP = plant.EvalBodyPoseInWorld(context, body)
    for name in names:
        other, X_OA = exits[name]
        X_WA = plant.EvalBodyPoseInWorld(context, other).multiply(X_OA)
        draft.cables.append(
            DraftCable(
                name=name,
                exit_point=X_WA.translation(),
                anchor_point=anchors[name][1].translation(),
            )
        )
    _limits(plant, draft)
    _body(plant, body, draft)
    _box(plant, scene_graph, body, draft)
    _frame(plant, scene_graph, draft)
    _diameters(plant, scene_graph, draft)
    X_WP = _floating(path, root, body.name()) or X_WP
    draft.home_position, draft.R_WP = X_WP.translation(), X_WP.rotation().matrix()
    gravity = plant.gravity_field().gravity_vector()
    draft.gravity = float(np.linalg.norm(gravity))
    if np.any(gravity[:2] != 0.0) or gravity[2] > 0.0:
        draft.gravity_direction = np.array(gravity)
    return draft


def _without_balls(root: ET.Element) -> int:
    """Takes ball joints out, which close loops that Drake has not; returns how many."""
    found = 0
    for parent in list(root.iter()):
        for joint in parent.findall("joint"):
            if joint.get("type") == "ball":
                parent.remove(joint)
                found += 1
    return found


def _floating(path: Path, root: ET.Element, platform: str) -> RigidTransform | None:
    """Where a floating joint of URDF has the platform; Drake reads no such joints."""
    for joint in root.findall("joint"):
        child, origin = joint.find("child"), joint.find("origin")
        if joint.get("type") != "floating" or child is None or origin is None:
            continue
        if child.get("link") == platform:
            xyz = numbers(path, "floating joint, xyz", origin.get("xyz", "0 0 0"), 3)
            rpy = numbers(path, "floating joint, rpy", origin.get("rpy", "0 0 0"), 3)
            return RigidTransform(RollPitchYaw(rpy), xyz)
    return None


_Points = dict[str, tuple[RigidBody, RigidTransform]]


def _points(plant: MultibodyPlant) -> tuple[_Points, _Points]:
    """Exit and anchor points by the cable's name: the body that has them, and the pose in it."""
    exits: _Points = {}
    anchors: _Points = {}
    joints = {
        frame.index()
        for index in plant.GetJointIndices()
        for frame in (
            plant.get_joint(index).frame_on_parent(), plant.get_joint(index).frame_on_child()
        )
    }  # fmt: skip
    candidates = [
        plant.get_frame(FrameIndex(k))
        for k in range(plant.num_frames())
        if FrameIndex(k) not in joints or plant.get_frame(FrameIndex(k)).is_body_frame()
    ]
    context = plant.CreateDefaultContext()
    for frame in candidates:
        body, X_BF = frame.body(), frame.GetFixedPoseInBodyFrame()
        if frame.is_body_frame():  # what it is fixed to, if it is a point
            welded = [b for b in plant.GetBodiesWeldedTo(body) if b.index() != body.index()]
            heavy = [b for b in welded if b.default_mass() > 0.0] or welded
            if not heavy:
                continue
            X_BF = (
                plant.EvalBodyPoseInWorld(context, heavy[0])
                .inverse()
                .multiply(plant.EvalBodyPoseInWorld(context, body))
            )
            body = heavy[0]
        for pattern, found in ((_EXIT, exits), (_ANCHOR, anchors)):
            match = pattern.match(frame.name())
            if match:
                found[match["cable"]] = (body, X_BF)
    return exits, anchors


def _platform(path: Path, bodies: list[RigidBody]) -> RigidBody:
    names = sorted({body.name() for body in bodies})
    if len(names) > 1:
        raise fail(path, "anchor points", "on " + ", ".join(names), "all on one link, the platform")
    return bodies[0]


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


def _frame(plant: MultibodyPlant, scene_graph: SceneGraph, draft: RobotDraft) -> None:
    """The frame from twelve beams on the edges of a box, on a link of that name."""
    beams = _cylinders(plant, scene_graph, "frame")
    if len(beams) != 12:
        return
    body = plant.GetBodyByName("frame")
    X_WF = plant.EvalBodyPoseInWorld(plant.CreateDefaultContext(), body)
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


def _body(plant: MultibodyPlant, body: RigidBody, draft: RobotDraft) -> None:
    inertia = body.default_spatial_inertia()
    draft.mass = float(inertia.get_mass())
    com = np.asarray(inertia.get_com())
    draft.center_of_mass = com
    about = inertia.Shift(com).CalcRotationalInertia()
    moments, products = about.get_moments(), about.get_products()
    draft.inertia = np.array([*moments, *products])


def _box(
    plant: MultibodyPlant, scene_graph: SceneGraph, body: RigidBody, draft: RobotDraft
) -> None:
    inspector = scene_graph.model_inspector()
    frame = plant.GetBodyFrameIdOrThrow(body.index())
    for role in (Role.kIllustration, Role.kProximity):
        for geometry in inspector.GetGeometries(frame, role):
            shape = inspector.GetShape(geometry)
            if isinstance(shape, Box):
                X_PG = inspector.GetPoseInFrame(geometry)
                if np.allclose(X_PG.rotation().matrix(), np.eye(3), atol=1e-9):
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


def _read_chains(path: Path, model: ET.Element) -> RobotDraft:
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
    draft.remarks.append("Chains of joints in the place of cables became cables.")
    _chain_cables(path, model, draft)
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

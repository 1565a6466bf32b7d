"""A file in MJCF as MuJoCo compiles it, and what of it a robot on cables takes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from cdpr_drake.errors import RobotFileError, install_words
from cdpr_drake.formats.draft import RobotDraft
from cdpr_drake.formats.unread import mark, mark_below, watched
from cdpr_drake.models.foreign_text import fail, read_xml

SMALLEST = "smallest_tension"
"""The custom number that has the robot's smallest tension [N]: a motor with a smallest pull above 0
would pull when nothing is commanded."""

_MOST_INCLUDES = 100

_PLACES = ("pos", "quat", "euler", "axisangle", "xyaxes", "zaxis")

_USED = {
    "geom": (*_PLACES, "type", "size", "fromto", "mass", "density", "mesh", "fitscale",
             "shellinertia", "hfield"),
    "joint": ("type", "axis", "pos"),
    "site": (*_PLACES, "fromto"),
    "spatial": ("width", "stiffness", "springlength"),
    "tendon": ("width", "stiffness", "springlength"),
    "option": ("gravity",),
}  # fmt: skip
"""Attributes that make the robot, of elements that belong to it, and of defaults."""

_MOTOR = ("tendon", "gear", "forcerange", "forcelimited")
"""Attributes that limit a cable's tension."""

_WHOLE = ("mujoco", "compiler", "worldbody", "default", "frame", "replicate", "attach", "include")
"""Elements that MuJoCo resolves."""


class Compiled(NamedTuple):
    """MuJoCo, a compiled model, and its data."""

    mujoco: Any
    model: Any
    data: Any


@contextmanager
def told_by_mujoco() -> Iterator[list[str]]:
    """What MuJoCo warns of meanwhile, each once.

    It would write that on stderr, and into a file in the working folder.
    """
    try:
        import mujoco
    except ImportError:  # `compiled_model` says so
        yield []
        return
    words: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(words.append)
    try:
        yield words
    finally:
        mujoco.set_mju_user_warning(before)
        words[:] = dict.fromkeys(" ".join(each.split()) for each in words)


def compiled_model(path: Path) -> tuple[Compiled, ET.Element, list[str]]:
    """The model, the document with all that it includes, and remarks on files that are not there.

    Raises:
        RobotFileError: MuJoCo is not installed or cannot read the file; or the mass follows from a
            mesh that is not there.
    """
    document = watched(_expanded(path, read_xml(path), [0]))
    try:
        import mujoco
    except ImportError as problem:
        raise RobotFileError(
            f"{path}: MJCF is read by MuJoCo, which is not installed; {install_words('mjcf')}"
        ) from problem
    remarks: list[str] = []
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as problem:
        try:
            spec = mujoco.MjSpec.from_file(str(path))
            remarks = _without_missing_files(path, spec)
            if not remarks:
                raise
            model = spec.compile()
        except ValueError as again:
            words = " ".join(str(again).split())
            raise RobotFileError(f"{path}: MuJoCo cannot read it: {words[:300]}") from problem
    return Compiled(mujoco, model, mujoco.MjData(model)), document, remarks


def _expanded(path: Path, root: ET.Element, count: list[int]) -> ET.Element:
    """A document with the content of included files in the place of `include`."""
    for parent in list(root.iter()):
        for place, child in reversed(list(enumerate(parent))):
            count[0] += child.tag == "include"
            file = path.parent / child.get("file", "")
            if child.tag == "include" and count[0] <= _MOST_INCLUDES and file.is_file():
                inner = _expanded(path, read_xml(file), count)
                parent[place : place + 1] = list(inner)
    return root


def _without_missing_files(path: Path, spec: Any) -> list[str]:
    """Takes what is only drawn out of a model where its file is not there; remarks on it.

    Raises:
        RobotFileError: A body's mass follows from a mesh that is not there.
    """
    remarks = []
    for mesh in list(spec.meshes):
        file = path.parent / spec.meshdir / mesh.file
        if (
            not mesh.file
            or file.is_file()
            or (Path(mesh.file).is_absolute() and Path(mesh.file).is_file())
        ):
            continue
        name = mesh.name or Path(mesh.file).stem
        unknown = False
        for geom in [geom for geom in spec.geoms if geom.meshname == name]:
            massless = geom.parent.explicitinertial or geom.mass == 0.0 or geom.density == 0.0
            if not massless and (geom.contype or geom.conaffinity or geom.mass > 0.0):
                raise fail(path, f"mesh {name}", f"no file {mesh.file}",
                           "the file, from which the mass of the body follows, or the body's "
                           "element inertial")  # fmt: skip
            unknown |= not massless
            spec.delete(geom)
        spec.delete(mesh)
        counts = "; it counts for no mass, as it has none of its own" if unknown else ""
        remarks.append(f"Mesh {name} was left out, there is no file {mesh.file}{counts}.")
    folder = path.parent / spec.texturedir
    missing = [one.file for one in spec.textures if one.file and not (folder / one.file).is_file()]
    if missing:
        for geom in spec.geoms:
            geom.material = ""
        for site in spec.sites:
            site.material = ""
        for tendon in spec.tendons:
            tendon.material = ""
        for thing in [*spec.materials, *spec.textures]:
            spec.delete(thing)
        remarks.append(f"Materials were left out, there is no file {', '.join(missing)}.")
    return remarks


def home_key(model: Any) -> int | None:
    """The keyframe that has the home pose: the one called home, or the only one."""
    names = [str(model.key(k).name).lower() for k in range(model.nkey)]
    if "home" in names:
        return names.index("home")
    return 0 if len(names) == 1 else None


def mark_used(
    document: ET.Element,
    compiled: Compiled,
    platform: int,
    composite: list[int],
    key: int | None,
    draft: RobotDraft,
) -> None:
    """Counts as used what makes the robot; names bodies that no cable holds."""
    model = compiled.model
    bodies = _bodies(document, model)
    others = [body for body in range(1, model.nbody)
              if model.body_weldid[body] != 0 and body not in composite]  # fmt: skip
    if others:
        words = ", ".join(model.body(body).name or str(body) for body in others)
        draft.remarks.append(f"Bodies that no cable holds were not kept: {words}.")
    held = {site.attrib.get("site") for spatial in document.iter("spatial") for site in spatial}
    for item in document.iter():
        tag = item.tag
        if tag in _WHOLE:
            mark(item)
        elif tag == "option":
            mark(item, *_USED["option"])
    for default in document.iter("default"):
        for item in default:
            mark(item, *_USED.get(str(item.tag), ()), *_no_contact(item))
            if item.tag in ("motor", "general"):
                mark(item, *_MOTOR)
    for parent in [document, *document.iter()]:
        for item in parent:
            if item.tag == "site" and item.attrib.get("name") in held:
                mark(item, *_USED["site"])
    for body, item in bodies.items():
        mark(item, *_PLACES, "mocap")
        if body in others:
            mark_below(item)
        elif body in composite:
            for part in _own(item):
                if part.tag in ("inertial", "freejoint"):
                    mark_below(part)
                elif part.tag == "joint" and body != platform:
                    mark_below(part)  # it was fixed, which is said
                elif part.tag in ("geom", "joint"):
                    mark(part, *_USED[str(part.tag)], *_no_contact(part))
    names = {cable.name for cable in draft.cables}
    for tendon in document.iter("tendon"):
        for item in tendon:
            if item.tag == "spatial":
                mark(item, *_USED["spatial"])
                for site in item:
                    mark(site)
            elif item.tag == "fixed":
                mark_below(item)
    for actuator in document.iter("actuator"):
        for item in actuator:
            if item.attrib.get("tendon") in names and "forcerange" in item.attrib:
                mark(item, *_MOTOR)
    for number in document.iter("numeric"):
        if number.attrib.get("name") == SMALLEST:
            mark_below(number)
    for k, item in enumerate(document.iter("key")):
        if k == key:
            mark(item, "qpos")


def _own(body: ET.Element) -> list[ET.Element]:
    """Elements of a body, also within frames, but not those of its children."""
    found = []
    for item in body:
        if item.tag in ("frame", "replicate"):
            found += _own(item)
        elif item.tag != "body":
            found.append(item)
    return found


def _no_contact(item: ET.Element) -> list[str]:
    """Attributes that say that a geom touches nothing, of which nothing is lost."""
    return [key for key in ("contype", "conaffinity") if item.attrib.get(key) == "0"]


def _bodies(document: ET.Element, model: Any) -> dict[int, ET.Element]:
    """Elements of bodies by MuJoCo's ids: in the order of the document, else by name."""
    items = [item for world in document.iter("worldbody") for item in world.iter("body")]
    if len(items) == model.nbody - 1:
        return dict(enumerate(items, start=1))
    names = {model.body(body).name: body for body in range(1, model.nbody)}
    return {names[item.attrib["name"]]: item for item in items if item.attrib.get("name") in names}

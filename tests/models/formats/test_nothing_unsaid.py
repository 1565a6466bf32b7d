"""What a file of another tool says is in the robot, or named as not kept."""

from __future__ import annotations

import copy
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import asdict

import numpy as np
import pytest
import yaml

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.formats import caspr, gazebo_yaml, mjcf, named_frames, wirex
from cdpr_drake.models.formats.caspr_trees import read_tree
from cdpr_drake.models.formats.detection import read_foreign
from tests.models.formats import foreign_files, rich_files
from tests.models.formats.tree_files import two_link

HIDDEN = {
    "urdf": named_frames._PRESENTATION,
    "sdf": named_frames._PRESENTATION | {"parent", "child"},
    "xml": mjcf.PRESENTATION,
    "wcrfx": wirex._PRESENTATION,
    "caspr": caspr.PRESENTATION,
}
"""Elements and attributes that only say how things look or are called, by ending."""


def told(path):
    """A draft as text without its remarks, and its remarks; a refusal as text alone."""
    try:
        draft = read_foreign(path)
    except RobotFileError as problem:
        return str(problem), []
    values = {key: value for key, value in asdict(draft).items() if key != "remarks"}
    return repr(values), draft.remarks


def parts_of(root):
    """Each attribute, text and empty element of a document: its element's tags, and its own."""

    def walk(item, path):
        here = [*path, item]
        for key in item.attrib:
            yield here, key
        if (item.text or "").strip():
            yield here, None
        for child in item:
            if not child.attrib and not len(child) and not (child.text or "").strip():
                yield [*here, child], ""
            yield from walk(child, here)

    yield from walk(root, [])


def without(root, place, key):
    """The document without one of its parts."""
    changed = copy.deepcopy(root)
    item = list(changed.iter())[list(root.iter()).index(place[-1])]
    if key:
        del item.attrib[key]
    elif key is None:
        item.text = None
    else:
        parents = {child: parent for parent in changed.iter() for child in parent}
        parents[item].remove(item)
    return changed


def is_hidden(place, key, hidden):
    tags = [str(item.tag) for item in place]
    return bool(set(tags) & hidden) or bool({f"@{key}", f"{tags[-1]}@{key}"} & hidden)


def is_named(place, key, remarks):
    """Whether remarks name a part, or an element round it, or the body or joint that it is in."""
    words = " ".join(remarks)
    path = "/".join(str(item.tag) for item in place)
    if key and f"{path}@{key}" in words:
        return True
    tags = path.split("/")
    if any(f"{'/'.join(tags[:n])}{end}" in words for n in range(2, len(tags) + 1)
           for end in (" ", ",", ".")):  # fmt: skip
        return True
    for item in place:
        name, said = item.get("name") or item.get("id"), WHOLE.get(str(item.tag))
        lines = [line.replace(",", " ").replace(".", " ").split() for line in remarks
                 if said and said in line]  # fmt: skip
        if any(name in line for line in lines):
            return True
    return False


WHOLE = {"joint": "was fixed", "link": "no cable holds", "body": "no cable holds",
         "cable_set": "also has"}  # fmt: skip
"""What a remark says of an element that it means as a whole, by name."""


@pytest.mark.parametrize(
    ("name", "text"),
    [("rich.urdf", rich_files.URDF), ("rich.sdf", rich_files.SDF), ("rich.xml", rich_files.MJCF)],
)
def test_every_part_of_a_model_is_used_or_named(name, text, tmp_path):
    if name.endswith("xml"):
        pytest.importorskip("mujoco")
    path = tmp_path / name
    path.write_text(text)
    before, remarks = told(path)
    root, unsaid, count = ET.fromstring(text), [], 0
    for place, key in parts_of(root):
        if is_hidden(place, key, HIDDEN[name.rpartition(".")[2]]) or is_named(place, key, remarks):
            continue
        count += 1
        path.write_text(ET.tostring(without(root, place, key), encoding="unicode"))
        if told(path) == (before, remarks):
            unsaid.append(("/".join(str(item.tag) for item in place), key))
    assert count > 15
    assert unsaid == []


def caspr_cables(folder):
    foreign_files.caspr(folder)
    return folder / "toy_cables.xml"


@pytest.mark.parametrize("write", [foreign_files.wirex, foreign_files.caspr, caspr_cables])
def test_elements_that_no_reader_knows_are_named(write, tmp_path):
    """Wherever they stand, with an attribute or a text."""
    path = write(tmp_path)
    text = path.read_text()
    starts = ("<models", "<cables ", "<bodies_system")
    head, start, body = text.partition(next(start for start in starts if start in text))
    root = ET.fromstring(start + body)
    parents = {child: parent for parent in root.iter() for child in parent}
    for number, item in enumerate(root.iter()):
        place = [item]
        while place[0] in parents:
            place.insert(0, parents[place[0]])
        changed = copy.deepcopy(root)
        ET.SubElement(list(changed.iter())[number], "oddity", value="3")
        path.write_text(head + ET.tostring(changed, encoding="unicode"))
        words, remarks = told(path)
        assert "oddity" in " ".join([words, *remarks]) or is_named(place, None, remarks), item.tag


def odd_mappings(content):
    """The document with one key more, in each of its mappings in turn."""

    def mappings(value):
        if isinstance(value, dict):
            yield value
        for item in value.values() if isinstance(value, dict) else value:
            if isinstance(item, (dict, list)):
                yield from mappings(item)

    for place in range(len(list(mappings(content)))):
        changed = copy.deepcopy(content)
        list(mappings(changed))[place]["oddity"] = 3
        yield changed


@pytest.mark.parametrize("fork", [False, True])
def test_keys_that_no_reader_knows_are_named_of_gazebo(fork, tmp_path):
    path = foreign_files.gazebo(tmp_path, fork=fork)
    for changed in odd_mappings(yaml.safe_load(path.read_text())):
        body = changed.get("model", changed)
        if "oddity" in {**(changed.get("controllers") or {}), **body["joints"]["passive"]}:
            continue  # they are named as a whole
        path.write_text(yaml.safe_dump(changed))
        words, remarks = told(path)
        assert "oddity" in " ".join([words, *remarks]), changed


def test_keys_that_no_reader_knows_are_named_of_grab(tmp_path):
    path = foreign_files.grab_on_board(tmp_path)
    for changed in odd_mappings(json.loads(path.read_text())):
        path.write_text(json.dumps(changed))
        assert "oddity" in " ".join(told(path)[1]), changed


MASLOW = """
name: my board
Maslow_vertical: false
kinematics: {MaslowKinematics: {tlX: 0, tlY: 2000, tlZ: 100, trX: 3000, trY: 2000, trZ: 56, blX: 0,
  blY: 0, blZ: 34, brX: 3000, brY: 0, brZ: 78, beltEndExtension: 30, armLength: 123.4, oddity: 1},
  Cartesian: {}}
axes: {x: {steps_per_mm: 80}}
"""

KLIPPER = """
[include mcu.cfg]
[printer]
kinematics: winch
max_velocity: 300
max_accel: 1000
[stepper_a]
step_pin: PA0
anchor_x: -3200
anchor_y: -2100
anchor_z: 5400
[stepper_b]
anchor_x: 3200
anchor_y: -2100
anchor_z: 5400
[stepper_c]
anchor_x: 0
anchor_y: 2100
anchor_z: 5400
[winch]
mover_weight: 5.5
oddity: 3
[extruder]
nozzle_diameter: 0.4
"""

DUET = """; four anchors
M669 K6 N4 P2 A1500:1500:3500 B-1500:1500:3500 C-1500:-1500:3500 D1500:-1500:3500
M666 Q0.06 R75.0:75.0:75.0:75.0 W2.0 Z3
M92 X100
"""


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("maslow.yaml", MASLOW,
         "Not kept: name, kinematics.Cartesian, kinematics.MaslowKinematics.oddity, axes."),
        ("printer.cfg", KLIPPER, "Not kept: printer.max_accel, winch.oddity, extruder."),
        ("printer.cfg", KLIPPER, "Included files were not read: mcu.cfg."),
        ("printer.cfg", KLIPPER, "Keys of steppers that were not kept: step_pin."),
        ("config.g", DUET, "Parameters of M669 that were not kept: P."),
        ("config.g", DUET, "Parameters of M666 that were not kept: Z."),
        ("config.g", DUET, "Commands that were not read: M92."),
    ],
)  # fmt: skip
def test_what_firmwares_have_besides_is_named(name, text, words, tmp_path):
    path = tmp_path / name
    path.write_text(text)
    assert words in told(path)[1]


def test_klipper_s_mover_has_its_mass(tmp_path):
    path = tmp_path / "printer.cfg"
    path.write_text(KLIPPER)
    assert read_foreign(path).mass == 5.5
    path.write_text(KLIPPER.replace("5.5", "0"))
    with pytest.raises(RobotFileError, match=r"winch.mover_weight: found 0; accepted: above 0"):
        read_foreign(path)


def test_the_comparison_sees_what_is_unsaid(tmp_path, monkeypatch):
    """A check that could not fail would be none."""
    path = tmp_path / "rich.urdf"
    path.write_text(rich_files.URDF)
    monkeypatch.setattr(named_frames, "not_kept", lambda *_: [])
    before, remarks = told(path)
    root = ET.fromstring(rich_files.URDF)
    (sensor,) = root.iter("gazebo")
    changed = without(root, [root, sensor], "reference")
    path.write_text(ET.tostring(changed, encoding="unicode"))
    assert told(path) == (before, remarks)
    assert not is_named([root, sensor], "reference", remarks)
    assert np.isfinite(read_foreign(path).mass)


def test_gazebo_presentation_is_of_keys_that_exist():
    assert "platform.color" in gazebo_yaml._PRESENTATION


def test_what_included_files_hold_is_used_or_named_too(tmp_path, monkeypatch):
    """By a file, by a folder with a model.config, and by a file that includes one."""
    start = '<sdf version="1.9">'
    model = rich_files.SDF[rich_files.SDF.index('<model name="rich">') :].replace("</world>", "")
    inner = tmp_path / "inner.sdf"
    inner.write_text(start + model)
    config = f"<model><name>rich</name>{start}inner.sdf</sdf></model>"
    (tmp_path / "model.config").write_text(config)

    def including(name, uri):
        path = tmp_path / name
        text = f"<include><uri>file://{uri}</uri><name>inside</name></include>"
        path.write_text(f'{start}<model name="{path.stem}">{text}</model></sdf>')
        return path

    def parts(words):
        """What is not kept, without the elements round it."""
        return sorted(re.findall(r"link/[a-z/@]+ of [a-z]+|plugin of [a-z]+", " ".join(words)))

    _, own = told(inner)
    assert len(parts(own)) == 5
    by_file = including("file.sdf", inner)
    deep = including("deep.sdf", by_file)
    for path in (by_file, including("folder.sdf", tmp_path), deep):
        _, remarks = told(path)
        assert parts(remarks) == parts(own)
        assert "name" not in remarks[-1]
    monkeypatch.setattr(named_frames, "_MOST_INCLUDES", 1)
    _, remarks = told(deep)
    assert remarks[-1].startswith("Of these included files only bodies, joints and frames were")
    assert remarks[-1].endswith(f"is not named: file://{inner}.")


def test_every_part_of_a_tree_of_caspr_is_used_or_named(tmp_path):
    """Each attribute and text is taken out, and each element gets one that no reader knows."""
    model = two_link()
    bodies = model.write(tmp_path)
    cables = bodies.with_name(f"{model.name}_cables.xml")

    def read():
        try:
            tree = read_tree(bodies, cables, "toy")
        except RobotFileError as problem:
            return str(problem), []
        return repr(plain(tree)), list(tree.remarks)

    def plain(tree):
        return {**asdict(tree), "remarks": ()}

    before, count, unsaid = read(), 0, []
    hidden = HIDDEN["caspr"] | {
        "@default_cable_set"
    }  # which names the first set, here the only one
    for path in (bodies, cables):
        text = path.read_text()
        head, start, body = text.partition("<bodies_system" if path == bodies else "<cables ")
        root = ET.fromstring(start + body)
        for place, key in parts_of(root):
            if is_hidden(place, key, hidden) or is_named(place, key, before[1]):
                continue
            count += 1
            path.write_text(head + ET.tostring(without(root, place, key), encoding="unicode"))
            if read() == before:
                unsaid.append(("/".join(str(item.tag) for item in place), key))
        for number, item in enumerate(root.iter()):
            changed = copy.deepcopy(root)
            ET.SubElement(list(changed.iter())[number], "oddity", value="3")
            path.write_text(head + ET.tostring(changed, encoding="unicode"))
            words, remarks = read()
            assert "oddity" in " ".join([words, *remarks]), item.tag
        path.write_text(text)
    assert count > 40
    assert unsaid == []

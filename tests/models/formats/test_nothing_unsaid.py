"""What a file of another tool says is in the robot or named as lost: each part is taken out."""

import copy
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import asdict

import pytest
import yaml

from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats import caspr, gazebo_yaml, mjcf, named_frames
from cdpr_drake.formats.caspr_trees import read_tree
from cdpr_drake.formats.detection import read_foreign
from tests.models.formats import foreign_files, rich_files
from tests.models.formats.tree_files import pair, two_link

pytestmark = pytest.mark.usefixtures("in_this_process")

HIDDEN = {
    "rich.urdf": named_frames._PRESENTATION,
    "rich.sdf": named_frames._PRESENTATION | {"parent", "child"},
    "rich.xml": mjcf.PRESENTATION,
    "caspr": caspr.PRESENTATION | {"@default_cable_set"},  # of the only set here
}
"""Elements and attributes that only say how things look or are called."""

WHOLE = {"joint": "was fixed", "link": "no cable holds", "body": "no cable holds",
         "cable_set": "also has"}  # fmt: skip
"""What a remark says of an element that it means as a whole, by name."""


def told(path):
    """A draft as text without its remarks, and its remarks; a refusal as text alone."""
    try:
        draft = read_foreign(path)
    except RobotFileError as problem:
        return str(problem), []
    return repr({**asdict(draft), "remarks": ()}), draft.remarks


def told_tree(bodies):
    """The same of a tree of links."""
    try:
        tree = read_tree(bodies, bodies.with_name("toy_cables.xml"), "toy")
    except RobotFileError as problem:
        return str(problem), []
    return repr({**asdict(tree), "remarks": ()}), list(tree.remarks)


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
    tags = [str(item.tag) for item in place]
    if key and f"{'/'.join(tags)}@{key}" in words:
        return True
    rounds = ["/".join(tags[:n]) for n in range(2, len(tags) + 1)]
    if any(f"{path}{end}" in words for path in rounds for end in (" ", ",", ".")):
        return True
    for item in place:
        name, said = item.get("name") or item.get("id"), WHOLE.get(str(item.tag))
        lines = [line for line in remarks if said and said in line]
        if any(name in line.replace(",", " ").replace(".", " ").split() for line in lines):
            return True
    return False


def document(path):
    """What stands before the root of a file, and the root."""
    head, start, rest = re.split(r"(<[a-z_]+[ >])", path.read_text(), maxsplit=1)
    return head, ET.fromstring(start + rest)


def unsaid_parts(path, read, hidden):
    """Parts of a file that could be away and nothing would be another; how many were tried.

    Of parts that differ by the number in a name, as those of exit_C1 and exit_C2, it is the first.
    """
    before, (head, root), text = read(), document(path), path.read_text()
    unsaid, tried = [], set()
    for place, key in parts_of(root):
        names = [re.sub(r"\d", "", f"{item.tag} {item.get('name')}") for item in place]
        kind = "/".join(names), key
        if kind in tried or is_hidden(place, key, hidden) or is_named(place, key, before[1]):
            continue
        tried.add(kind)
        path.write_text(head + ET.tostring(without(root, place, key), encoding="unicode"))
        if read() == before:
            unsaid.append(("/".join(str(item.tag) for item in place), key))
    path.write_text(text)
    return unsaid, len(tried)


@pytest.mark.parametrize(
    ("name", "text"),
    [("rich.urdf", rich_files.URDF), ("rich.sdf", rich_files.SDF), ("rich.xml", rich_files.MJCF)],
)
def test_every_part_of_a_model_is_used_or_named(name, text, tmp_path):
    if name.endswith("xml"):
        pytest.importorskip("mujoco")
    path = foreign_files.saved(name, text)(tmp_path)
    unsaid, count = unsaid_parts(path, lambda: told(path), HIDDEN[name])
    assert count > 8
    assert unsaid == []


def test_every_part_of_a_tree_of_caspr_is_used_or_named(tmp_path):
    files, total = pair(two_link(), tmp_path), 0
    for path in files:
        unsaid, count = unsaid_parts(path, lambda: told_tree(files[0]), HIDDEN["caspr"])
        assert unsaid == []
        total += count
    assert total > 30


def test_the_comparison_sees_what_is_unsaid(tmp_path, monkeypatch):
    """A check that could not fail would be none."""
    path = foreign_files.saved("rich.urdf", rich_files.URDF)(tmp_path)
    monkeypatch.setattr(named_frames, "not_kept", lambda *_: [])
    before, root = told(path), ET.fromstring(rich_files.URDF)
    place = [root, root.find("gazebo")]
    path.write_text(ET.tostring(without(root, place, "reference"), encoding="unicode"))
    assert told(path) == before
    assert not is_named(place, "reference", before[1])


@pytest.mark.parametrize("kind", ["wirex", "caspr", "cables of caspr", "tree", "cables of a tree"])
def test_elements_that_no_reader_knows_are_named(kind, tmp_path):
    """Wherever they stand, with an attribute."""
    if kind.endswith("tree"):
        bodies, cables = pair(two_link(), tmp_path)
    elif kind == "wirex":
        bodies = foreign_files.wirex(tmp_path)
    else:
        bodies = foreign_files.caspr(tmp_path)
        cables = tmp_path / "toy_cables.xml"
    path = cables if kind.startswith("cables") else bodies
    read = told_tree if kind.endswith("tree") else told
    head, root = document(path)
    parents = {child: parent for parent in root.iter() for child in parent}
    for number, item in enumerate(root.iter()):
        place = [item]
        while place[0] in parents:
            place.insert(0, parents[place[0]])
        changed = copy.deepcopy(root)
        ET.SubElement(list(changed.iter())[number], "oddity", value="3")
        path.write_text(head + ET.tostring(changed, encoding="unicode"))
        words, remarks = read(bodies)
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
    assert "platform.color" in gazebo_yaml._PRESENTATION


def test_keys_that_no_reader_knows_are_named_of_grab(tmp_path):
    path = foreign_files.grab_on_board(tmp_path)
    for changed in odd_mappings(json.loads(path.read_text())):
        path.write_text(json.dumps(changed))
        assert "oddity" in " ".join(told(path)[1]), changed


def test_what_included_files_hold_is_used_or_named_too(tmp_path, monkeypatch):
    """By a file, by a folder with a model.config, and by a file that includes one."""
    start = '<sdf version="1.9">'
    model = rich_files.SDF[rich_files.SDF.index('<model name="rich">') :].replace("</world>", "")
    inner = foreign_files.saved("inner.sdf", start + model)(tmp_path)
    config = f"<model><name>rich</name>{start}inner.sdf</sdf></model>"
    (tmp_path / "model.config").write_text(config)

    def including(name, uri):
        text = f"<include><uri>file://{uri}</uri><name>inside</name></include>"
        model = f'{start}<model name="{name}">{text}</model></sdf>'
        return foreign_files.saved(f"{name}.sdf", model)(tmp_path)

    def parts(words):
        """What is not kept, without the elements round it."""
        return sorted(re.findall(r"link/[a-z/@]+ of [a-z]+|plugin of [a-z]+", " ".join(words)))

    _, own = told(inner)
    assert len(parts(own)) == 5
    by_file = including("file", inner)
    deep = including("deep", by_file)
    for path in (by_file, including("folder", tmp_path), deep):
        _, remarks = told(path)
        assert parts(remarks) == parts(own)
        assert "name" not in remarks[-1]
    monkeypatch.setattr(named_frames, "_MOST_INCLUDES", 1)
    _, remarks = told(deep)
    assert remarks[-1].startswith("Of these included files only bodies, joints and frames were")
    assert remarks[-1].endswith(f"is not named: file://{inner}.")

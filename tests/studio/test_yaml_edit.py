"""One value changes, all else in the text stays: comments, order, layout."""

import pytest
import yaml

from cdpr_drake.models.robot_loader import robot_names, robot_text
from cdpr_drake.studio.document import flow, with_item, with_value, without_item

TEXT = """\
# a robot
name: toy  # its name
platform:
  mass: 3.5
  size: [0.1, 0.2, 0.3]
frame: {lower: [0, 0, 0], beam: 0.04}
home:
  position:
    - 0.0
    - 1.0
cables:
  - {name: C1, exit_point: [1.0, 2.0, 3.0]}
  - name: C2  # the second
    exit_point: [4.0, 5.0, 6.0]
assumptions: >-
  Many words
  on two lines.
# the end
"""


@pytest.mark.parametrize(
    ("path", "value", "line"),
    [
        (("platform", "mass"), 4.25, "  mass: 4.25"),
        (("platform", "size", 1), 1e-6, "  size: [0.1, 1.0e-06, 0.3]"),
        (("frame", "beam"), None, "frame: {lower: [0, 0, 0], beam: null}"),
        (("frame", "upper"), [1.0, 1.0, 1.0], "[0, 0, 0], beam: 0.04, upper: [1.0, 1.0, 1.0]}"),
        (("cables", 0, "exit_point"), [7.0, 8.0, 9.0], "{name: C1, exit_point: [7.0, 8.0, 9.0]}"),
        (("cables", 1, "winch"), "W1", "    winch: W1"),
        (("home", "position"), [2.0, 3.0], "  position: [2.0, 3.0]"),
        (("assumptions",), "None: at all", 'assumptions: "None: at all"'),
        (("name",), "other", "name: other  # its name"),
        (("platform", "box"), 0.1, "\n  mass: 3.5\n  box: 0.1\n  size: [0.1,"),
        (("winch", "loops", "bandwidth"), 3.0, "winch: {loops: {bandwidth: 3.0}}"),
    ],
)
def test_a_value_changes_where_it_stands(path, value, line):
    new = with_value(TEXT, path, value, ("mass", "box", "size"))  # the order of the schema
    assert line in new
    meant = place = yaml.safe_load(TEXT)
    for key in path[:-1]:
        place = place.setdefault(key, {}) if isinstance(place, dict) else place[key]
    place[path[-1]] = value
    assert yaml.safe_load(new) == meant
    assert all(words in new for words in ("# a robot", "# its name", "# the second", "# the end"))


def test_items_come_and_go():
    more = with_item(TEXT, ("cables",), {"name": "C3", "exit_point": [1.5, 2.0, 3.0]})
    assert "\n  - {name: C3, exit_point: [1.5, 2.0, 3.0]}\nassumptions" in more
    assert without_item(more, ("cables", 2)) == TEXT
    (cable,) = yaml.safe_load(without_item(TEXT, ("cables", 0)))["cables"]
    assert cable["name"] == "C2"
    new = with_item(TEXT, ("cameras",), {"name": "one"})
    assert yaml.safe_load(new)["cameras"] == [{"name": "one"}]


def test_what_cannot_be_edited_in_place_is_written_anew():
    new = with_value("a: &x {b: 1}\nc: *x\n", ("c", "b"), 2)
    assert yaml.safe_load(new) == {"a": {"b": 2}, "c": {"b": 2}}


@pytest.mark.parametrize("name", robot_names())
def test_every_robot_of_the_package_keeps_its_text(name):
    text = robot_text(name)
    data = yaml.safe_load(text)
    new = with_value(text, ("platform", "mass"), 1.25)
    data["platform"]["mass"] = 1.25
    assert yaml.safe_load(new) == data
    assert sum(a != b for a, b in zip(text.splitlines(), new.splitlines(), strict=True)) <= 1


@pytest.mark.parametrize(
    "value", [0.1, -1e300, 1e-7, 3, True, None, "yes", "1.0", "a: b", "ü", "", "x#y", "'", "é\n"]
)
def test_values_in_one_line_mean_what_they_were(value):
    assert yaml.safe_load(flow(value)) == value
    assert "\n" not in flow(value)

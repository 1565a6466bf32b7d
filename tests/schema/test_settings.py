"""Settings: what their fields accept, in words and in files, and what `help` has of them."""

import inspect
import math
import pickle
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.errors import MOST_PROBLEMS, DataFileError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema import typed_yaml
from cdpr_drake.schema.declarations import (
    In,
    Name,
    OneOf,
    Switch,
    Text,
    filled,
    settings,
    settings_of,
    values,
)
from cdpr_drake.schema.typed_yaml import dump_typed, parse_typed, refuse
from cdpr_drake.systems.robots.settings import DampingSettings
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.sensor_settings import SensorSuite


@settings
class Spring:
    """A spring.

    It is straight.
    """

    stiffness: Annotated[float, In("N/m", gt=0.0), "How stiff."] = 1.0
    kind: Annotated[str, OneOf(("soft", "hard")), "Which."] = "soft"


@settings
class Suspension(Spring):
    kind: Annotated[str, OneOf(("hard",)), "Which it is now."] = "hard"
    inner: Annotated[Spring, "Another one."] = filled(Spring)


@settings
class Rod:
    length: Annotated[float, In("m"), "Length."] = 1.0

    def refusals(self, scope):
        if self.length < 0.0:
            yield "length", self.length, "at least 0"
        math.log(self.length)


@settings
class Truss:
    rods: Annotated[list[Rod], "Rods."] = filled(list)
    height: Annotated[float, In("m"), "Height."] = 1.0

    def refusals(self, scope):
        if self.height > 5.0:
            yield "height", self.height, "at most 5"
        [math.sqrt(rod.length) for rod in self.rods]


@settings
class Machine:
    """One field of each kind."""

    mass: Annotated[float, In("kg", gt=0.0), "Mass."]
    share: Annotated[float, In("-", ge=0.0, le=1.0), "Share."] = 0.5
    limit: Annotated[float | None, In("N", lt=5.0), "Limit."] = None
    count: Annotated[int, In(ge=1), "Count."] = 3
    point: Annotated[np.ndarray, In("m", 3), "Point."] = values(0.0, 1.0, 2.0)
    table: Annotated[np.ndarray | None, In("m", None, 2), "Table."] = None
    name: Annotated[Text | None, "Name."] = None
    file: Annotated[Name, "File."] = "a"
    kinds: Annotated[list[str], OneOf(("a", "b")), "Kinds."] = filled(list)
    on_board: Annotated[Switch, "On board."] = True
    needed: Annotated[Spring, "Needed."]
    absent: Annotated[Spring | None, "Absent."] = None
    parts: Annotated[list[Spring], "Parts."] = filled(list)
    joints: Annotated[dict[str, np.ndarray], In("rad", None, single=True), "Joints."] = filled(dict)
    packages: Annotated[dict[str, Text], "Packages."] = filled(dict)
    springs: Annotated[dict[str, Spring], "Springs."] = filled(dict)


WORDS = {
    "mass": "a number > 0 [kg]",
    "share": "a number >= 0 and <= 1 [-]",
    "limit": "a number < 5 [N] or null",
    "count": "a whole number >= 1",
    "point": "3 numbers [m]",
    "table": "n x 2 numbers [m] or null",
    "name": "text or null",
    "file": "1 to 64 letters, digits, _ . -, the first one no dot",
    "kinds": "a list of a, b",
    "on_board": "true or false",
    "needed": "a mapping",
    "absent": "a mapping or null",
    "parts": "a list of mappings",
    "joints": "a mapping from names to numbers",
    "packages": "a mapping from names to texts",
    "springs": "a mapping from names to mappings",
}


def read(text, schema=Machine, base="mass: 1\nneeded: {}\n"):
    return parse_typed(schema, base + text, Path("m.yaml"))


def refusal(text, **more):
    with pytest.raises(DataFileError) as caught:
        read(text, **more)
    return str(caught.value)


def test_accepted_values_in_words():
    assert {name: one.accepts() for name, one in settings_of(Machine).items()} == WORDS


def test_help_has_words_units_and_ranges_of_all_fields():
    assert Spring.__doc__ == (
        "A spring.\n\nIt is straight.\n\nAttributes:\n"
        "    stiffness: How stiff. Accepted: a number > 0 [N/m].\n"
        "    kind: Which. Accepted: one of soft, hard."
    )
    assert Suspension.__doc__ == (
        "Suspension.\n\nAttributes:\n"
        "    stiffness: How stiff. Accepted: a number > 0 [N/m].\n"
        "    kind: Which it is now. Accepted: one of hard.\n"
        "    inner: Another one. Accepted: a mapping."
    )
    ending = settings_of(
        settings(type("S", (), {"__annotations__": {"x": Annotated[str, OneOf(["e.g."]), "X."]}}))
    )["x"]
    assert ending.help() == "X. Accepted: one of e.g."


def test_help_begins_with_plain_types_and_defaults():
    assert str(inspect.signature(Machine)) == (
        "(*, mass: float, share: float = 0.5, limit: float | None = None, count: int = 3, "
        "point: numpy.ndarray = array([0., 1., 2.]), table: numpy.ndarray | None = None, "
        "name: str | None = None, file: str = 'a', kinds: list[str] = [], on_board: bool = True, "
        f"needed: {__name__}.Spring, absent: {__name__}.Spring | None = None, "
        f"parts: list[{__name__}.Spring] = [], joints: dict[str, numpy.ndarray] = {{}}, "
        f"packages: dict[str, str] = {{}}, springs: dict[str, {__name__}.Spring] = {{}})"
    )
    assert "inner: tests.schema.test_settings.Spring = Ellipsis" in str(
        inspect.signature(Suspension.__init__)
    )
    again = pickle.loads(pickle.dumps(replace(Suspension(), stiffness=2.0)))
    assert again == Suspension(stiffness=2.0)


@pytest.mark.parametrize("schema", [Robot, Scenario, TensionScenario, SensorSuite, DampingSettings])
def test_no_field_of_a_schema_is_without_words(schema):
    for field in fields(schema):
        doc = settings_of(schema)[field.name].doc
        assert doc.endswith(".")
        assert f"    {field.name}: {doc} Accepted: " in schema.__doc__


def test_what_a_file_leaves_out_has_its_default_and_is_shared_by_none():
    with pytest.raises(TypeError, match="mass"):
        Machine()
    one, other = read(""), read("")
    one.point[0], one.needed.stiffness = 9.0, 9.0
    one.parts.append(Spring())
    assert (other.share, other.limit, other.count, other.on_board) == (0.5, None, 3, True)
    assert (other.point.tolist(), other.needed, other.parts) == ([0.0, 1.0, 2.0], Spring(), [])


ALL = """\
limit: -1e3
count: 1e1
point: [010, 1, -2.5e-1]
table: [[1, 2], [3, 4], [5, 6]]
name: 12
file: on
kinds: [b, a]
on_board: off
absent: {kind: hard}
parts: [{stiffness: 2}, {}]
joints: {a: 1, b: [2, 3]}
packages: {one: 1e3}
springs: {first: {stiffness: 4}}
"""


def test_each_kind_is_read_and_written():
    made = read(ALL)
    assert (made.limit, made.count, made.name, made.file) == (-1000.0, 10, "12", "on")
    assert made.point.tolist() == [10.0, 1.0, -0.25]
    assert made.table.tolist() == [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]
    assert (made.kinds, made.on_board, made.absent) == (["b", "a"], False, Spring(kind="hard"))
    assert made.parts == [Spring(stiffness=2.0), Spring()]
    assert {name: row.tolist() for name, row in made.joints.items()} == {"a": [1.0], "b": [2, 3]}
    assert (made.packages, made.springs) == ({"one": "1e3"}, {"first": Spring(stiffness=4.0)})
    again = parse_typed(Machine, dump_typed(made), Path("again.yaml"))
    assert dump_typed(again) == dump_typed(made)
    assert type(made.name) is type(made.packages["one"]) is str


def test_an_exception_of_a_section_is_passed_over_if_it_or_a_section_within_is_refused():
    with pytest.raises(DataFileError) as caught:  # the truss raises before its rod is asked
        refuse(Truss(rods=[Rod(), Rod(length=-1.0)]))
    assert caught.value.problems == ("rods[1].length: found -1.0; accepted: at least 0",)


@pytest.mark.parametrize("height", [1.0, 6.0])
def test_an_exception_of_a_section_is_raised_whatever_another_one_is_refused_for(height):
    with pytest.raises(ValueError, match="math domain error"):
        refuse(Truss(rods=[Rod(length=0.0)], height=height))


WRONG = {
    "share: 1:30": "3: share: found 1:30; accepted: a number >= 0 and <= 1 [-]",
    "count: 2.5": "3: count: found 2.5; accepted: a whole number >= 1",
    "point: [1, 2]": "3: point: found [1, 2]; accepted: 3 numbers [m]",
    "point: [1 2, 3]": "3: point: found [1 2, 3]; accepted: 3 numbers [m]",
    "point: [1, x, 2]": "3: point[1]: found x; accepted: 3 numbers [m]",
    "table: []": "3: table: found []; accepted: n x 2 numbers [m] or null",
    "table: [[1, 2], 3]": "3: table[1]: found 3; accepted: n x 2 numbers [m] or null",
    "kinds: [c]": "3: kinds[0]: found c; accepted: one of a, b",
    "kinds: a": "3: kinds: found a; accepted: a list of a, b",
    "on_board: 1": "3: on_board: found 1; accepted: true or false",
    "on_board: !!bool maybe": "3: on_board: found maybe; accepted: true or false",
    "share: null": "3: share: found null; accepted: a number >= 0 and <= 1 [-]",
    "share: !!foo 1": "3: share: found the tag !!foo; accepted: a value without one",
    "file: ../a": f"3: file: found ../a; accepted: {WORDS['file']}",
    'name: "\\a"': "3: name: found '\\x07'; accepted: no control characters or null",
    "parts: [1]": "3: parts[0]: found 1; accepted: a mapping",
    "parts: [{kind: sift}]": "3: parts[0].kind: found sift; did you mean soft? accepted: one of "
    "soft, hard",
    "joints: {a: [x]}": "3: joints.a[0]: found x; accepted: n numbers [rad]",
    "packages: {a: [1]}": "3: packages.a: found [1]; accepted: text",
    "springs: {a: {stiffnes: 1}}": "3: springs.a.stiffnes: unknown key; did you mean stiffness? "
    "known: stiffness, kind",
    "absent: {kind: soft, kind: hard}": "3: absent.kind: found twice; accepted: once",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_not_accepted_is_said_with_line_key_and_range(text):
    assert refusal(text) == f"m.yaml:{WRONG[text]}"


def test_of_many_wrong_keys_no_more_are_compared_than_are_said(monkeypatch):
    """A file of 25,000 keys that nobody knows took minutes."""
    names, compare = [], typed_yaml.meant_names
    monkeypatch.setattr(
        typed_yaml, "meant_names", lambda name, known: names.append(name) or compare(name, known)
    )
    lines = refusal("".join(f"k{k}: 1\n" for k in range(2000))).splitlines()
    assert len(lines) == MOST_PROBLEMS + 1
    assert len(names) <= 3 * MOST_PROBLEMS


def test_numbers_of_a_size_without_sense_are_refused():
    """They once overflowed far inside, with warnings of NumPy, or divided by zero."""
    words = ", 0 or of a size from 1e-100 to 1e+30"
    for text in ("1e31", "-1e300", "5e-324", "-1e-101"):
        assert words in refusal(f"limit: {text}")
        assert "found" in refusal(f"point: [0, 0, {text}]")
    for text in ("nan", ".inf", "-.inf", "heavy"):
        assert words not in refusal(f"limit: {text}")
    for number in (-1e30, 1e-100, 0.0, -0.0):
        assert read(f"limit: {number}").limit == number
    assert "a number" in refusal(f"limit: {math.nan}")


SENSIBLE = st.floats(-1e6, 1e6, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-99)


@given(SENSIBLE, SENSIBLE)
def test_bounds_are_open_or_closed_as_named(value, bound):
    for sign, holds in {"gt": value > bound, "ge": value >= bound, "lt": value < bound,
                        "le": value <= bound}.items():  # fmt: skip
        for at, accepted in ((value, holds), (bound, sign in ("ge", "le"))):
            schema = settings(
                type("S", (), {"__annotations__": {"x": Annotated[float, In("", **{sign: bound})]}})
            )
            try:
                read(f"x: {at!r}", schema=schema, base="")
            except DataFileError:
                assert not accepted
            else:
                assert accepted

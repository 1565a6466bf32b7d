"""Settings: what their fields accept, in words, what `help` has of them, what sections refuse."""

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

from cdpr_drake.errors import DataFileError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import In, OneOf, filled, settings, settings_of
from cdpr_drake.schema.typed_yaml import parse_typed, refuse
from cdpr_drake.systems.robots.settings import DampingSettings
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.sensor_settings import SensorSuite
from tests.schema.yaml_machine import Drum, Machine


@settings
class Brake(Drum):
    turns: Annotated[int, In(ge=2), "Turns it needs."] = 2
    inner: Annotated[Drum, "Another one."] = filled(Drum)


def of_one_field(hint):
    return settings(type("S", (), {"__annotations__": {"x": hint}}))


def test_accepted_values_in_words():
    assert {name: one.accepts() for name, one in settings_of(Machine).items()} == {
        "name": "text",
        "mass": "a number > 0 [kg]",
        "share": "a number >= 0 and <= 1 [-]",
        "torque": "a number [N m] or null",
        "size": "3 numbers > 0 [m]",
        "table": "n x 2 numbers [m]",
        "axis": "3 numbers, not all zero [-] or null",
        "kind": "one of small, large",
        "kinds": "a list of a, b",
        "title": "text or null",
        "file": "1 to 64 letters, digits, _ . -, the first one no dot",
        "enabled": "true or false",
        "joints": "a mapping from names to numbers",
        "packages": "a mapping from names to texts",
        "drums": "a mapping from names to mappings",
        "drum": "a mapping",
        "brake": "a mapping or null",
        "parts": "a list of mappings",
    }


def test_help_has_words_units_and_ranges_of_all_fields():
    radius = "    radius: Radius. Accepted: a number > 0 [m].\n"
    assert Drum.__doc__ == (
        f"A section that has defaults.\n\nIt is round.\n\nAttributes:\n{radius}"
        "    turns: Turns. Accepted: a whole number >= 1."
    )
    assert Brake.__doc__ == (
        f"Brake.\n\nAttributes:\n{radius}"
        "    turns: Turns it needs. Accepted: a whole number >= 2.\n"
        "    inner: Another one. Accepted: a mapping."
    )
    stop = of_one_field(Annotated[str, OneOf(["e.g."]), "X."])
    assert settings_of(stop)["x"].help() == "X. Accepted: one of e.g."


def test_help_begins_with_plain_types_and_defaults():
    drum = f"{Drum.__module__}.Drum"
    assert str(inspect.signature(Machine)) == (
        "(*, name: str, mass: float, share: float = 0.5, torque: float | None = None, "
        "size: numpy.ndarray = array([1., 1., 1.]), table: numpy.ndarray = array([[0., 0.]]), "
        "axis: numpy.ndarray | None = None, kind: str = 'small', kinds: list[str] = [], "
        "title: str | None = None, file: str = 'a', enabled: bool = False, "
        "joints: dict[str, numpy.ndarray] = {}, packages: dict[str, str] = {}, "
        f"drums: dict[str, {drum}] = {{}}, drum: {drum} = Ellipsis, brake: {drum} | None = None, "
        f"parts: list[{Drum.__module__}.Part] = [])"
    )
    brake = replace(Brake(), radius=2.0)
    assert pickle.loads(pickle.dumps(brake)) == brake == Brake(radius=2.0)


@pytest.mark.parametrize("schema", [Robot, Scenario, TensionScenario, SensorSuite, DampingSettings])
def test_no_field_of_a_schema_is_without_words(schema):
    for field in fields(schema):
        doc = settings_of(schema)[field.name].doc
        assert doc.endswith(".")
        assert f"    {field.name}: {doc} Accepted: " in schema.__doc__


def test_defaults_are_shared_by_none():
    with pytest.raises(TypeError, match="mass"):
        Machine(name="one")
    one, other = Machine(name="one", mass=1.0), Machine(name="other", mass=1.0)
    one.size[0], one.drum.radius = 9.0, 9.0
    one.parts.append(1)
    assert (other.size.tolist(), other.drum, other.parts) == ([1.0, 1.0, 1.0], Drum(), [])


@settings
class Rod:
    length: Annotated[float, In("m"), "Length."] = 1.0

    def refusals(self, scope):
        if -5.0 < self.length < 0.0:
            yield "length", self.length, "at least 0"
        if self.length < -5.0:
            raise DataFileError("rod.yaml: names no rod")
        math.log(self.length)


@settings
class Truss:
    rods: Annotated[list[Rod], "Rods."] = filled(list)
    height: Annotated[float, In("m"), "Height."] = 1.0

    def refusals(self, scope):
        if self.height > 5.0:
            yield "height", self.height, "at most 5"
        [math.sqrt(rod.length) for rod in self.rods]


def test_an_exception_of_a_section_is_passed_over_if_it_or_a_section_within_is_refused():
    for length, words in ((-1.0, "rods[1].length: found -1.0; accepted: at least 0"),
                          (-9.0, "rod.yaml: names no rod")):  # fmt: skip
        with pytest.raises(DataFileError) as caught:  # the truss raises before its rod is asked
            refuse(Truss(rods=[Rod(), Rod(length=length)]))
        assert caught.value.problems == (words,)


@pytest.mark.parametrize("height", [1.0, 6.0])
def test_an_exception_of_a_section_is_raised_whatever_another_one_is_refused_for(height):
    with pytest.raises(ValueError, match="math domain error"):
        refuse(Truss(rods=[Rod(length=0.0)], height=height))


SENSIBLE = st.floats(-1e6, 1e6, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-99)


@given(SENSIBLE, SENSIBLE)
def test_bounds_are_open_or_closed_as_named(value, bound):
    for sign, holds in {"gt": value > bound, "ge": value >= bound, "lt": value < bound,
                        "le": value <= bound}.items():  # fmt: skip
        for at, accepted in ((value, holds), (bound, sign in ("ge", "le"))):
            schema = of_one_field(Annotated[float, In("", **{sign: bound})])
            try:
                parse_typed(schema, f"x: {at!r}", Path("m.yaml"))
            except DataFileError:
                assert not accepted
            else:
                assert accepted


def test_numbers_of_a_size_without_sense_are_refused():
    """They once overflowed far inside, with warnings of NumPy, or divided by zero."""
    schema = of_one_field(Annotated[float, In("")])
    more = of_one_field(Annotated[np.ndarray, In("", 2)])
    words = "x: found .*, 0 or of a size from 1e-100 to 1e\\+30"
    for text in ("1e31", "-1e300", "5e-324", "-1e-101"):
        with pytest.raises(DataFileError, match=words):
            parse_typed(schema, f"x: {text}", Path("m.yaml"))
        with pytest.raises(DataFileError, match=r"x\[1\]: found"):
            parse_typed(more, f"x: [0, {text}]", Path("m.yaml"))
    for text in ("nan", ".inf", "-.inf", "heavy"):
        with pytest.raises(DataFileError, match=r"accepted: a number$"):
            parse_typed(schema, f"x: {text}", Path("m.yaml"))
    for number in (-1e30, 1e-100, 0.0, -0.0):
        assert parse_typed(schema, f"x: {number}", Path("m.yaml")).x == number

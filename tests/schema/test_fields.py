"""What schema fields accept, in words and in numbers."""

# Annotations are not postponed here: Drake's YAML loader reads them.

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import pytest
from cdpr_drake.schema.fields import (
    FieldRule,
    array,
    number,
    optional_section,
    section,
    sections,
    switch,
    text,
    whole,
)
from hypothesis import given
from hypothesis import strategies as st


@dataclass(kw_only=True)
class Inner:
    """A nested section."""

    size: float = number("Size.", "m", 1.0, above=0.0)


@dataclass(kw_only=True)
class Schema:
    """One field of each kind."""

    mass: float = number("Mass.", "kg", above=0.0)
    share: float = number("Share.", "-", 0.5, at_least=0.0, at_most=1.0)
    limit: float | None = number("Limit.", "N", None, below=5.0)
    count: int = whole("Count.", 3, at_least=1)
    polls: int = whole("Polls.", unit="1/s")
    point: np.ndarray = array("Point.", "m", (3,))
    shift: np.ndarray = array("Shift.", "m", (3,), (0.0, 1.0, 2.0))
    table: np.ndarray = array("Table.", "m", (None, 2), ((1.0, 2.0),))
    name: str = text("Name.")
    kind: str = text("Kind.", "a", choices=("a", "b"))
    on_board: bool = switch("On board.", True)
    needed: Inner = section("Needed.", Inner)
    spare: Inner = section("Spare.", Inner, required=False)
    absent: Inner | None = optional_section("Absent.")
    parts: list[Inner] = sections("Parts.")
    extras: list[Inner] = sections("Extras.", required=False)


RULES = {f.name: f.metadata["rule"] for f in dataclasses.fields(Schema)}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("mass", "a number > 0 [kg]"),
        ("share", "a number >= 0 and <= 1 [-]"),
        ("limit", "a number < 5 [N] or null"),
        ("count", "a whole number >= 1"),
        ("polls", "a whole number [1/s]"),
        ("point", "3 numbers [m]"),
        ("table", "n x 2 numbers [m]"),
        ("name", "text"),
        ("kind", "one of a, b"),
        ("on_board", "true or false"),
        ("needed", "a mapping"),
        ("absent", "a mapping or null"),
        ("parts", "a list of mappings"),
    ],
)
def test_accepted_values_in_words(name, words):
    assert RULES[name].accepts() == words


def test_a_field_without_default_must_be_given():
    required = {name for name, rule in RULES.items() if rule.required}
    assert required == {"mass", "polls", "point", "name", "needed", "parts"}


def test_a_field_with_default_none_may_be_null():
    assert {name for name, rule in RULES.items() if rule.nullable} == {"limit", "absent"}


def test_every_field_carries_its_documentation():
    assert RULES["mass"].doc == "Mass."
    assert all(rule.doc.endswith(".") for rule in RULES.values())


def test_defaults_are_those_that_were_named():
    made = Schema()
    assert (made.share, made.limit, made.count, made.kind) == (0.5, None, 3, "a")
    assert made.on_board is True
    assert made.absent is None
    assert made.extras == []
    assert made.spare == Inner(size=1.0)
    np.testing.assert_array_equal(made.shift, [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(made.table, [[1.0, 2.0]])


def test_placeholders_of_required_fields_are_no_plausible_values():
    """Drake's loader needs defaults; these show, should they ever get past the checks."""
    made = Schema()
    assert math.isnan(made.mass)
    assert np.all(np.isnan(made.point))
    assert made.point.shape == (3,)
    assert made.polls == -1
    assert made.name == ""
    assert made.parts == []


def test_instances_do_not_share_their_defaults():
    one, other = Schema(), Schema()
    one.shift[0] = 9.0
    one.extras.append(Inner())
    one.spare.size = 9.0
    one.point[0] = 9.0
    assert other.shift[0] == 0.0
    assert other.extras == []
    assert other.spare.size == 1.0
    assert np.isnan(other.point[0])


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_are_never_in_range(value):
    assert not FieldRule("Any.", "number").in_range(value)


@pytest.mark.parametrize("kind", ["number", "whole", "array"])
def test_numbers_that_have_squares_or_cubes_without_sense_are_never_in_range(kind):
    """They once overflowed far inside, with warnings of NumPy, or divided by zero."""
    rule = FieldRule("Any.", kind)
    for value in (1e31, -1e300, 5e-324, -1e-101):
        assert not rule.in_range(value)
    for value in (1e30, -1e30, 1e-100, 0.0, -0.0):
        assert rule.in_range(value)


def test_a_size_without_sense_is_said_where_it_was_found():
    rule = FieldRule("Mass.", "number", unit="kg", above=0.0)
    words = "a number > 0 [kg], 0 or of a size from 1e-100 to 1e+30"
    assert rule.accepts("1e300") == rule.accepts("1e-320") == words
    for found in ("-1", "nan", ".inf", "heavy", ""):
        assert rule.accepts(found) == "a number > 0 [kg]"
    assert FieldRule("Name.", "text").accepts("1e300") == "text"


SENSIBLE = st.floats(-1e6, 1e6, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-99)


@given(SENSIBLE, SENSIBLE)
def test_bounds_are_open_or_closed_as_named(value, bound):
    assert FieldRule("x.", "number", above=bound).in_range(value) == (value > bound)
    assert FieldRule("x.", "number", at_least=bound).in_range(value) == (value >= bound)
    assert FieldRule("x.", "number", below=bound).in_range(value) == (value < bound)
    assert FieldRule("x.", "number", at_most=bound).in_range(value) == (value <= bound)


@given(SENSIBLE)
def test_a_number_on_its_bound_counts_only_where_the_bound_is_closed(bound):
    assert FieldRule("x.", "number", at_least=bound, at_most=bound).in_range(bound)
    assert not FieldRule("x.", "number", above=bound).in_range(bound)
    assert not FieldRule("x.", "number", below=bound).in_range(bound)

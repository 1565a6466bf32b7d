"""Overrides of single keys, and what they refuse."""

from functools import partial

import numpy as np
import pytest

from tests.schema.yaml_machine import GOOD, SMALL, Drum, load_machine, message_of


@pytest.fixture
def load(tmp_path):
    return partial(load_machine, tmp_path)


@pytest.mark.parametrize(
    ("item", "field", "value"),
    [
        ("mass=3", "mass", 3.0),
        ("mass = 3.5", "mass", 3.5),
        ("share=1.0", "share", 1.0),
        ("torque=0.5", "torque", 0.5),
        ("torque=null", "torque", None),
        ("torque=", "torque", None),
        ("kind=large", "kind", "large"),
        ("enabled=true", "enabled", True),
        ("name=a=b", "name", "a=b"),
        ("drum.turns=3", "drum", Drum(turns=3)),
        ("drum={turns: 3}", "drum", Drum(turns=3)),
        ("brake.turns=3", "brake", Drum(turns=3)),
    ],
)
def test_an_override_replaces_what_the_file_says_or_leaves_out(load, item, field, value):
    assert getattr(load(SMALL, item), field) == value


def test_an_override_goes_into_a_section_of_the_file(load):
    assert load(GOOD, "drum.turns=3").drum == Drum(radius=0.05, turns=3)
    assert load(GOOD, "brake.radius=1").brake == Drum(radius=1.0, turns=2)
    assert load(SMALL + "brake: null\n", "brake.turns=3").brake == Drum(turns=3)


def test_overrides_of_arrays(load):
    np.testing.assert_array_equal(load(SMALL, "size=[1, 2, 3]").size, [1.0, 2.0, 3.0])


def test_the_last_of_several_overrides_counts(load):
    machine = load(SMALL, "mass=3", "drum.turns=5", "drum.radius=1", "mass=4")
    assert machine.mass == 4.0
    assert machine.drum == Drum(radius=1.0, turns=5)


def test_an_override_can_give_a_missing_key(load):
    assert load("name: first\n", "mass=1").mass == 1.0


@pytest.mark.parametrize(
    ("item", "words"),
    [
        ("mass=-3", "overrides mass: found -3; accepted: a number > 0 [kg]"),
        ("mass=.nan", "overrides mass: found .nan; accepted: a number > 0 [kg]"),
        ("mass=", "overrides mass: found null; accepted: a number > 0 [kg]"),
        ("mass={a: [1]}", "overrides mass: found {a: [1]}; accepted: a number > 0 [kg]"),
        ("size=[1, -2, 3]", "overrides size: size[1]: found -2; accepted: 3 numbers > 0 [m]"),
        (
            "drum={turn: 1}",
            "overrides drum: drum.turn: unknown key; did you mean turns? known: radius, turns",
        ),
        ("parts=[{}]", "overrides parts: parts[0].label: missing; accepted: text"),
        ("size=[1, 2]", "overrides size: found [1, 2]; accepted: 3 numbers > 0 [m]"),
        ("drum.turns=0", "overrides drum.turns: found 0; accepted: a whole number >= 1"),
        ("drum=3", "overrides drum: found 3; accepted: a mapping"),
        ("mass", "overrides mass: accepted: key=value, as in seed=3"),
        ("=3", "overrides =3: accepted: key=value, as in seed=3"),
        ("", "overrides : accepted: key=value, as in seed=3"),
        ("mass=[", "overrides mass: found '[', which is not YAML"),
        ("mass=1\n---\n2", "overrides mass: found '1\\n---\\n2', which is not YAML"),
        ("mass.x=1", "overrides mass.x: mass has no keys of its own"),
        ("parts.label=1", "overrides parts.label: parts has no keys of its own"),
        (
            "drum.turn=1",
            "overrides drum.turn: there is no key turn in drum; did you mean turns? "
            "known: radius, turns",
        ),
    ],
)
def test_an_override_that_is_not_accepted_is_named(load, item, words):
    assert message_of(load, SMALL, item) == words


def test_an_unknown_key_in_an_override_comes_with_all_that_exist(load):
    words = message_of(load, SMALL, "maas=3")
    assert words.startswith(
        "overrides maas: there is no key maas in the scenario; did you mean mass? "
    )
    assert words.endswith("drum, brake, parts")


def test_an_override_does_not_hide_an_error_of_the_file(load):
    assert "machine.yaml:3: share: found 7" in message_of(load, SMALL + "share: 7\n", "mass=3")


@pytest.mark.parametrize("item", ["mass=!foo 3", "ma\ns=1", "size=&a [*a]", "ma\ns"])
def test_overrides_that_yaml_can_say_and_a_schema_cannot_take_are_refused(load, item):
    message_of(load, SMALL, item)

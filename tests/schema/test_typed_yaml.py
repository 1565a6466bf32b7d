"""Files that load: each kind of field, defaults, overrides; whatever a text says, one error."""

import tempfile
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cdpr_drake.errors import DataFileError
from cdpr_drake.schema.typed_yaml import closest, dump_typed, load_typed
from tests.schema.yaml_machine import GOOD, SMALL, Drum, Machine, Part, load_machine, message_of


@pytest.fixture
def load(tmp_path):
    return partial(load_machine, tmp_path)


def test_each_kind_is_read_and_written(load):
    machine = load(GOOD)
    np.testing.assert_equal(asdict(machine), {
        "name": "first", "mass": 2.5, "share": 1.0, "torque": 0.3, "size": [1.0, 2.0, 0.3],
        "table": [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]], "axis": [10.0, -0.25, 0.0], "kind": "large",
        "kinds": ["b", "a"], "title": "12", "file": "on", "enabled": True,
        "joints": {"a": [1.0], "b": [2.0, 3.0]}, "packages": {"one": "1e3"},
        "drums": {"first": {"radius": 0.04, "turns": 4}}, "drum": {"radius": 0.05, "turns": 10},
        "brake": {"radius": 0.04, "turns": 2},
        "parts": [{"label": "one", "at": [1, 2, 3]}, {"label": "two", "at": [0, 0, 0]}],
    })  # fmt: skip
    assert type(machine.title) is type(machine.packages["one"]) is str
    assert isinstance(machine.parts[0], Part)
    for each in (machine, load(SMALL)):
        assert dump_typed(load(dump_typed(each))) == dump_typed(each)
        assert "null" not in dump_typed(each)


def test_what_a_file_leaves_out_keeps_its_default_and_null_is_none(load):
    for machine in (load(SMALL), load(SMALL + "torque: null\nbrake: ~\n")):
        np.testing.assert_equal(asdict(machine), asdict(Machine(name="first", mass=2.5)))


def test_an_anchor_may_be_used_twice(load):
    machine = load(SMALL + "drum: &one {turns: 7}\nbrake: *one\n")
    assert machine.drum == machine.brake == Drum(turns=7)


names = st.from_regex(r"[a-z][a-z_]{3,11}", fullmatch=True).filter(
    lambda word: word not in ("true", "false", "null")
)
positive = st.floats(1e-6, 1e6)


@given(
    st.fixed_dictionaries(
        {"name": names, "mass": positive},
        optional={
            "share": st.just(0.0) | st.floats(1e-100, 1.0),
            "torque": st.none() | positive | positive.map(lambda x: -x),
            "size": st.lists(positive, min_size=3, max_size=3),
            "table": st.lists(st.lists(positive, min_size=2, max_size=2), min_size=1, max_size=4),
            "kind": st.sampled_from(["small", "large"]),
            "enabled": st.booleans(),
            "drum": st.fixed_dictionaries({}, optional={"turns": st.integers(1, 1000)}),
            "parts": st.lists(st.fixed_dictionaries({"label": names}), max_size=3),
        },
    ),
    st.sampled_from([None, True, False]),
)
def test_what_was_written_is_what_is_read(data, flow):
    with tempfile.TemporaryDirectory() as folder:
        machine = load_machine(Path(folder), yaml.safe_dump(data, default_flow_style=flow))
    drum, parts = Drum(**data.pop("drum", {})), [Part(**one) for one in data.pop("parts", [])]
    expected = Machine(**data, drum=drum, parts=parts)
    np.testing.assert_equal(asdict(machine), asdict(expected))


@pytest.mark.parametrize("written", ["5", "1.0", "0x1f", "yes", "2001-01-01", "2001-99-99", "="])
def test_a_text_is_what_is_written_whatever_yaml_takes_it_for(load, written):
    assert load(f"name: {written}\nmass: 1\n").name == written
    assert load(SMALL, f"name={written}").name == written


@pytest.mark.parametrize(
    ("written", "number"),
    [("1e3", 1000), ("2.0", 2), ("'2.0'", 2), ("010", 10), ("+7", 7)],
)
def test_numbers_are_read_as_they_were_checked(load, written, number):
    machine = load(SMALL + f"drum: {{turns: {written}}}\ntorque: {written}\n")
    assert (machine.drum.turns, machine.torque) == (number, number)


def test_closest_gives_the_likely_name_and_all():
    assert closest("hom", ["home", "goal"]) == "did you mean home? known: home, goal"
    assert closest("xyz", ["home", "goal"]) == "known: home, goal"


# Overrides of single keys.


@pytest.mark.parametrize(
    ("content", "item", "field", "value"),
    [
        ("name: first\n", "mass=3", "mass", 3.0),
        (SMALL, "mass = 3.5", "mass", 3.5),
        (GOOD, "torque=null", "torque", None),
        (GOOD, "torque=", "torque", None),
        (SMALL, "kind=large", "kind", "large"),
        (SMALL, "enabled=true", "enabled", True),
        (SMALL, "name=a=b", "name", "a=b"),
        (SMALL, "size=[1, 2, 3]", "size", np.array([1.0, 2.0, 3.0])),
        (SMALL, "drum.turns=3", "drum", Drum(turns=3)),
        (SMALL, "drum={turns: 3}", "drum", Drum(turns=3)),
        (SMALL, "brake.turns=3", "brake", Drum(turns=3)),
        (GOOD, "drum.turns=3", "drum", Drum(radius=0.05, turns=3)),
        (GOOD, "brake.radius=1", "brake", Drum(radius=1.0, turns=2)),
        (SMALL + "brake: null\n", "brake.turns=3", "brake", Drum(turns=3)),
    ],
)
def test_an_override_replaces_what_the_file_says_or_leaves_out(load, content, item, field, value):
    np.testing.assert_equal(getattr(load(content, item), field), value)


def test_the_last_of_several_overrides_counts(load):
    machine = load(SMALL, "mass=3", "drum.turns=5", "drum.radius=1", "mass=4")
    assert (machine.mass, machine.drum) == (4.0, Drum(radius=1.0, turns=5))


@pytest.mark.parametrize(
    ("item", "words"),
    [
        ("mass=-3", "overrides mass: found -3; accepted: a number > 0 [kg]"),
        ("mass=.nan", "overrides mass: found .nan; accepted: a number > 0 [kg]"),
        ("mass=", "overrides mass: found null; accepted: a number > 0 [kg]"),
        ("mass={a: [1]}", "overrides mass: found {a: [1]}; accepted: a number > 0 [kg]"),
        ("size=[1, -2, 3]", "overrides size: size[1]: found -2; accepted: 3 numbers > 0 [m]"),
        ("drum={turn: 1}", "overrides drum: drum.turn: unknown key; did you mean turns? known: "
         "radius, turns"),
        ("parts=[{}]", "overrides parts: parts[0].label: missing; accepted: text"),
        ("drum.turns=0", "overrides drum.turns: found 0; accepted: a whole number >= 1"),
        ("drum=3", "overrides drum: found 3; accepted: a mapping"),
        ("mass", "overrides mass: accepted: key=value, as in seed=3"),
        ("=3", "overrides =3: accepted: key=value, as in seed=3"),
        ("", "overrides : accepted: key=value, as in seed=3"),
        ("mass=[", "overrides mass: found '[', which is not YAML"),
        ("mass=1\n---\n2", "overrides mass: found '1\\n---\\n2', which is not YAML"),
        ("mass.x=1", "overrides mass.x: mass has no keys of its own"),
        ("parts.label=1", "overrides parts.label: parts has no keys of its own"),
        ("drum.turn=1", "overrides drum.turn: there is no key turn in drum; did you mean turns? "
         "known: radius, turns"),
        ("maas=3", "overrides maas: there is no key maas in the scenario; did you mean mass? "
         f"known: {', '.join(vars(Machine)['__dataclass_fields__'])}"),
    ],
)  # fmt: skip
def test_an_override_that_is_not_accepted_is_named(load, item, words):
    assert message_of(load, SMALL, item) == words


def test_an_override_does_not_hide_an_error_of_the_file(load):
    assert "machine.yaml:3: share: found 7" in message_of(load, SMALL + "share: 7\n", "mass=3")


@pytest.mark.parametrize("item", ["mass=!foo 3", "ma\ns=1", "size=&a [*a]", "ma\ns"])
def test_overrides_that_yaml_can_say_and_a_schema_cannot_take_are_refused(load, item):
    message_of(load, SMALL, item)


# Any text.


def only_the_error_class(content, *overrides):
    """Loads a text; any exception but the error class, which names its place, is let through."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.yaml"
        path.write_bytes(content.encode("utf-8", "surrogatepass"))
        problems = ()
        try:
            load_typed(Machine, path, overrides=overrides)
        except DataFileError as caught:
            problems = caught.problems
        for line in problems:
            assert line.startswith((str(path), "overrides "))
            assert len(line.splitlines()) == 1


# Scraps that mean something to YAML or to this schema, in any order.
PUNCTUATION = [*"[]{},:-?'\"#&*|>%@~ \n", "\n  ", "\n- ", ": ", "- ", "&a ", "*a"]
WORDS = ["null", "true", "1", "-1", ".inf", "1e3", "name: a", "mass: 2", "drum: ", "turns: "]
LISTS = ["parts: ", "size: ", "table: "]
TAGS = ["!", "!!", "!foo ", "!!str ", "!!int ", "!!null ", "<<: ", "\\n", "\x85"]
scraps = st.lists(st.sampled_from([*PUNCTUATION, *WORDS, *LISTS, *TAGS]), max_size=25).map("".join)
keys = st.sampled_from([*vars(Machine)["__dataclass_fields__"], "x"])


@settings(max_examples=300)
@given(st.text() | scraps | st.tuples(keys, st.text()).map(lambda two: SMALL + ": ".join(two)))
@example("\ufeffname: first")
@example("? [1, 2]\n: 3")
@example("? {a: 1}\n: 3")
@example("<<: {mass: 3}")
@example("%YAML 9.9\n---\nname: first")
def test_any_text_loads_or_raises_the_error_class(content):
    only_the_error_class(content)


@given(st.binary())
def test_any_bytes_raise_the_error_class(content):
    with tempfile.TemporaryDirectory() as folder, pytest.raises(DataFileError):
        load_machine(Path(folder), content)


@given(st.text())
def test_any_override_loads_or_raises_the_error_class(item):
    only_the_error_class(SMALL, item)

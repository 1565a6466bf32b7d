"""Files that load: each kind of field, defaults, what YAML would take for something else."""

import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.schema.typed_yaml import closest, load_typed
from tests.schema.yaml_machine import GOOD, SMALL, Drum, Machine, load_machine


@pytest.fixture
def load(tmp_path):
    return partial(load_machine, tmp_path)


def test_a_good_file_loads_as_it_is_written(load):
    machine = load(GOOD)
    assert (machine.name, machine.mass, machine.share, machine.torque) == ("first", 2.5, 1.0, 0.3)
    assert (machine.kind, machine.enabled) == ("large", True)
    np.testing.assert_array_equal(machine.size, [1.0, 2.0, 0.3])
    np.testing.assert_array_equal(machine.table, [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    assert machine.drum == Drum(radius=0.05, turns=4)
    assert machine.brake == Drum(radius=0.04, turns=2)
    assert [part.label for part in machine.parts] == ["one", "two"]
    np.testing.assert_array_equal(machine.parts[0].at, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(machine.parts[1].at, np.zeros(3))


def test_what_a_file_leaves_out_keeps_its_default(load):
    machine = load(SMALL)
    assert (machine.share, machine.torque, machine.kind) == (0.5, None, "small")
    assert (machine.enabled, machine.brake, machine.parts) == (False, None, [])
    assert machine.drum == Drum()


def test_null_is_none_where_it_may_be(load):
    machine = load(SMALL + "torque: null\nbrake: ~\n")
    assert machine.torque is None
    assert machine.brake is None


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
        path = Path(folder) / "machine.yaml"
        path.write_text(yaml.safe_dump(data, default_flow_style=flow))
        machine = load_typed(Machine, path)
    for key in ("name", "mass", "share", "torque", "kind", "enabled"):
        if key in data:
            assert getattr(machine, key) == data[key]
    for key in ("size", "table"):
        if key in data:
            np.testing.assert_array_equal(getattr(machine, key), data[key])
    assert machine.drum == Drum(**data.get("drum", {}))
    assert [part.label for part in machine.parts] == [p["label"] for p in data.get("parts", [])]


@pytest.mark.parametrize("written", ["5", "1.0", "0x1f", "yes", "2001-01-01", "2001-99-99", "="])
def test_a_text_is_what_is_written_whatever_yaml_takes_it_for(load, written):
    assert load(f"name: {written}\nmass: 1\n").name == written
    assert load(SMALL, f"name={written}").name == written


@pytest.mark.parametrize(
    ("written", "number"),
    [("1e3", 1000), ("2.0", 2), ("'2.0'", 2), ("010", 10), ("+7", 7)],
)
def test_numbers_are_read_as_they_were_checked(load, written, number):
    assert load(SMALL + f"drum: {{turns: {written}}}\n").drum.turns == number
    assert load(SMALL + f"torque: {written}\n").torque == number


def test_closest_gives_the_likely_name_and_all():
    assert closest("hom", ["home", "goal"]) == "did you mean home? known: home, goal"
    assert closest("xyz", ["home", "goal"]) == "known: home, goal"

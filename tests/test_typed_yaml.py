"""Error messages that name file, line, field, value and range; overrides; files that load."""

# Annotations are not postponed here: Drake's YAML loader reads them.

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from cdpr_drake.errors import DataFileError, RobotFileError
from cdpr_drake.fields import (
    array,
    number,
    optional_section,
    section,
    sections,
    switch,
    text,
    whole,
)
from cdpr_drake.typed_yaml import closest, load_typed


@dataclass(kw_only=True)
class Drum:
    """A nested section that has defaults."""

    radius: float = number("Radius.", "m", 0.04, above=0.0)
    turns: int = whole("Turns.", 10, at_least=1)


@dataclass(kw_only=True)
class Part:
    """An item of a list."""

    label: str = text("Label.")
    at: np.ndarray = array("Place.", "m", (3,), (0.0, 0.0, 0.0))


@dataclass(kw_only=True)
class Machine:
    """One field of each kind."""

    name: str = text("Name.")
    mass: float = number("Mass.", "kg", above=0.0)
    share: float = number("Share.", "-", 0.5, at_least=0.0, at_most=1.0)
    torque: float | None = number("Torque.", "N m", None)
    size: np.ndarray = array("Edges.", "m", (3,), (1.0, 1.0, 1.0), above=0.0)
    table: np.ndarray = array("Table.", "m", (None, 2), ((0.0, 0.0),))
    kind: str = text("Kind.", "small", choices=("small", "large"))
    enabled: bool = switch("Enabled.", False)
    drum: Drum = section("Drum.", Drum, required=False)
    brake: Drum | None = optional_section("Brake.")
    parts: list[Part] = sections("Parts.", required=False)


GOOD = """\
# A machine.
name: first
mass: 2.5
share: 1
torque: 3.0e-1
size: [1, 2.0, 3e-1]
table:
- [1, 2]
- [3, 4]
- [5, 6]
kind: large
enabled: true
drum: {radius: 0.05, turns: 4}
brake:
  turns: 2
parts:
- {label: one, at: [1, 2, 3]}
- label: two
"""
SMALL = "name: first\nmass: 2.5\n"


@pytest.fixture
def load(tmp_path):
    """Writes a text to machine.yaml and loads it."""

    def run(content, *overrides):
        path = tmp_path / "machine.yaml"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return load_typed(Machine, path, overrides=overrides)

    return run


def message_of(load, content, *overrides):
    with pytest.raises(DataFileError) as caught:
        load(content, *overrides)
    words = str(caught.value)
    assert len(words.splitlines()) == 1
    return words


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
            "share": st.floats(0.0, 1.0),
            "torque": st.none() | st.floats(-1e6, 1e6),
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


# Each line: what is added to the small file, and what the message says after file and line.
@pytest.mark.parametrize(
    ("line", "words"),
    [
        # Numbers.
        ("share: -0.1", "share: found -0.1; accepted: a number >= 0 and <= 1 [-]"),
        ("share: 1.5", "share: found 1.5; accepted: a number >= 0 and <= 1 [-]"),
        ("share: nan", "share: found nan; accepted: a number >= 0 and <= 1 [-]"),
        ("share: .nan", "share: found .nan; accepted: a number >= 0 and <= 1 [-]"),
        ("share: .inf", "share: found .inf; accepted: a number >= 0 and <= 1 [-]"),
        ("torque: -.inf", "torque: found -.inf; accepted: a number [N m] or null"),
        ("torque: 1e999", "torque: found 1e999; accepted: a number [N m] or null"),
        ("share: much", "share: found much; accepted: a number >= 0 and <= 1 [-]"),
        ("share: ''", "share: found nothing; accepted: a number >= 0 and <= 1 [-]"),
        ("share: true", "share: found true; accepted: a number >= 0 and <= 1 [-]"),
        ("share: [1]", "share: found [1]; accepted: a number >= 0 and <= 1 [-]"),
        ("share: {a: 1}", "share: found {a: 1}; accepted: a number >= 0 and <= 1 [-]"),
        ("share: null", "share: found null; accepted: a number >= 0 and <= 1 [-]"),
        ("share:", "share: found null; accepted: a number >= 0 and <= 1 [-]"),
        # Whole numbers, and fields of sections.
        ("drum: {turns: 2.5}", "drum.turns: found 2.5; accepted: a whole number >= 1"),
        ("drum: {turns: 0}", "drum.turns: found 0; accepted: a whole number >= 1"),
        ("drum: {radius: 0}", "drum.radius: found 0; accepted: a number > 0 [m]"),
        ("drum: 5", "drum: found 5; accepted: a mapping"),
        ("drum: [1, 2]", "drum: found [1, 2]; accepted: a mapping"),
        ("drum: null", "drum: found null; accepted: a mapping"),
        ("brake: {radius: -1}", "brake.radius: found -1; accepted: a number > 0 [m]"),
        # Arrays.
        ("size: [1, 2]", "size: found [1, 2]; accepted: 3 numbers > 0 [m]"),
        ("size: [1, 2, 3, 4]", "size: found [1, 2, 3, 4]; accepted: 3 numbers > 0 [m]"),
        ("size: 1", "size: found 1; accepted: 3 numbers > 0 [m]"),
        ("size: {x: 1}", "size: found {x: 1}; accepted: 3 numbers > 0 [m]"),
        ("size: [1, 2, -3]", "size[2]: found -3; accepted: 3 numbers > 0 [m]"),
        ("size: [1, .nan, 3]", "size[1]: found .nan; accepted: 3 numbers > 0 [m]"),
        ("size: [.inf, 2, 3]", "size[0]: found .inf; accepted: 3 numbers > 0 [m]"),
        ("size: [1, [2], 3]", "size[1]: found [2]; accepted: 3 numbers > 0 [m]"),
        ("size: [1, null, 3]", "size[1]: found null; accepted: 3 numbers > 0 [m]"),
        ("size: null", "size: found null; accepted: 3 numbers > 0 [m]"),
        ("table: [1, 2]", "table[0]: found 1; accepted: n x 2 numbers [m]"),
        ("table: [[1, 2], [3]]", "table[1]: found [3]; accepted: n x 2 numbers [m]"),
        ("table: [[1, 2], [3, x]]", "table[1][1]: found x; accepted: n x 2 numbers [m]"),
        # Texts and switches.
        ("kind: middle", "kind: found middle; accepted: one of small, large"),
        ("kind: null", "kind: found null; accepted: one of small, large"),
        ("enabled: maybe", "enabled: found maybe; accepted: true or false"),
        ("enabled: 1", "enabled: found 1; accepted: true or false"),
        ("enabled: null", "enabled: found null; accepted: true or false"),
        # Lists of sections.
        ("parts: {label: a}", "parts: found {label: a}; accepted: a list of mappings"),
        ("parts: [7]", "parts[0]: found 7; accepted: a mapping"),
        ("parts: [{label: a}, {}]", "parts[1].label: missing; accepted: text"),
        ("parts: [{label: [a]}]", "parts[0].label: found [a]; accepted: text"),
        ("parts: [{label: a, at: [1]}]", "parts[0].at: found [1]; accepted: 3 numbers [m]"),
        # Keys.
        ("mass: 3", "mass: found twice; accepted: once"),
        ("drum: {turns: 1, turns: 2}", "drum.turns: found twice; accepted: once"),
        ("drum: {turn: 1}", "drum.turn: unknown key; did you mean turns? known: radius, turns"),
        ("parts: [{name: a}]", "parts[0].name: unknown key; known: label, at"),
    ],
)
def test_a_value_that_is_not_accepted_is_named_with_file_line_field_and_range(
    load, tmp_path, line, words
):
    path = tmp_path / "machine.yaml"
    assert message_of(load, SMALL + line + "\n") == f"{path}:3: {words}"


def test_the_line_is_that_of_the_value(load):
    content = GOOD.replace("- [5, 6]", "- [5, six]")
    assert "machine.yaml:10: table[2][1]: found six" in message_of(load, content)
    content = GOOD.replace("turns: 2", "turns: -2")
    assert "machine.yaml:15: brake.turns: found -2" in message_of(load, content)


def test_a_negative_mass_is_refused(load):
    words = message_of(load, "name: first\nmass: -2.5\n")
    assert words.endswith("machine.yaml:2: mass: found -2.5; accepted: a number > 0 [kg]")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("name: first\n", ":1: mass: missing; accepted: a number > 0 [kg]"),
        ("mass: 2.5\n", ":1: name: missing; accepted: text"),
        ("{}", ":1: name: missing; accepted: text"),
    ],
)
def test_a_missing_key_is_named_with_what_it_accepts(load, content, words):
    assert message_of(load, content).endswith("machine.yaml" + words)


def test_an_unknown_key_comes_with_the_likely_one_and_all_that_exist(load):
    words = message_of(load, SMALL + "maas: 3\n")
    assert "machine.yaml:3: maas: unknown key; did you mean mass? known: name, mass, sh" in words
    assert words.endswith("drum, brake, parts")


@pytest.mark.parametrize("content", ["", "# nothing\n", "5\n", "[1, 2]\n", "text", "---\n...\n"])
def test_a_file_without_keys_is_refused(load, content):
    words = message_of(load, content)
    assert "found no mapping at the top; accepted: the keys of a Machine" in words


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("name: [first\nmass: 2\n", 2),
        ("name: first\n\tmass: 2\n", 2),
        ("name: first\nmass: 2\n  share: 1\n", 3),
        ("name: 'first\nmass: 2\n", 3),
        ("name: first\nmass: *nowhere\n", 2),
        ("name: first\n---\nmass: 2\n", 2),
        ("name: @first\n", 1),
    ],
)
def test_malformed_yaml_is_named_with_its_line(load, content, line):
    assert f"machine.yaml:{line}: does not parse as YAML: " in message_of(load, content)


def test_characters_that_yaml_forbids_are_refused(load):
    assert "machine.yaml" in message_of(load, "name: fi\x00rst\n")
    assert "does not parse as YAML" in message_of(load, "name: fi\x07rst\n")


def test_a_file_that_is_no_text_is_refused(load):
    assert "machine.yaml: cannot be read" in message_of(load, b"name: \xff\xfe\n")


def test_a_file_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(DataFileError, match=r"nowhere\.yaml: cannot be read"):
        load_typed(Machine, tmp_path / "nowhere.yaml")


def test_a_folder_is_refused(tmp_path):
    with pytest.raises(DataFileError, match="cannot be read"):
        load_typed(Machine, tmp_path)


def test_long_values_are_cut(load):
    words = message_of(load, SMALL + f"size: {list(range(100))}\n")
    assert "size: found [0, 1, 2" in words
    assert "...; accepted: 3 numbers" in words
    assert len(words) < 300


def test_the_error_class_can_be_chosen(tmp_path):
    path = tmp_path / "machine.yaml"
    path.write_text("name: first\n")
    with pytest.raises(RobotFileError):
        load_typed(Machine, path, error=RobotFileError)


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
        ("mass=-3", "--set mass: found -3; accepted: a number > 0 [kg]"),
        ("mass=.nan", "--set mass: found .nan; accepted: a number > 0 [kg]"),
        ("mass=", "--set mass: found null; accepted: a number > 0 [kg]"),
        ("mass={a: [1]}", "--set mass: found {a: [1]}; accepted: a number > 0 [kg]"),
        ("size=[1, -2, 3]", "--set size: size[1]: found -2; accepted: 3 numbers > 0 [m]"),
        (
            "drum={turn: 1}",
            "--set drum: drum.turn: unknown key; did you mean turns? known: radius, turns",
        ),
        ("parts=[{}]", "--set parts: parts[0].label: missing; accepted: text"),
        ("size=[1, 2]", "--set size: found [1, 2]; accepted: 3 numbers > 0 [m]"),
        ("drum.turns=0", "--set drum.turns: found 0; accepted: a whole number >= 1"),
        ("drum=3", "--set drum: found 3; accepted: a mapping"),
        ("mass", "--set mass: accepted: key=value, as in --set seed=3"),
        ("=3", "--set =3: accepted: key=value, as in --set seed=3"),
        ("", "--set : accepted: key=value, as in --set seed=3"),
        ("mass=[", "--set mass: found '[', which is not YAML"),
        ("mass=1\n---\n2", "--set mass: found '1\\n---\\n2', which is not YAML"),
        ("mass.x=1", "--set mass.x: mass has no keys of its own"),
        ("parts.label=1", "--set parts.label: parts has no keys of its own"),
        (
            "drum.turn=1",
            "--set drum.turn: there is no key turn in drum; did you mean turns? "
            "known: radius, turns",
        ),
    ],
)
def test_an_override_that_is_not_accepted_is_named(load, item, words):
    assert message_of(load, SMALL, item) == words


def test_an_unknown_key_in_an_override_comes_with_all_that_exist(load):
    words = message_of(load, SMALL, "maas=3")
    assert words.startswith("--set maas: there is no key maas in the scenario; did you mean mass? ")
    assert words.endswith("drum, brake, parts")


def test_an_override_does_not_hide_an_error_of_the_file(load):
    assert "machine.yaml:3: share: found 7" in message_of(load, SMALL + "share: 7\n", "mass=3")


def test_closest_gives_the_likely_name_and_all():
    assert closest("hom", ["home", "goal"]) == "did you mean home? known: home, goal"
    assert closest("xyz", ["home", "goal"]) == "known: home, goal"


def only_the_error_class(content, *overrides):
    """Loads a text; any exception but the error class, which names its place, is let through."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.yaml"
        path.write_bytes(content.encode("utf-8", "surrogatepass"))
        problem = None
        try:
            load_typed(Machine, path, overrides=overrides)
        except DataFileError as caught:
            problem = str(caught)
        assert problem is None or problem.startswith((str(path), "--set"))
        assert problem is None or len(problem.splitlines()) == 1


@given(st.text())
@example("\ufeffname: first")
@example("? [1, 2]\n: 3")
@example("? {a: 1}\n: 3")
@example("<<: {mass: 3}")
@example("%YAML 9.9\n---\nname: first")
def test_any_text_loads_or_raises_the_error_class(content):
    only_the_error_class(content)


@given(st.binary())
def test_any_bytes_load_or_raise_the_error_class(content):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.yaml"
        path.write_bytes(content)
        with pytest.raises(DataFileError):
            load_typed(Machine, path)


@given(
    st.sampled_from(
        ["name", "share", "torque", "size", "table", "kind", "enabled", "drum", "parts", "x"]
    ),
    st.text(),
)
def test_any_value_of_a_field_loads_or_raises_the_error_class(key, value):
    only_the_error_class(f"{SMALL}{key}: {value}\n")


# Scraps that mean something to YAML or to this schema, in any order.
PUNCTUATION = [*"[]{},:-?'\"#&*|>%@~ \n", "\n  ", "\n- ", ": ", "- ", "&a ", "*a"]
WORDS = ["null", "true", "1", "-1", ".inf", "1e3", "name: a", "mass: 2", "drum: ", "turns: "]
LISTS = ["parts: ", "size: ", "table: "]
TAGS = ["!", "!!", "!foo ", "!!str ", "!!int ", "!!null ", "<<: ", "\\n", "\x85"]
scraps = st.lists(st.sampled_from([*PUNCTUATION, *WORDS, *LISTS, *TAGS]), max_size=25).map("".join)


@given(scraps)
def test_any_yaml_like_text_loads_or_raises_the_error_class(content):
    only_the_error_class(content)


@given(st.text())
def test_any_override_loads_or_raises_the_error_class(item):
    only_the_error_class(SMALL, item)


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


@pytest.mark.parametrize(
    "line",
    [
        "share: !foo 1",
        "kind: !foo small",
        "enabled: !!bool maybe",
        "drum: !foo {turns: 1}",
        "size: !foo [1, 2, 3]",
        "size: !!omap [1, 2, 3]",
        "parts: !foo []",
        "size: &a [*a, 1, 2]",
        "parts: &a [*a]",
        "size: " + "[" * 3000 + "]" * 3000,
        'kind: "\\U00110000"',
        'share: "x\\ny"',
        '"x\\ny": 1',
        "? [1, 2]\n: 3",
        "name: fi\x07rst",
    ],
)
def test_what_yaml_can_say_and_a_schema_cannot_take_is_refused(load, line):
    assert "machine.yaml" in message_of(load, SMALL + line + "\n")


@pytest.mark.parametrize("item", ["mass=!foo 3", "ma\ns=1", "size=&a [*a]", "ma\ns"])
def test_overrides_that_yaml_can_say_and_a_schema_cannot_take_are_refused(load, item):
    message_of(load, SMALL, item)


def test_forbidden_characters_are_named_with_their_line(load):
    words = message_of(load, SMALL + "kind: fi\x07rst\n")
    assert "machine.yaml:3: does not parse as YAML" in words

"""Error messages that name file, line, field, value and range."""

from functools import partial

import pytest

from cdpr_drake.errors import MOST_PROBLEMS, DataFileError, RobotFileError
from cdpr_drake.schema.typed_yaml import load_typed
from tests.schema.yaml_machine import GOOD, SMALL, Machine, load_machine, message_of


@pytest.fixture
def load(tmp_path):
    return partial(load_machine, tmp_path)


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
        ("table: [1, [2, 3]]", "table[0]: found 1; accepted: n x 2 numbers [m]"),
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
        ("parts: [{name: a, label: b}]", "parts[0].name: unknown key; known: label, at"),
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
        ("{mass: 2.5}", ":1: name: missing; accepted: text"),
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
    assert "found no mapping at the top; accepted: the keys name, mass, sh" in words


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


def test_forbidden_characters_are_named_with_their_line(load):
    words = message_of(load, SMALL + "kind: fi\x07rst\n")
    assert "machine.yaml:3: does not parse as YAML" in words


def test_all_problems_of_a_file_are_said_at_once(load, tmp_path):
    lines = ("share: 7", "sizes: 1", "size: [1, 2, x]", "parts: [{label: one}, {at: [1, 2]}]")
    with pytest.raises(DataFileError) as caught:
        load("name: first\n" + "\n".join(lines), "drum.turns=0", "dram=1")
    file = str(tmp_path / "machine.yaml")
    assert [problem.removeprefix(file).partition(";")[0] for problem in caught.value.problems] == [
        "overrides dram: there is no key dram in the scenario",
        ":1: mass: missing",
        ":2: share: found 7",
        ":3: sizes: unknown key",
        ":4: size[2]: found x",
        ":5: parts[1].label: missing",
        ":5: parts[1].at: found [1, 2]",
        "overrides drum.turns: found 0",
    ]
    assert str(caught.value).splitlines() == list(caught.value.problems)


def test_a_long_list_of_wrong_numbers_is_cut(load):
    with pytest.raises(DataFileError) as caught:
        load(SMALL + "table: [" + ", ".join(["[x, 1]"] * 10_000) + "]")
    assert len(caught.value.problems) == MOST_PROBLEMS + 1
    assert caught.value.problems[-1] == "there may be more problems than these"

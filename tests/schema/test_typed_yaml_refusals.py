"""Error messages that name file, line, field, value and range."""

from functools import partial

import pytest

from cdpr_drake.errors import MOST_PROBLEMS, DataFileError, RobotFileError
from cdpr_drake.schema import typed_yaml
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
        ("share: .nan", "share: found .nan; accepted: a number >= 0 and <= 1 [-]"),
        ("torque: -.inf", "torque: found -.inf; accepted: a number [N m] or null"),
        ("torque: 1e999", "torque: found 1e999; accepted: a number [N m] or null"),
        ("share: 1:30", "share: found 1:30; accepted: a number >= 0 and <= 1 [-]"),
        ("share: much", "share: found much; accepted: a number >= 0 and <= 1 [-]"),
        ("share: ''", "share: found nothing; accepted: a number >= 0 and <= 1 [-]"),
        ("share: [1]", "share: found [1]; accepted: a number >= 0 and <= 1 [-]"),
        ("share: !!foo 1", "share: found the tag !!foo; accepted: a value without one"),
        ("share:", "share: found null; accepted: a number >= 0 and <= 1 [-]"),
        # Whole numbers, and fields of sections.
        ("drum: {turns: 2.5}", "drum.turns: found 2.5; accepted: a whole number >= 1"),
        ("drum: {turns: 0}", "drum.turns: found 0; accepted: a whole number >= 1"),
        ("drum: {radius: 0}", "drum.radius: found 0; accepted: a number > 0 [m]"),
        ("drum: [1, 2]", "drum: found [1, 2]; accepted: a mapping"),
        ("brake: {radius: -1}", "brake.radius: found -1; accepted: a number > 0 [m]"),
        # Arrays.
        ("size: [1, 2]", "size: found [1, 2]; accepted: 3 numbers > 0 [m]"),
        ("size: [1 2, 3]", "size: found [1 2, 3]; accepted: 3 numbers > 0 [m]"),
        ("size: 1", "size: found 1; accepted: 3 numbers > 0 [m]"),
        ("size: [1, 2, -3]", "size[2]: found -3; accepted: 3 numbers > 0 [m]"),
        ("size: [1, .nan, 3]", "size[1]: found .nan; accepted: 3 numbers > 0 [m]"),
        ("size: [1, [2], 3]", "size[1]: found [2]; accepted: 3 numbers > 0 [m]"),
        ("table: []", "table: found []; accepted: n x 2 numbers [m]"),
        ("table: [1, [2, 3]]", "table[0]: found 1; accepted: n x 2 numbers [m]"),
        ("table: [[1, 2], [3]]", "table[1]: found [3]; accepted: n x 2 numbers [m]"),
        ("table: [[1, 2], [3, x]]", "table[1][1]: found x; accepted: n x 2 numbers [m]"),
        # Texts and switches.
        ("kind: smell", "kind: found smell; did you mean small? accepted: one of small, large"),
        ("enabled: maybe", "enabled: found maybe; accepted: true or false"),
        ("enabled: 1", "enabled: found 1; accepted: true or false"),
        ("enabled: 'true'", "enabled: found true; accepted: true or false"),
        ("enabled: [true]", "enabled: found [true]; accepted: true or false"),
        ("enabled: !!bool maybe", "enabled: found maybe; accepted: true or false"),
        # Lists of sections.
        ("parts: {label: a}", "parts: found {label: a}; accepted: a list of mappings"),
        ("parts: [7]", "parts[0]: found 7; accepted: a mapping"),
        ("parts: [{label: a}, {}]", "parts[1].label: missing; accepted: text"),
        ("parts: [{label: [a]}]", "parts[0].label: found [a]; accepted: text"),
        ("parts: [{label: a, at: [1]}]", "parts[0].at: found [1]; accepted: 3 numbers [m]"),
        # Lists and mappings of values, names, directions.
        ("kinds: [c]", "kinds[0]: found c; accepted: one of a, b"),
        ("kinds: a", "kinds: found a; accepted: a list of a, b"),
        ("joints: {a: [x]}", "joints.a[0]: found x; accepted: n numbers [rad]"),
        ("packages: {a: [1]}", "packages.a: found [1]; accepted: text"),
        (
            "drums: {a: {turn: 1}}",
            "drums.a.turn: unknown key; did you mean turns? known: radius, turns",
        ),
        (
            "axis: [0, 0.0, -0]",
            "axis: found [0, 0.0, -0]; accepted: 3 numbers, not all zero [-] or null",
        ),
        (
            "file: ../a",
            "file: found ../a; accepted: 1 to 64 letters, digits, _ . -, the first one no dot",
        ),
        ('title: "\\a"', "title: found '\\x07'; accepted: no control characters or null"),
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


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (GOOD.replace("- [5, 6]", "- [5, six]"), ":10: table[2][1]: found six"),
        (GOOD.replace("  turns: 2", "  turns: -2"), ":22: brake.turns: found -2"),
        ("name: first\nmass: -2.5\n", ":2: mass: found -2.5; accepted: a number > 0 [kg]"),
        ("name: first\n", ":1: mass: missing; accepted: a number > 0 [kg]"),
        ("{mass: 2.5}", ":1: name: missing; accepted: text"),
        ("name: first\nmas: 3\n", ":2: mas: unknown key; did you mean mass? known: name, mass, sh"),
        (SMALL + "maas:\n- 3\n", ":3: maas: unknown key; did you mean mass? known: name, mass, sh"),
        *((text, ": found no mapping at the top; accepted: the keys name, mass, sh")
          for text in ("", "# nothing\n", "5\n", "[1, 2]\n", "text", "---\n...\n")),
        ("name: [first\nmass: 2\n", ":2: does not parse as YAML: "),
        ("name: first\n\tmass: 2\n", ":2: does not parse as YAML: "),
        ("name: first\nmass: 2\n  share: 1\n", ":3: does not parse as YAML: "),
        ("name: 'first\nmass: 2\n", ":3: does not parse as YAML: "),
        ("name: first\nmass: *nowhere\n", ":2: does not parse as YAML: "),
        ("name: first\n---\nmass: 2\n", ":2: does not parse as YAML: "),
        ("name: @first\n", ":1: does not parse as YAML: "),
        ("name: fi\x00rst\n", ":1: does not parse as YAML: "),
        (SMALL + "kind: fi\x07rst\n", ":3: does not parse as YAML: "),
        (b"name: \xff\xfe\n", ": cannot be read"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_line(load, content, words):
    assert f"machine.yaml{words}" in message_of(load, content)


def test_what_is_no_file_is_refused_by_the_chosen_error(tmp_path):
    for path in (tmp_path / "nowhere.yaml", tmp_path):
        with pytest.raises(RobotFileError, match=f"^{path}: cannot be read"):
            load_typed(Machine, path, error=RobotFileError)


def test_long_values_are_cut(load):
    words = message_of(load, SMALL + f"size: {list(range(100))}\n")
    assert "size: found [0, 1, 2" in words
    assert "...; accepted: 3 numbers" in words
    assert len(words) < 300


@pytest.mark.parametrize(
    "line",
    [
        "kind: !foo small",
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
    ],
)
def test_what_yaml_can_say_and_a_schema_cannot_take_is_refused(load, line):
    assert "machine.yaml" in message_of(load, SMALL + line + "\n")


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


def test_of_many_wrong_keys_no_more_are_compared_than_are_said(load, monkeypatch):
    """A file of 25,000 keys that nobody knows took minutes."""
    names, compare = [], typed_yaml.meant_names
    monkeypatch.setattr(
        typed_yaml, "meant_names", lambda name, known: names.append(name) or compare(name, known)
    )
    with pytest.raises(DataFileError) as caught:
        load(SMALL + "".join(f"k{k}: 1\n" for k in range(2000)))
    assert len(caught.value.problems) == MOST_PROBLEMS + 1
    assert len(names) <= 3 * MOST_PROBLEMS

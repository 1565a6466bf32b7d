"""YAML and JSON that would stop a reader are refused by one kind of error, with its line."""

import json
import re

import pytest

from cdpr_drake.errors import RobotFileError, ScenarioError, plain_words
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.yaml_files import MOST_DEPTH, YamlTextError, compose_yaml, load_yaml
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import scenario_kind

BOMB = "a0: &a0 [x, x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 10)
)

LONG = "9" * 5000


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BOMB, "more than 100,000 keys and values"),
        ("a: &a {<<: *a}", "^found an alias within what it names"),
        ("a: &a [*a]", "^found an alias within what it names"),
        ("&a\nb: 1\nc: {d: *a}", "^found an alias within what it names"),
        ("[" * 200 + "]" * 200, f"nested more than {MOST_DEPTH} deep"),
        ("- " * 200 + "1", f"nested more than {MOST_DEPTH} deep"),
        ("x" * 300_000, "found 300,000 bytes"),
    ],
    ids=["bomb", "merged into itself", "holds itself", "top", "brackets", "dashes", "long"],
)
def test_yaml_that_grows_is_refused_before_it_does(text, words):
    for read in (compose_yaml, load_yaml):
        with pytest.raises(YamlTextError, match=words):
            read(text)


@pytest.mark.parametrize(
    "value",
    ["!!int ''", "!!float ''", "!!bool maybe", "!!timestamp never", "!!binary \u00e9", "2001-99-99",
     LONG, "1" + ":1" * 400, "1" + ":1" * 400 + ".5", "!!python/object:os.system {}", "{[1]: 2}",
     "!!set [1]", "!!omap {a: 1}", '"\\UFFFFFFFF"'],
)  # fmt: skip
def test_a_value_that_its_tag_does_not_take_is_refused(value):
    with pytest.raises(YamlTextError, match="does not parse as YAML: ") as caught:
        load_yaml(f"a: 1\nb: {value}\n")
    assert caught.value.line in (None, 2)


def test_yaml_says_what_it_said():
    text = "a: &a [1, 0x10, 1.5, yes, ~]\nb: *a\n? c\n: {<<: {d: 2}}\n"
    assert load_yaml(text) == {"a": [1, 16, 1.5, True, None], "b": [1, 16, 1.5, True, None],
                               "c": {"d": 2}}  # fmt: skip
    assert load_yaml("") is None
    assert compose_yaml("# nothing\n") is None


@pytest.mark.parametrize(
    "text",
    [
        f'{{"a": {LONG}}}',
        f"[-{LONG}]",
        "[" * 200 + "]" * 200,
        "[" * 100_000,
        "{",
        b"\xff\xff{}",
        "",
    ],
    ids=["number", "negative", "deep", "deeper", "open", "bytes", "empty"],
)
def test_json_that_is_none_is_one_error(text):
    with pytest.raises(json.JSONDecodeError):
        load_json(text)


def test_json_is_read_as_before():
    text = '{"a": [1, 2.5, 1e300, null], "b": NaN, "b": Infinity}'
    found = load_json(text.encode())
    assert found == {"a": [1, 2.5, 1e300, None], "b": float("inf")}
    with pytest.raises(ValueError, match="Infinity"):
        load_json(text, lambda word: (_ for _ in ()).throw(ValueError("Infinity")))


def robot_with(folder, key, value):
    """A shipped robot's file with the first line of a key replaced."""
    text = robot_file("acrobot_small").read_text(encoding="utf-8")
    text = re.sub(rf"(?m)^( *){key}: .*$", lambda m: f"{m[1]}{key}: {value}", text, count=1)
    (folder / "robot.yaml").write_text(text, encoding="utf-8")
    return str(folder / "robot.yaml")


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("title", r'"\e[31mred"', "accepted: no control characters"),
        ("title", r'"\x9b2J"', "accepted: no control characters"),
        ("title", r'"a\0b"', "accepted: no control characters"),
        (
            "title",
            "!!python/object/apply:os.system x",
            "found the tag !!python/object/apply:os.sys",
        ),
        ("title", "!!binary x", "found the tag !!binary; accepted"),
        ("mass", "1e25", "platform.mass: found 1e25; accepted: a number > 0 and <= 1e+07 [kg]"),
        ("youngs_modulus", "1e25", "cable.youngs_modulus: found 1e25"),
        ("beam", "50.0", "frame.beam: found 50; accepted: at most 1.2 [m], the frame's width"),
        ("position", "[0, 0, 9]", "home.position: found (0, 0, 9); accepted: within the frame"),
    ],
)
def test_texts_and_numbers_that_no_robot_has_are_one_line(key, value, words, tmp_path):
    with pytest.raises(RobotFileError, match=re.escape(words)) as caught:
        load_robot(robot_with(tmp_path, key, value))
    assert plain_words(str(caught.value)).count("\n") == 0


def test_lines_and_letters_of_any_language_are_text(tmp_path):
    title = '"two\\nlines, caf\\u00e9"'
    assert load_robot(robot_with(tmp_path, "title", title)).title == "two\nlines, caf\u00e9"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (BOMB, "found more than 100,000 keys and values"),
        ("name: [" + "1, " * 700_000 + "1]", "found 2,100,009 bytes; accepted: at most 262,144"),
        ("a: &a [*a]", "found an alias within what it names"),
    ],
    ids=["bomb", "long", "itself"],
)
def test_robots_and_scenarios_that_are_too_large_are_refused(content, words, tmp_path):
    path = tmp_path / "large.yaml"
    path.write_text(content, encoding="utf-8")
    assert scenario_kind(str(path)) == "visual_servo"  # whose loader says what is wrong
    for load, error in ((load_robot, RobotFileError), (load_scenario, ScenarioError)):
        with pytest.raises(error, match=words) as caught:
            load(str(path))
        assert len(str(caught.value)) <= 500 + len(str(path))


def test_a_bomb_on_the_command_line_is_refused():
    words = "{" + BOMB.replace("\n", ", ") + "}"
    with pytest.raises(ScenarioError) as caught:
        load_scenario("acrobot_pbvs", [f"seed={words}", f"camera={words}"])
    assert len(str(caught.value).splitlines()[0]) <= 500

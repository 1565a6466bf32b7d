"""YAML and JSON that would stop a reader are refused by one kind of error, with its line."""

import json
import re

import pytest

from cdpr_drake.errors import RobotFileError, plain_words
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.yaml_files import MOST_DEPTH, YamlTextError, compose_yaml, load_yaml

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


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (r'"\e[31mred"', "accepted: no control characters"),
        (r'"\x9b2J"', "accepted: no control characters"),
        (r'"a\0b"', "accepted: no control characters"),
        ("!!python/object/apply:os.system x", "found the tag !!python/object/apply:os.system"),
        ("!!binary x", "found the tag !!binary; accepted"),
        ("!mine x", "found the tag !mine; accepted"),
    ],
)
def test_texts_that_control_a_terminal_or_have_a_tag_are_refused(value, words, tmp_path):
    text = robot_file("acrobot_small").read_text()
    path = tmp_path / "robot.yaml"
    path.write_text(re.sub("(?m)^title: .*$", lambda _: f"title: {value}", text))
    with pytest.raises(RobotFileError, match=words) as caught:
        load_robot(path)
    assert plain_words(str(caught.value)).count("\n") == 0
    good = 'title: "two\\nlines, caf\\u00e9"'
    path.write_text(re.sub("(?m)^title: .*$", lambda _: good, text))
    assert load_robot(path).title == "two\nlines, caf\u00e9"

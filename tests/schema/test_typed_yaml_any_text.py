"""Whatever a file says, it loads or raises the error class with one line a problem."""

import tempfile
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cdpr_drake.errors import DataFileError
from cdpr_drake.schema.typed_yaml import load_typed
from tests.schema.yaml_machine import SMALL, Machine


def only_the_error_class(content, *overrides):
    """Loads a text; any exception but the error class, which names its place, is let through."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.yaml"
        path.write_bytes(content.encode("utf-8", "surrogatepass"))
        problem = None
        try:
            load_typed(Machine, path, overrides=overrides)
        except DataFileError as caught:
            problem = caught
        for line in () if problem is None else problem.problems:
            assert line.startswith((str(path), "overrides "))
            assert len(line.splitlines()) == 1


# Scraps that mean something to YAML or to this schema, in any order.
PUNCTUATION = [*"[]{},:-?'\"#&*|>%@~ \n", "\n  ", "\n- ", ": ", "- ", "&a ", "*a"]
WORDS = ["null", "true", "1", "-1", ".inf", "1e3", "name: a", "mass: 2", "drum: ", "turns: "]
LISTS = ["parts: ", "size: ", "table: "]
TAGS = ["!", "!!", "!foo ", "!!str ", "!!int ", "!!null ", "<<: ", "\\n", "\x85"]
scraps = st.lists(st.sampled_from([*PUNCTUATION, *WORDS, *LISTS, *TAGS]), max_size=25).map("".join)


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


@given(scraps)
def test_any_yaml_like_text_loads_or_raises_the_error_class(content):
    only_the_error_class(content)


@given(st.text())
def test_any_override_loads_or_raises_the_error_class(item):
    only_the_error_class(SMALL, item)

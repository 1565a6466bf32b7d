"""A schema with one field of each kind, and files of it, for the tests of typed YAML."""

# Annotations are not postponed here: Drake's YAML loader reads them.

from dataclasses import dataclass

import numpy as np
import pytest

from cdpr_drake.errors import DataFileError
from cdpr_drake.schema.fields import (
    array,
    number,
    optional_section,
    section,
    sections,
    switch,
    text,
    whole,
)
from cdpr_drake.schema.typed_yaml import load_typed


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


def load_machine(folder, content, *overrides):
    """Writes a text to machine.yaml and loads it."""
    path = folder / "machine.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return load_typed(Machine, path, overrides=overrides)


def message_of(load, content, *overrides):
    """The one line of words that loading a text raises."""
    with pytest.raises(DataFileError) as caught:
        load(content, *overrides)
    words = str(caught.value)
    assert len(words.splitlines()) == 1
    return words

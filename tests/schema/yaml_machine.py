"""A schema with one field of each kind, and files of it, for the tests of typed YAML."""

from typing import Annotated

import numpy as np
import pytest

from cdpr_drake.errors import DataFileError
from cdpr_drake.schema.declarations import (
    Direction,
    In,
    Name,
    OneOf,
    Switch,
    Text,
    filled,
    settings,
    values,
)
from cdpr_drake.schema.typed_yaml import load_typed


@settings
class Drum:
    """A section that has defaults.

    It is round.
    """

    radius: Annotated[float, In("m", gt=0.0), "Radius."] = 0.04
    turns: Annotated[int, In(ge=1), "Turns."] = 10


@settings
class Part:
    label: Annotated[Text, "Label."]
    at: Annotated[np.ndarray, In("m", 3), "Place."] = values(0.0, 0.0, 0.0)


@settings
class Machine:
    """One field of each kind."""

    name: Annotated[Text, "Name."]
    mass: Annotated[float, In("kg", gt=0.0), "Mass."]
    share: Annotated[float, In("-", ge=0.0, le=1.0), "Share."] = 0.5
    torque: Annotated[float | None, In("N m"), "Torque."] = None
    size: Annotated[np.ndarray, In("m", 3, gt=0.0), "Edges."] = values(1.0, 1.0, 1.0)
    table: Annotated[np.ndarray, In("m", None, 2), "Table."] = values((0.0, 0.0))
    axis: Annotated[Direction | None, "Axis."] = None
    kind: Annotated[str, OneOf(("small", "large")), "Kind."] = "small"
    kinds: Annotated[list[str], OneOf(("a", "b")), "Kinds."] = filled(list)
    title: Annotated[Text | None, "Title."] = None
    file: Annotated[Name, "File."] = "a"
    enabled: Annotated[Switch, "Enabled."] = False
    joints: Annotated[dict[str, np.ndarray], In("rad", None, single=True), "Joints."] = filled(dict)
    packages: Annotated[dict[str, Text], "Packages."] = filled(dict)
    drums: Annotated[dict[str, Drum], "Drums."] = filled(dict)
    drum: Annotated[Drum, "Drum."] = filled(Drum)
    brake: Annotated[Drum | None, "Brake."] = None
    parts: Annotated[list[Part], "Parts."] = filled(list)


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
axis: [010, -2.5e-1, 0]
kind: large
kinds: [b, a]
title: 12
file: on
enabled: true
joints: {a: 1, b: [2, 3]}
packages: {one: 1e3}
drums: {first: {turns: 4}}
drum: {radius: 0.05, turns: 1e1}
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

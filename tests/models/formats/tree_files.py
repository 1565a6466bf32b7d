"""Small CASPR models of several links, written from the format's definition."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.formats.caspr_mechanism import initial_joints, write_mechanism

BOX = "0.02 0.03 0.04 0.001 -0.002 0.003"
"""Moments and products of a body that can be [kg m^2]."""


@dataclass
class Link:
    """What a link says; the text of its elements and attributes."""

    joint: str
    q: str
    parent: int = 0
    location: str = "0 0 0"
    name: str = "link"
    mass: str = "1.5"
    com: str = "0.1 -0.2 0.3"
    inertia: str = BOX
    ref: str = "com"
    more: str = ""

    def text(self, number: int) -> str:
        """Its element."""
        keys = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
        moments = "".join(
            f"<{key}>{value}</{key}>" for key, value in zip(keys, self.inertia.split(), strict=True)
        )
        return (
            f'<link_rigid num="{number}" name="{self.name}"><joint type="{self.joint}" '
            f'q_initial="{self.q}"{self.more and " "}{self.more}/>'
            f"<physical><mass>{self.mass}</mass><com_location>{self.com}</com_location>"
            f'<end_location>0 0 1</end_location><inertia ref="{self.ref}">{moments}</inertia>'
            f"</physical><parent><num>{self.parent}</num><location>{self.location}</location></parent>"
            "</link_rigid>"
        )


@dataclass
class Cable:
    """What a cable says; its points as (link, location), or the text of an element."""

    points: list
    name: str = "cable 1"
    reference: str = "joint"
    kind: str = "cable_ideal"
    properties: str = "<force_min>1.0</force_min><force_max>60.0</force_max>"

    def text(self) -> str:
        """Its element."""
        points = "".join(
            point
            if isinstance(point, str)
            else f"<attachment><link>{point[0]}</link><location>{point[1]}</location></attachment>"
            for point in self.points
        )
        return (
            f'<{self.kind} name="{self.name}" attachment_reference="{self.reference}"><properties>'
            f"{self.properties}</properties><attachments>{points}</attachments></{self.kind}>"
        )


@dataclass
class Model:
    """A model: its links from number 1 on, its sets of cables, the default one first."""

    links: list
    cables: list
    sets: dict = field(default_factory=dict)
    name: str = "toy"
    default: str = "basic"
    shown: str = "-1 1 -1 1 -1 1"

    def write(self, folder: Path) -> Path:
        """Writes its files; returns that of the bodies."""
        links = "".join(link.text(k) for k, link in enumerate(self.links, 1))
        bodies = folder / f"{self.name}_bodies.xml"
        bodies.write_text(
            '<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE bodies_system SYSTEM "b.dtd">\n'
            f'<bodies_system><links display_range="{self.shown}">{links}</links></bodies_system>',
            encoding="utf-8",
        )
        sets = {self.default: self.cables, **self.sets}
        words = "".join(
            f'<cable_set id="{name}">{"".join(cable.text() for cable in cables)}</cable_set>'
            for name, cables in sets.items()
        )
        (folder / f"{self.name}_cables.xml").write_text(
            "<!DOCTYPE cables [<!ATTLIST cable_set id ID #REQUIRED>]>"
            f'<cables default_cable_set="{self.default}">{words}</cables>',
            encoding="utf-8",
        )
        return bodies


def pair(model: Model, folder: Path) -> tuple[Path, Path]:
    """Writes a model; its files of bodies and of cables."""
    return model.write(folder), folder / f"{model.name}_cables.xml"


def at_start(tree):
    """A plant of the tree's own file, and its context at the initial coordinates."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(write_mechanism(tree), "xml")
    plant.Finalize()
    context, q = plant.CreateDefaultContext(), np.zeros(plant.num_positions())
    for name, value in initial_joints(tree).items():
        q[plant.GetJointByName(name).position_start()] = value
    plant.SetPositions(context, q)
    return plant, context


def two_link() -> Model:
    """Two links of 0.4 m and 0.3 m that turn about y, and two cables over one and two of them."""
    return Model(
        [
            Link("R_Y", "0.3", name="upper", com="0 0 0.2",
                 more='q_min="-2.0" q_max="2.0" actuated="true"'),
            Link("R_Y", "-0.7", parent=1, location="0 0 0.4", name="lower", com="0 0 0.1",
                 more='q_min="-2.5" q_max="2.5"'),
        ],
        [
            Cable([(0, "0.5 0 0.1"), (1, "0.05 0 0.02"), (2, "0.04 0 0.06")], reference="com"),
            Cable([(0, "-0.5 0 0.1"), (2, "-0.04 0 0.2")], name="cable 2"),
        ],
    )  # fmt: skip

"""What was published, by section, and which study's statement answers it.

Each source is a YAML file beside this module: sections in the order of the source, with

- `statements`: keys "study/statement" of what studies judge, see `StudyEntry.judges`;
- `numbers`: keys "study" or "study/group" of case studies, whose printed numbers belong there;
- `items`: figures, tables and statements by their label, with `answers` (keys as above), `figures`
  (files "study/name" of the study's results that show the same in the same layout, see
  `StudyEntry.figures`), `differs`, by what ours differ from the published one, and, where there is
  no run, `missing`, which says what is not there; `cited` says of a statement that it is about the
  work of others, of which the source did and compared nothing.

`not_drawn` lists figures with a result that is not drawn here, and `why`; `no_result` the figures
and tables that show no result: photographs, schemes, parameters. So every figure and table of a
source is in its file once; a test holds that. Under `own` a file lists studies whose statements are
of no source. `corrected` lists, by chapter, equations and tables that do not hold as printed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from cdpr_drake.schema.yaml_files import load_yaml

SOURCES = ("gazebo_thesis", "servoing_thesis", "ours")
"""Files, in the order of a report."""


@dataclass(frozen=True)
class PublishedItem:
    """A figure, a table or a statement.

    Attributes:
        label: Its number, or "statement".
        says: What it shows or states, in a line; empty where the statement's own words are meant.
        answers: Keys "study/statement" of what is judged of it.
        figures: Keys "study/file" of figures that show the same, without the file's ending.
        differs: By what our figures differ from the published one; empty for a statement.
        missing: What is not there, where there is no run for it, or for a part of it.
        cited: Why nothing is to be judged, where the source tells of the work of others.
    """

    label: str
    says: str = ""
    answers: tuple[str, ...] = ()
    figures: tuple[str, ...] = ()
    differs: str = ""
    missing: str = ""
    cited: str = ""


@dataclass(frozen=True)
class NotDrawn:
    """A figure with a result that is not drawn here.

    Attributes:
        label: Its number.
        says: What it shows.
        why: Why it is not drawn.
    """

    label: str
    says: str
    why: str


@dataclass(frozen=True)
class PublishedSection:
    """A section of a source.

    Attributes:
        number: Such as 2.3.1 or A.5.
        title: Its heading, in a few words.
        items: What is published there; statements that studies judge first.
        numbers: Keys "study" or "study/group" of printed numbers.
    """

    number: str
    title: str
    items: tuple[PublishedItem, ...] = ()
    numbers: tuple[str, ...] = ()

    @property
    def chapter(self) -> str:
        """Of which chapter or appendix it is."""
        return self.number.partition(".")[0]


@dataclass(frozen=True)
class Register:
    """What a source publishes.

    Attributes:
        name: Of its file.
        title: Of the source.
        sections: In their order.
        not_drawn: Figures with a result that no study draws.
        no_result: Labels of figures and tables that show no result.
        own: Studies all of whose statements are of no source.
        corrected: By chapter, what does not hold as printed; what is used instead stands in the
            documentation.
    """

    name: str
    title: str
    sections: tuple[PublishedSection, ...]
    not_drawn: tuple[NotDrawn, ...] = ()
    no_result: tuple[str, ...] = ()
    own: tuple[str, ...] = ()
    corrected: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def read_register(name: str, content: dict[str, Any]) -> Register:
    """The register of a file's content; KeyError or TypeError where it is none."""
    return Register(
        name=name,
        title=content["title"],
        sections=tuple(map(_section, content.get("sections", ()))),
        not_drawn=tuple(NotDrawn(**one) for one in content.get("not_drawn", ())),
        no_result=tuple(content.get("no_result", ())),
        own=tuple(content.get("own", ())),
        corrected={key: tuple(some) for key, some in content.get("corrected", {}).items()},
    )


def _section(content: dict[str, Any]) -> PublishedSection:
    judged = [PublishedItem("statement", answers=(key,)) for key in content.get("statements", ())]
    others = [
        PublishedItem(
            label=item["label"],
            says=item["says"],
            answers=tuple(item.get("answers", ())),
            figures=tuple(item.get("figures", ())),
            differs=item.get("differs", ""),
            missing=item.get("missing", ""),
            cited=item.get("cited", ""),
        )
        for item in content.get("items", ())
    ]
    return PublishedSection(
        number=str(content["section"]),
        title=content["title"],
        items=(*judged, *others),
        numbers=tuple(content.get("numbers", ())),
    )


@cache
def published_registers() -> tuple[Register, ...]:
    """The registers of all sources, in the order of a report."""
    folder = Path(__file__).parent
    return tuple(
        read_register(name, load_yaml((folder / f"{name}.yaml").read_text(encoding="utf-8")))
        for name in SOURCES
    )

"""Every figure and table of the theses is in the register once, and every link leads somewhere."""

import re
from collections import Counter

import pytest

from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.published.register import published_registers, read_register

REGISTERS = {register.name: register for register in published_registers()}
SECTIONS = [section for register in REGISTERS.values() for section in register.sections]
ITEMS = [
    (register.name, item)
    for register in REGISTERS.values()
    for section in register.sections
    for item in section.items
]
OWN = {study for register in REGISTERS.values() for study in register.own}
LINKED = {key for _, item in ITEMS for key in item.answers}
JUDGED = {f"{study}/{name}" for study, entry in STUDIES.items() for name in entry.judges}

LISTED = {
    "gazebo_thesis": {"Figure": {"1": 3, "2": 5, "3": 2, "4": 4, "5": 5, "6": 21}, "Table": {}},
    "servoing_thesis": {
        "Figure": {"1": 23, "2": 18, "3": 44, "4": 8, "5": 26, "A": 25},
        "Table": {"1": 1, "2": 1, "3": 1, "5": 1, "A": 18},
    },
}
"""Numbers of figures and tables by chapter, from the theses' own lists."""


def numbers(label):
    """Numbers of a label such as `Figures 3.13, 3.15 and 3.17` or `Figures A.1 to A.13`."""
    words = re.findall(r"[A-Z\d]\.\d+", label)
    if " to " not in label:
        return words
    chapter, first = words[0].split(".")
    return [f"{chapter}.{k}" for k in range(int(first), int(words[1].split(".")[1]) + 1)]


@pytest.mark.parametrize("name", sorted(LISTED))
@pytest.mark.parametrize("kind", ["Figure", "Table"])
def test_every_figure_and_table_is_there_once(name, kind):
    register, labels = REGISTERS[name], [item.label for one, item in ITEMS if one == name]
    found = Counter(
        number
        for label in (*labels, *register.no_result, *(one.label for one in register.not_drawn))
        if label.startswith(kind)
        for number in numbers(label)
    )
    wanted = {f"{c}.{k + 1}" for c, count in LISTED[name][kind].items() for k in range(count)}
    assert set(found) == wanted
    assert set(found.values()) <= {1}


def test_every_link_leads_to_a_statement_and_every_statement_is_somewhere():
    assert LINKED <= JUDGED
    assert STUDIES.keys() >= OWN
    assert {key for key in JUDGED - LINKED if key.partition("/")[0] not in OWN} == set()


def test_every_study_has_a_place():
    keys = LINKED.union(*(section.numbers for section in SECTIONS))
    assert set(STUDIES) <= OWN | {key.partition("/")[0] for key in keys}


def test_names_of_statements_and_figures_are_unique_in_a_study():
    for study, entry in STUDIES.items():
        assert len(set(entry.judges)) == len(entry.judges), study
        assert len(set(entry.figures)) == len(entry.figures), study


def test_every_printed_number_has_one_place():
    places = Counter()
    for key in (key for section in SECTIONS for key in section.numbers):
        study, _, group = key.partition("/")
        some = [n for n in STUDIES[study].numbers if group in ("", n.group)]
        assert some, key
        places.update((study, n.configuration, n.metric) for n in some)
    wanted = {
        (study, n.configuration, n.metric)
        for study, entry in STUDIES.items()
        for n in entry.numbers
    }
    assert set(places) == wanted
    assert set(places.values()) == {1}


def test_an_item_has_an_answer_or_a_figure_and_nothing_is_without_a_run():
    for name, item in ITEMS:
        assert item.answers or item.figures or item.cited, (name, item)
        assert not item.missing, (name, item)
        assert not (item.cited and item.answers), (name, item)
        assert item.says or item.label == "statement", (name, item)


def test_every_figure_has_an_entry_of_its_own_with_a_file_that_its_study_can_write():
    for name in LISTED:
        figures = [item for one, item in ITEMS if one == name and item.label.startswith("Figure")]
        assert figures, name
        for item in figures:
            assert len(numbers(item.label)) == 1, (name, item.label)
            assert item.figures, (name, item.label)
            assert item.differs, (name, item.label)
    for key in (key for _, item in ITEMS for key in item.figures):
        study, _, name = key.partition("/")
        assert name in STUDIES[study].figures, key


def test_every_drawn_layout_of_a_case_is_linked():
    """A figure that is drawn in the layout of a published one is shown beside it."""
    linked = {
        key
        for name, item in ITEMS
        if name in LISTED and item.label.startswith("Figure")
        for key in item.figures
    }
    drawn = {
        f"{study}/{name}"
        for study, entry in STUDIES.items()
        for name in entry.figures
        if name.startswith(("figure_", "shapes_", "gains_"))
    }
    assert drawn - linked == set()


def test_what_is_not_drawn_says_why():
    for one in (one for register in REGISTERS.values() for one in register.not_drawn):
        assert one.says, one.label
        assert one.why, one.label


def test_a_register_without_a_title_is_none():
    with pytest.raises(KeyError):
        read_register("toy", {"sections": []})

"""What the site makes of docstrings and of a notebook's outputs."""

from types import SimpleNamespace

import pytest

from tests.docs.names import ROOT

griffe = pytest.importorskip("griffe", reason="the extra docs is not installed")
hooks = pytest.importorskip("docs.hooks", reason="the extra docs is not installed")

TABLE = """A block.

    ======== ============ ===== =======================
    port     type         unit  meaning
    ======== ============ ===== =======================
    q_dot    vector(m)    m/s   in, `a|b`, positive
                                pays out
    X_WP     list[X]            out
    ======== ============ ===== =======================

After it."""

MARKDOWN = """A block.


| port | type | unit | meaning |
| --- | --- | --- | --- |
| q\\_dot | vector(m) | m/s | in, `a|b`, positive pays out |
| X\\_WP | list\\[X] |  | out |


After it."""

SCHEMA = """
class Section:
    '''A section.'''

    _hidden: int = whole("Not shown.", 0)
    rate: float = number("How often, in | steps.", "1/s", 2.0, least=0.0)
    count: int = whole("How many.", 0, unit="pulses")
    name: str = text("What it is " "called.")
    plain: int = 3
"""


def test_tables_of_docstrings_are_tables_of_the_site():
    assert hooks.with_tables(TABLE) == MARKDOWN
    assert hooks.with_tables("No table, e == 3.") == "No table, e == 3."


@pytest.mark.parametrize("text", [TABLE, f"{TABLE}\n{TABLE}"])
def test_nothing_is_lost(text):
    kept = hooks.with_tables(text).replace("\\", "").replace("|", " ").replace("---", "").split()
    assert kept == [word for word in text.replace("|", " ").split() if set(word) != {"="}]


def test_a_section_lists_its_fields():
    module = griffe.visit("made", filepath=ROOT / "made.py", code=SCHEMA)
    section = module["Section"]
    hooks.Docstrings().on_object(obj=section)
    assert section.docstring.value.splitlines()[2:] == [
        "| field | unit | meaning |",
        "| --- | --- | --- |",
        "| `rate` | 1/s | How often, in \\| steps. |",
        "| `count` | pulses | How many. |",
        "| `name` |  | What it is called. |",
    ]


def test_bars_in_code_of_tables_have_no_backslash():
    page = "| `a\\|b` | c \\| d |\n`a\\|b`"
    where = SimpleNamespace(file=SimpleNamespace(src_uri="a.md"))
    assert hooks.on_page_markdown(page, where) == "| `a|b` | c \\| d |\n`a\\|b`"


def test_pictures_lead_to_themselves_unless_they_lead_elsewhere():
    page = '<p><img alt="x" src="../a.webp"> <a href="b"><img src="c.png"></a></p>'
    assert hooks.on_page_content(page) == (
        '<p><a href="../a.webp"><img alt="x" src="../a.webp"></a> '
        '<a href="b"><img src="c.png"></a></p>'
    )


def test_what_a_cell_prints_in_pieces_is_one_output():
    pieces = [
        {"output_type": "stream", "text": "a\n"},
        {"output_type": "stream", "text": "b\n"},
        {"output_type": "display_data", "data": {}},
        {"output_type": "stream", "text": "c\n"},
    ]
    texts = [one.get("text") for one in hooks._joined(pieces)]
    assert texts == ["a\nb\n", None, "c\n"]


def test_the_menu_names_every_room_once():
    pages = [page for group in hooks.room_menu() for rooms in group.values() for page in rooms]
    shown = [path for page in pages for path in page.values()]
    assert sorted(shown) == sorted(hooks.room_page(room) for room in hooks.rooms())
    assert len({*shown}) == len(shown)

"""Looks can be told apart: by colour, and without colour by dashes, markers and hatches."""

import re
from itertools import combinations, pairwise
from pathlib import Path

import pytest

from cdpr_drake import palette

ROOT = Path(__file__).parent.parent

LEAST_CONTRAST = 1.9
"""Of a line against white paper: less than 3, which is asked of text-like marks, as lines also
have symbols and dashes; more than that of yellow, 1.3."""


def luminance(color):
    """Relative luminance. Source: WCAG 2.1."""
    linear = [
        c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in palette.rgb(color)
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_looks_differ_by_colour_and_in_grey():
    looks = [palette.nth_look(k) for k in range(64)]
    assert len({(look.color, look.marker) for look in looks}) == 64
    # A robot of eight cables, a study of eight configurations: also without colours.
    assert len({look.marker for look in looks[:8]}) == 8
    assert len({look.hatch for look in looks[:8]}) == 8
    for a, b in combinations(looks[:8], 2):
        assert (a.dash, a.marker) != (b.dash, b.marker)
    for a, b in pairwise(looks[:8]):
        assert a.dash != b.dash
    # Ten experiments and a few more: their markers are their own.
    assert len({look.marker for look in looks[:16]}) == 16


def test_lines_can_be_seen_on_white():
    for color in palette.COLORS:
        assert 1.05 / (luminance(color) + 0.05) > LEAST_CONTRAST, color


def test_parts_of_workspaces_and_tensions_are_ordered_in_grey():
    parts = [luminance(color) for color in palette.WORKSPACES.values()]
    assert parts == sorted(parts, reverse=True)
    assert min(a - b for a, b in pairwise(parts)) > 0.1
    tensions = [luminance(color) for color in palette.TENSIONS]
    assert tensions == sorted(tensions)


def test_a_name_keeps_its_look_whatever_is_shown_beside_it():
    names = ["a", "b", "c"]
    assert palette.look_of("b", names) == palette.nth_look(1)
    with pytest.raises(ValueError, match="d"):
        palette.look_of("d", names)


def test_red_green_blue():
    assert palette.rgb("#ff0080") == pytest.approx((1.0, 0.0, 128 / 255))


@pytest.mark.parametrize("path", sorted((ROOT / "analyses").rglob("*.py")), ids=str)
def test_no_figure_chooses_colours_of_its_own(path):
    """Numbered colours of matplotlib mean another thing in every figure; greys mean nothing."""
    found = re.findall(
        r"""["']C\d["']|color=f["']C\{|color=["'](?:tab:|[rgbcmy]["'])""", path.read_text()
    )
    assert not found


def test_dark_pages_show_every_colour():
    for color in (*palette.COLORS, *palette.TENSIONS):
        shown = palette.on_dark(color)
        assert palette.contrast(shown, palette.DARK_GROUND) >= palette.LEAST_CONTRAST
    assert palette.on_dark("#ffffff") == "#ffffff"
    assert palette.contrast("#000000", "#ffffff") == pytest.approx(21.0)

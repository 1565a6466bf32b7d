"""Words of the page can be read: WCAG 2.1 asks for a contrast of 4.5 (1.4.3)."""

import re

import pytest

from cdpr_drake.palette import rgb
from cdpr_drake.studio.page import PALETTE, STYLE

LEAST = 4.5
PAGES = {"body": "#ffffff", "body.body--dark": "#121212"}
"""Quasar's backgrounds, by the selector of what the style says of each page."""


def luminance(color):
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in rgb(color)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    dark, light = sorted([luminance(one), luminance(other)])
    return (light + 0.05) / (dark + 0.05)


def said(selector, what):
    """The colour that a rule of the style gives, or None."""
    style = re.sub(r"var\((--studio-(?:color-\d+|slack))\)", lambda one: PALETTE[one[1]], STYLE)
    rules = re.findall(rf"^{re.escape(selector)} {{(.*?)}}", style, re.DOTALL | re.MULTILINE)
    found = re.search(rf"{what}: (#\w{{6}})", " ".join(rules))
    return found and found[1]


@pytest.mark.parametrize("page", PAGES)
def test_words_stand_out_from_what_is_behind_them(page):
    root = ":root" if page == "body" else page
    primary = said(page, "--q-primary")
    on_buttons = said(f"{page} .bg-primary .q-btn__content", "color") or "#ffffff"
    assert contrast(on_buttons, primary) >= LEAST
    for color in (primary, said(root, "--studio-soft"), said(root, "--studio-problem")):
        assert contrast(color, PAGES[page]) >= LEAST


def test_words_of_the_header_stand_out():
    assert contrast("#ffffff", said(".studio-header", "background")) >= LEAST


def test_contrast_is_that_of_the_source():
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)

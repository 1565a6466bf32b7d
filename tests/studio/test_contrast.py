"""Words of the page can be read: WCAG 2.1 asks for a contrast of 4.5 (1.4.3)."""

import re

import pytest

from cdpr_drake.palette import contrast
from cdpr_drake.studio.page import PALETTE, STYLE


def said(selector, what):
    """The colour that a rule of the style gives, or None."""
    style = re.sub(r"var\((--studio-(?:color-\d+|slack))\)", lambda one: PALETTE[one[1]], STYLE)
    rules = re.findall(rf"^{re.escape(selector)} {{(.*?)}}", style, re.DOTALL | re.MULTILINE)
    found = re.search(rf"{what}: (#\w{{6}})", " ".join(rules))
    return found and found[1]


@pytest.mark.parametrize(
    ("page", "root", "behind"),
    [("body", ":root", "#ffffff"), ("body.body--dark", "body.body--dark", "#121212")],
)
def test_words_stand_out_from_what_is_behind_them(page, root, behind):
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)  # by the source
    primary = said(page, "--q-primary")
    on_buttons = said(f"{page} .bg-primary .q-btn__content", "color") or "#ffffff"
    assert contrast(on_buttons, primary) >= 4.5
    assert contrast("#ffffff", said(".studio-header", "background")) >= 4.5
    for color in (primary, said(root, "--studio-soft"), said(root, "--studio-problem")):
        assert contrast(color, behind) >= 4.5

"""Equations of the site are drawn with its own font, whatever a machine has."""

import shutil

import pytest

from tests.chromium import cleared, wait_for
from tests.docs.test_pages import DOCS

TALL = "<mfrac><mfrac><mi>l</mi><mi>t</mi></mfrac><mi>T</mi></mfrac>"
HEIGHT = "(e => e.getBoundingClientRect().height)(document.querySelector('{}'))"


@pytest.mark.parametrize("pair", ["()", "[]", "||"])
def test_brackets_are_as_high_as_what_they_hold(started_browser, tmp_path, pair):
    shutil.copytree(DOCS / "fonts", tmp_path / "fonts")
    fences = [f'<mo stretchy="true" fence="true">{sign}</mo>' for sign in pair]
    (tmp_path / "page.html").write_text(
        f'<meta charset="utf-8"><style>{(DOCS / "style.css").read_text()}</style>'
        f'<math display="block"><mrow>{TALL.join(fences)}</mrow></math>'
    )
    with cleared(started_browser) as page:
        page.get((tmp_path / "page.html").as_uri())
        wait_for(page, "document.fonts.status === 'loaded'")
        held = wait_for(page, HEIGHT.format("mfrac"))
        assert wait_for(page, HEIGHT.format("mo")) >= held

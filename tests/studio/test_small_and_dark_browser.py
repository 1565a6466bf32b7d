"""The studio on a phone, and on a dark page: everything can be reached, and read."""

from contextlib import contextmanager

import pytest

from tests.chromium import cleared, wait_for
from tests.studio.pictures import look
from tests.studio.run_page import press

OUTSIDE = """[...document.querySelectorAll('.studio-panels button, .studio-panels .q-field')]
    .filter(e => e.checkVisibility() && e.getBoundingClientRect().right > innerWidth + 1)
    .map(e => e.ariaLabel || e.innerText)"""
"""What of a panel lies beside the window."""

COVERED = """(() => {
    const shown = (kind) => [...document.querySelectorAll(kind)]
        .filter(e => e.checkVisibility() && e.innerText.trim() !== '');
    const found = [];
    for (const hint of shown('.studio-form .q-field__messages'))
        for (const label of shown('.studio-label, .studio-group .q-item__label')) {
            const a = hint.getBoundingClientRect(), b = label.getBoundingClientRect();
            if (a.bottom > b.top + 1 && b.bottom > a.top + 1 &&
                a.right > b.left && b.right > a.left)
                found.push(hint.innerText + ' | ' + label.innerText);
        }
    return found;
})()"""
"""Words below fields that other words lie on."""

CONTRAST = """(() => {
    const start = [...document.querySelectorAll('button')]
        .find(e => e.checkVisibility() && e.innerText.includes('Start'));
    const light = (color) => {
        const [r, g, b] = color.match(/[\\d.]+/g).map(x => x / 255)
            .map(x => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05;
    };
    const style = getComputedStyle(start);
    const [one, other] = [light(style.color), light(style.backgroundColor)];
    return Math.max(one, other) / Math.min(one, other);
})()"""
"""Of the words on the button that starts, by WCAG 2."""

READABLE = 4.5
"""Least contrast of words by WCAG 2, level AA."""

STARTS = "[...document.querySelectorAll('button')].some(e => e.checkVisibility() && \
e.innerText.includes('Start'))"


@contextmanager
def opened(browser, address, size, dark):
    with cleared(browser) as page:
        try:
            look(page, size, dark)
            page.get(address)
            yield page
        finally:
            page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
            page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_a_phone_shows_all_of_run_and_workspace(started_browser, studio):
    with opened(started_browser, studio[1], "phone", False) as page:
        for panel in ("Workspace", "Run"):
            press(page, panel)
            wait_for(page, STARTS)
            wait_for(page, "innerWidth < 400")
            assert page.execute_script(f"return {OUTSIDE}") == []
            assert page.execute_script(f"return {COVERED}") == []


@pytest.mark.parametrize("dark", [False, True])
def test_words_on_buttons_can_be_read(started_browser, studio, dark):
    with opened(started_browser, studio[1], "1280", dark) as page:
        press(page, "Run")
        wait_for(page, STARTS)
        wait_for(page, f"document.body.classList.contains('body--dark') === {str(dark).lower()}")
        wait_for(page, f"{CONTRAST} > {READABLE}", 20.0)

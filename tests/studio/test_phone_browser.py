"""The studio on a phone: everything can be reached, and read."""

from contextlib import contextmanager

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

STARTS = "[...document.querySelectorAll('button')].some(e => e.checkVisibility() && \
e.innerText.includes('Start'))"


@contextmanager
def on_a_phone(browser, address):
    with cleared(browser) as page:
        try:
            look(page, "phone", dark=False)
            page.get(address)
            yield page
        finally:
            page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
            page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_a_phone_shows_all_of_run_and_workspace(started_browser, studio):
    with on_a_phone(started_browser, studio[1]) as page:
        for panel in ("Workspace", "Run"):
            press(page, panel)
            wait_for(page, STARTS)
            wait_for(page, "innerWidth < 400")
            assert page.execute_script(f"return {OUTSIDE}") == []
            assert page.execute_script(f"return {COVERED}") == []

"""Every tab in Chromium, wide and on a phone, light and dark: axe-core finds nothing serious,
everything can be reached and read."""

import pytest

from tests.chromium import cleared, wait_for
from tests.studio.axe import axe_file, grave
from tests.studio.pictures import look
from tests.studio.run_page import press

SHOWS = """(() => {
    const panels = [...document.querySelectorAll('.q-tab-panel')];
    return panels.length === 1 && panels[0].checkVisibility() &&
        panels[0].innerText.trim().length > 40 && document.getAnimations().every(
            one => one.playState !== 'running' || one.effect.getTiming().iterations === Infinity);
})()"""
"""One panel is there with its words; none comes in or goes."""

DARK = "document.body.classList.contains('body--dark')"

STARTS = "[...document.querySelectorAll('button')].some(e => e.checkVisibility() && \
e.innerText.includes('Start'))"

OUTSIDE = """[...document.querySelectorAll('.studio-panels button, .studio-panels .q-field')]
    .filter(e => e.checkVisibility() && e.getBoundingClientRect().right > innerWidth + 1)
    .map(e => e.ariaLabel || e.innerText)"""
"""What of a panel lies beside the window."""

COVERED = """(() => {
    const shown = (kind) => [...document.querySelectorAll(kind)]
        .filter(e => e.checkVisibility() && e.innerText.trim() !== '');
    const meet = (a, b) => a.bottom > b.top + 1 && b.bottom > a.top + 1 &&
        a.right > b.left && b.right > a.left;
    return shown('.studio-form .q-field__messages').filter(
        hint => shown('.studio-label, .studio-group .q-item__label').some(
            label => meet(hint.getBoundingClientRect(), label.getBoundingClientRect())))
        .map(hint => hint.innerText);
})()"""
"""Words below fields that other words lie on."""

FOCUS = """
const e = document.activeElement, field = e.closest('.q-field__control') || e;
const drawn = s => s.boxShadow.includes('0px 0px 0px 3px') ||
    parseFloat(s.outlineWidth) >= 3 && s.outlineStyle === 'solid';
return [e.ariaLabel || e.innerText || e.tagName, e.tagName === 'IFRAME' || e === document.body ||
    [e, field].some(one => drawn(getComputedStyle(one)))];
"""
"""What has the focus, and whether that is seen."""


@pytest.fixture(scope="module")
def page(started_browser, studio):
    axe_file()
    with cleared(started_browser) as browser:
        try:
            look(browser, "1280", dark=True)
            browser.get(studio[1])
            # As the browser likes it; the server knows, before the page follows by itself.
            wait_for(browser, f"{SHOWS} && {DARK} && Quasar.Dark.mode === true")
            # Nobody looks at the scene, which is drawn in software, sixty times a second.
            browser.execute_script("document.getElementById('scene').src = 'about:blank'")
            yield browser
        finally:
            browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
            browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def turn_to(page, title):
    """Opens a tab, and waits until it is there."""
    press(page, title)
    active = "document.querySelector('.q-tab--active .q-tab__label')?.textContent"
    wait_for(page, f"{active} === '{title}' && {SHOWS}")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("size", ["1280", "phone"])
def test_no_tab_has_serious_findings(page, size, dark):
    look(page, size, dark)
    if page.execute_script(f"return {DARK}") != dark:
        press(page, "Dark or light")
    wait_for(page, f"{DARK} === {str(dark).lower()}")
    wait_for(page, f"innerWidth {'<' if size == 'phone' else '>'} 400")
    titles = page.execute_script(
        "return [...document.querySelectorAll('.q-tab__label')].map(e => e.textContent)"
    )
    assert titles == ["Robot", "Pose", "Workspace", "Run", "Logs", "Studies", "Commands"]
    for title in titles:
        turn_to(page, title)
        assert grave(page) == [], title


@pytest.mark.parametrize("panel", ["Workspace", "Run"])
def test_a_phone_shows_all_of_a_panel(page, panel):
    look(page, "phone", dark=False)
    turn_to(page, panel)
    wait_for(page, f"{STARTS} && innerWidth < 400")
    assert page.execute_script(f"return [{OUTSIDE}, {COVERED}]") == [[], []]


def test_all_of_the_page_is_reached_by_keys_and_focus_is_seen(page):
    from selenium.webdriver import ActionChains, Keys

    look(page, "1280", dark=False)
    turn_to(page, "Studies")
    wait_for(page, "document.querySelector('input[aria-label=\"seeds\"]') !== null")
    page.execute_script("document.activeElement.blur()")
    seen = set()
    for _ in range(20):
        ActionChains(page).send_keys(Keys.TAB).perform()
        name, is_seen = page.execute_script(FOCUS)
        seen.add((name.split("\n")[0].strip(), is_seen))
    assert {("Dark or light", True), ("seeds", True)} <= seen
    assert any("More options" in name for name, _ in seen)  # Quasar says that it can be unfolded
    assert all(is_seen for _, is_seen in seen), seen


def test_axe_sees_what_is_wrong(page):
    turn_to(page, "Robot")
    page.execute_script(
        "document.querySelector('.q-tab-panel').append(document.createElement('button'))"
    )
    assert any("button-name" in line for line in grave(page))

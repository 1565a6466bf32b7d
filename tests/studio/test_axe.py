"""Every tab in Chromium, wide and on a phone, light and dark: axe-core finds nothing serious,
everything can be reached and read."""

import pytest

from tests.chromium import cleared, wait_for
from tests.studio import axe
from tests.studio.pictures import look
from tests.studio.run_page import press

TITLES = ("Robot", "Pose", "Workspace", "Run", "Logs", "Studies", "Commands")

SHOWS = """(() => {
    const panels = [...document.querySelectorAll('.q-tab-panel')];
    return panels.length === 1 && panels[0].checkVisibility() &&
        panels[0].innerText.trim().length > 40 && document.getAnimations().every(
            one => one.playState !== 'running' || one.effect.getTiming().iterations === Infinity);
})()"""
"""One panel is there with its words; none comes in or goes."""

DARK = "document.body.classList.contains('body--dark')"

CHOSEN_DARK = f"{DARK} && Quasar.Dark.mode === true"
"""The server knows what the browser likes; before, the page follows the browser by itself."""

STARTS = "[...document.querySelectorAll('button')].some(e => e.checkVisibility() && \
e.innerText.includes('Start'))"

NO_SCENE = "document.getElementById('scene').src = 'about:blank'"
"""Which nobody looks at here, and which is drawn in software otherwise, sixty times a second."""

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

FAULTS = """
const button = document.createElement('button');
const words = document.createElement('p');
words.textContent = 'hardly to be read';
words.style = 'color: #999; background: #fff';
document.querySelector('.q-tab-panel').append(button, words);
"""
"""A button without a name, and words with a contrast of 2.8."""


@pytest.fixture(scope="module")
def page(started_browser, studio):
    axe.axe_file()
    with cleared(started_browser) as browser:
        try:
            look(browser, "1280", dark=True)
            browser.get(studio[1])
            wait_for(browser, f"{SHOWS} && {CHOSEN_DARK}")  # as the browser likes it
            browser.execute_script(NO_SCENE)
            yield browser
        finally:
            browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
            browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def turn_to(page, title):
    """Opens a tab, and waits until it is there."""
    press(page, title)
    active = "(document.querySelector('.q-tab--active .q-tab__label') || {}).textContent"
    wait_for(page, f"{active} === '{title}' && {SHOWS}")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("size", ["1280", "phone"])
def test_no_tab_has_serious_findings(page, size, dark):
    look(page, size, dark)
    if page.execute_script(f"return {DARK}") != dark:
        press(page, "Dark or light")
    titles = page.execute_script(
        "return [...document.querySelectorAll('.q-tab__label')].map(e => e.textContent)"
    )
    assert titles == list(TITLES)
    wait_for(page, f"{DARK} === {str(dark).lower()}")
    wait_for(page, f"innerWidth {'<' if size == 'phone' else '>'} 400")
    found = {}
    for title in TITLES:
        turn_to(page, title)
        found[title] = axe.grave(page)
    assert found == {title: [] for title in TITLES}


@pytest.mark.parametrize("panel", ["Workspace", "Run"])
def test_a_phone_shows_all_of_a_panel(page, panel):
    look(page, "phone", dark=False)
    turn_to(page, panel)
    wait_for(page, STARTS)
    wait_for(page, "innerWidth < 400")
    assert page.execute_script(f"return {OUTSIDE}") == []
    assert page.execute_script(f"return {COVERED}") == []


def test_all_of_the_page_is_reached_by_keys_and_focus_is_seen(page):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    look(page, "1280", dark=False)
    turn_to(page, "Studies")
    wait_for(page, "document.querySelector('input[aria-label=\"seeds\"]') !== null")
    page.execute_script("document.activeElement.blur()")
    seen, unseen = set(), []
    for _ in range(20):
        ActionChains(page).send_keys(Keys.TAB).perform()
        name, outline = page.execute_script(
            "const e = document.activeElement, f = e.closest('.q-field__control') || e;"
            "const drawn = s => s.boxShadow.includes('0px 0px 0px 3px') ||"
            " parseFloat(s.outlineWidth) >= 3 && s.outlineStyle === 'solid';"
            "return [e.ariaLabel || e.innerText || e.tagName, "
            "e.tagName === 'IFRAME' || e === document.body || [e, f].some("
            "  one => drawn(getComputedStyle(one)))]"
        )
        seen.add(name.split("\n")[0].strip())
        if not outline:
            unseen.append(name)
    assert {"Dark or light", "seeds"} <= seen
    assert any("More options" in name for name in seen), seen  # Quasar says that it can be unfolded
    assert unseen == []


def test_axe_sees_what_is_wrong(page):
    look(page, "1280", dark=False)
    turn_to(page, "Robot")
    page.execute_script(FAULTS)
    rules = {line.partition(":")[0] for line in axe.grave(page)}
    page.refresh()  # which others use
    wait_for(page, "document.querySelectorAll('.q-tab').length > 0")
    assert {"button-name", "color-contrast"} <= rules

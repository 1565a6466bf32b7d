"""axe-core finds nothing serious in any tab, wide and on a phone, light and dark."""

import pytest

from tests.chromium import cleared, wait_for
from tests.studio import axe
from tests.studio.pictures import look
from tests.studio.run_page import press

TITLES = ("Robot", "Pose", "Workspace", "Run", "Logs", "Studies")

SHOWS = """[...document.querySelectorAll('.q-tab-panel')]
    .some(e => e.checkVisibility() && e.innerText.trim().length > 40)"""
"""A panel is there with its words."""

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
            yield browser
        finally:
            browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
            browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("size", ["1280", "phone"])
def test_no_tab_has_serious_findings(page, studio, size, dark):
    look(page, size, dark)
    page.execute_cdp_cmd("Network.clearBrowserCookies", {})  # a session keeps its theme
    page.get(studio[1])
    wait_for(page, "document.querySelectorAll('.q-tab').length > 0")
    titles = page.execute_script(
        "return [...document.querySelectorAll('.q-tab__label')].map(e => e.textContent)"
    )
    assert titles == list(TITLES)
    wait_for(page, f"document.body.classList.contains('body--dark') === {str(dark).lower()}")
    found = {}
    for title in TITLES:
        press(page, title)
        wait_for(page, SHOWS)
        found[title] = axe.grave(page)
    assert found == {title: [] for title in TITLES}


def test_axe_sees_what_is_wrong(page, studio):
    look(page, "1280", dark=False)
    page.get(studio[1])
    wait_for(page, SHOWS)
    page.execute_script(FAULTS)
    rules = {line.partition(":")[0] for line in axe.grave(page)}
    assert {"button-name", "color-contrast"} <= rules


def test_all_of_the_page_is_reached_by_keys_and_focus_is_seen(page, studio):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    look(page, "1280", dark=False)
    page.get(studio[1])
    wait_for(page, SHOWS)
    press(page, "Studies")
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

"""The studio in a real browser, as a user has it: one server, one browser, one thing at a time.

Then every tab wide and on a phone, light and dark: axe-core finds nothing serious, contrast of
words included; everything can be reached and read. At last a run, and the end of its server.
"""

import json
from contextlib import suppress

import pytest
from selenium.common.exceptions import TimeoutException
from selenium.webdriver import ActionChains, Keys

from cdpr_drake.studio.panel import PANELS
from tests.chromium import LONGEST_WAIT, axe_file, cleared, complaints, grave, wait_for
from tests.models.formats.foreign_files import caspr
from tests.studio.pictures import DRAWN, POINT, VIEWER, look
from tests.studio.served import FRAMES, LONGEST_START, press, served, text_of, write_scenario

SAYS = "document.body.innerText.includes('{}')"

NEAR = {"position: 0.0003": "position: 0.27", "rotation_deg: 0.5": "rotation_deg: 60.0"}
"""A goal that the run comes to within a second of simulated time."""

CAMERA = "(document.querySelector('.cdpr-camera img') || {}).naturalWidth > 100"
INK = """(() => {
    const canvas = document.querySelector('.cdpr-plot canvas');
    const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    let blue = 0;
    for (let k = 0; k < pixels.length; k += 4)
        blue += pixels[k + 3] > 128 && pixels[k + 2] > pixels[k] + 100;
    return blue;
})()"""
"""Pixels of the first curve, which is blue, in the first chart."""

FIELD = "document.querySelector('input[aria-label=\"{}\"]')"

TENSIONS = "[...document.querySelectorAll('.studio-cables tbody tr')]\
.map(row => row.children[2].textContent).join()"

DRAG = f"""{POINT}
const there = scene.contentDocument.elementFromPoint(x, y);
if (there !== canvas) return 'in front of the scene: ' + there?.outerHTML;
canvas.setPointerCapture = () => {{}};  // browsers refuse pointers that a script makes up
for (const [kind, by] of [['down', 0], ['move', -20], ['move', -40], ['up', -40]])
    canvas.dispatchEvent(new scene.contentWindow.PointerEvent('pointer' + kind, {{
        clientX: x + by, clientY: y, button: 0, pointerId: 1, bubbles: true}}));
delete canvas.setPointerCapture;
return 'dragged';
"""
"""Drags the exit point of C2 by 40 px to the left, and tells whether that was possible.

All in one go, between two pictures: events of a real mouse come later than the place was looked up,
when the camera or the point may have moved on.
"""

DARK = "document.body.classList.contains('body--dark')"

SHOWS = """(() => {
    const panels = [...document.querySelectorAll('.q-tab-panel')];
    return panels.length === 1 && panels[0].checkVisibility() &&
        panels[0].innerText.trim().length > 40 && document.getAnimations().every(
            one => one.playState !== 'running' || one.effect.getTiming().iterations === Infinity);
})()"""
"""One panel is there with its words; none comes in or goes."""

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
    with cleared(started_browser) as browser:
        try:
            look(browser, "1280", dark=True)
            browser.get(studio[1])
            # As the browser likes it; the server knows, before the page follows by itself.
            wait_for(browser, f"{SHOWS} && {DARK} && Quasar.Dark.mode === true")
            yield browser
        finally:
            browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
            browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


@pytest.fixture(scope="module")
def still(page):
    """The page without the scene, which is drawn in software, with a value that is refused."""
    axe_file()
    page.execute_script("document.getElementById('scene').src = 'about:blank'")
    press(page, "Robot")
    type_into(page, "cables 0 exit point x", "wrong")
    wait_for(page, SAYS.format("found wrong"))
    return page


def type_into(page, label, words):
    """Types words into the field of a label, and presses Enter, with real keys."""
    wait_for(page, f"{FIELD.format(label)} !== null")
    field = page.find_element("css selector", f'input[aria-label="{label}"]')
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", field)
    field.send_keys(Keys.CONTROL, "a")
    field.send_keys(words, Keys.ENTER)


def turn_to(page, title):
    """Opens a tab, and waits until it is there."""
    press(page, title)
    active = "document.querySelector('.q-tab--active .q-tab__label')?.textContent"
    wait_for(page, f"{active} === '{title}' && {SHOWS}")


def test_a_workspace_is_computed_and_drawn(page):
    press(page, "Workspace")
    type_into(page, "grid", "5,5,5")
    press(page, "Start")
    wait_for(page, "document.querySelectorAll('[aria-label=Workspaces] tbody tr').length === 1")
    solid = f"{VIEWER}?.scene_tree.find(['drake', 'workspaces', 'static', '<object>']).object"
    wait_for(page, f"{solid}?.isMesh && {solid}.material.depthWrite === false")


def test_an_exit_point_is_typed_and_saved_and_tensions_follow(page, studio):
    x = "cables 0 exit point x"
    press(page, "Pose")
    before = wait_for(page, f"{TENSIONS}.split(',').length === 8 && {TENSIONS}")
    press(page, "Robot")
    type_into(page, x, "wrong")
    wait_for(page, SAYS.format("found wrong; accepted: 3 numbers"))
    type_into(page, x, "-0.37")
    wait_for(page, f"!{SAYS.format('found wrong')}")
    press(page, "Save as")
    type_into(page, "Name", "moved.yaml")
    wait_for(page, SAYS.format("saved as moved.yaml"))
    assert "-0.37" in (studio[0] / "moved.yaml").read_text()
    press(page, "Pose")
    wait_for(page, f"{TENSIONS}.split(',').length === 8 && {TENSIONS} !== '{before}'")
    page.refresh()
    press(page, "Robot")
    wait_for(page, f"{FIELD.format(x)}?.value === '-0.37' && {SAYS.format('moved.yaml')}")


def test_a_point_is_dragged_with_the_mouse(page):
    x = f"{FIELD.format('cables 1 exit point x')}?.value"
    press(page, "Robot")
    for patience in (60.0, LONGEST_WAIT):  # a busy browser may lose its page, which comes anew
        wait_for(page, f"{x} && {DRAWN}")
        assert page.execute_script(DRAG) == "dragged"
        with suppress(TimeoutException):
            wait_for(page, f"{x} < -0.53", patience)
            break
    else:
        pytest.fail("it was dragged twice")
    press(page, "Undo, Ctrl-Z")
    wait_for(page, f"{x} == -0.52")


def test_a_foreign_robot_is_uploaded_and_nothing_is_wanted_from_a_network(page, tmp_path):
    caspr(tmp_path)
    press(page, "Open")
    wait_for(page, "document.querySelector('input[type=file]') !== null")
    field = page.find_element("css selector", "input[type=file]")
    field.send_keys("\n".join(str(path) for path in sorted(tmp_path.glob("*.xml"))))
    wait_for(page, "document.querySelector('.studio-title').textContent.startsWith('toy')")
    wait_for(page, SAYS.format("read as CASPR"))
    assert not complaints(page)
    sources = page.execute_script(
        "return performance.getEntriesByType('resource').map(entry => entry.name)"
    )
    assert all(source.startswith((page.current_url, "data:", "blob:")) for source in sources)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("size", ["1280", "phone"])
def test_no_tab_has_serious_findings(still, size, dark):
    look(still, size, dark)
    if still.execute_script(f"return {DARK}") != dark:
        press(still, "Dark or light")
    wide = "<" if size == "phone" else ">"
    wait_for(still, f"{DARK} === {str(dark).lower()} && innerWidth {wide} 400")
    for panel in PANELS.values():
        turn_to(still, panel.title)
        assert grave(still) == [], panel.title


@pytest.mark.parametrize("panel", ["Workspace", "Run"])
def test_a_phone_shows_all_of_a_panel(still, panel):
    look(still, "phone", dark=False)
    turn_to(still, panel)
    wait_for(still, f"{SAYS.format('Start')} && innerWidth < 400")
    assert still.execute_script(f"return [{OUTSIDE}, {COVERED}]") == [[], []]


def test_all_of_the_page_is_reached_by_keys_and_focus_is_seen(still):
    look(still, "1280", dark=False)
    turn_to(still, "Studies")
    wait_for(still, f"{FIELD.format('seeds')} !== null")
    still.execute_script("document.activeElement.blur()")
    seen = set()
    for _ in range(20):
        ActionChains(still).send_keys(Keys.TAB).perform()
        name, is_seen = still.execute_script(FOCUS)
        seen.add((name.split("\n")[0].strip(), is_seen))
    assert {("Dark or light", True), ("seeds", True)} <= seen
    assert any("More options" in name for name, _ in seen)  # Quasar says that it can be unfolded
    assert all(is_seen for _, is_seen in seen), seen


def test_axe_sees_what_is_wrong(still):
    turn_to(still, "Robot")
    still.execute_script(
        "document.querySelector('.q-tab-panel').append(document.createElement('button'))"
    )
    assert any("button-name" in line for line in grave(still))


def test_a_run_converges_before_the_eyes_and_another_one_ends_with_the_server(
    tmp_path, started_browser
):
    scenario = write_scenario(tmp_path, **NEAR)
    size = 1280, 1000
    with cleared(started_browser, size) as page, served(tmp_path, str(scenario)) as (address, _):
        page.get(address)
        press(page, "Run")
        wait_for(page, "document.querySelector('[aria-label=duration]') !== null")
        press(page, "Start")
        wait_for(page, f"{FRAMES}[1] > 3", LONGEST_START)
        wait_for(page, CAMERA)
        wait_for(page, f"{text_of('.cdpr-outcome')} === 'converged'")
        wait_for(page, f"{text_of('.cdpr-state')} === 'finished'")
        wait_for(page, f"{INK} > 50")
        assert not complaints(page)
        done = tmp_path / "runs" / "acrobot_pbvs"
        assert json.loads((done / "summary.json").read_text())["outcome"] == "converged"
        page.execute_script("document.querySelector('.cdpr-run .q-checkbox').click()")
        press(page, "Start")
        wait_for(page, f"{text_of('.cdpr-state')} === 'paused'", LONGEST_START)
        page.refresh()
        wait_for(page, f"{text_of('.cdpr-state')} === 'paused' && {FRAMES}[1] > 0")
    left = json.loads((tmp_path / "runs" / "acrobot_pbvs-2" / "summary.json").read_text())
    assert left["outcome"] == "interrupted"

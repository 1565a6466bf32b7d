"""The studio in a real browser, as a user has it: one server, one browser, one thing at a time."""

from contextlib import suppress

import pytest

from tests.chromium import LONGEST_WAIT, cleared, complaints, wait_for
from tests.models.formats.foreign_files import caspr
from tests.studio.run_page import press

SAYS = "document.body.innerText.includes('{}')"

FIELD = "document.querySelector('input[aria-label=\"{}\"]')"

TENSIONS = "[...document.querySelectorAll('.studio-cables tbody tr')]\
.map(row => row.children[2].textContent).join()"

VIEWER = "document.getElementById('scene')?.contentWindow.viewer"

DRAWN = f"""({VIEWER}?.scene_tree.find(['drake', 'studio', 'exit', '7']).object !== undefined &&
    Object.keys({VIEWER}.scene_tree.find(['drake', 'cables']).children).length === 8 &&
    {VIEWER}.renderer.domElement.studioListens)"""
"""The robot is in the scene, which follows the mouse."""

DRAG = """
const scene = document.getElementById('scene'), viewer = scene.contentWindow.viewer;
const canvas = viewer.renderer.domElement;
viewer.scene.updateMatrixWorld(true);
viewer.camera.updateMatrixWorld(true);
const point = viewer.scene_tree.find(['drake', 'studio', 'exit', '1']).object;
const p = point.position.clone().setFromMatrixPosition(point.matrixWorld).project(viewer.camera);
const box = canvas.getBoundingClientRect();
const x = box.left + (p.x + 1) / 2 * box.width, y = box.top + (1 - p.y) / 2 * box.height;
const there = scene.contentDocument.elementFromPoint(x, y);
if (there !== canvas) return 'in front of the scene: ' + there?.outerHTML;
canvas.setPointerCapture = () => {};  // browsers refuse pointers that a script makes up
for (const [kind, by] of [['down', 0], ['move', -20], ['move', -40], ['up', -40]])
    canvas.dispatchEvent(new scene.contentWindow.PointerEvent('pointer' + kind, {
        clientX: x + by, clientY: y, button: 0, pointerId: 1, bubbles: true}));
delete canvas.setPointerCapture;
return 'dragged';
"""
"""Drags the exit point of C2 by 40 px to the left, and tells whether that was possible.

All in one go, between two pictures: events of a real mouse come later than the place was looked up,
when the camera or the point may have moved on.
"""


@pytest.fixture(scope="module")
def page(started_browser, studio):
    with cleared(started_browser) as browser:
        browser.get(studio[1])
        yield browser


def type_into(page, label, words):
    """Types words into the field of a label, and presses Enter, with real keys."""
    from selenium.webdriver import Keys

    wait_for(page, f"{FIELD.format(label)} !== null")
    field = page.find_element("css selector", f'input[aria-label="{label}"]')
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", field)
    field.send_keys(Keys.CONTROL, "a")
    field.send_keys(words, Keys.ENTER)


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
    wait_for(page, f"{TENSIONS}.split(',').length === 8")
    before = page.execute_script(f"return {TENSIONS}")
    press(page, "Robot")
    type_into(page, x, "wrong")
    wait_for(page, SAYS.format("found wrong; accepted: 3 numbers"))
    type_into(page, x, "-0.37")
    wait_for(page, f"!{SAYS.format('found wrong')}")
    press(page, "Save as")
    type_into(page, "Name", "moved.yaml")
    wait_for(page, SAYS.format("saved as moved.yaml"))
    press(page, "Pose")
    wait_for(page, f"{TENSIONS}.split(',').length === 8 && {TENSIONS} !== '{before}'")
    text = (studio[0] / "moved.yaml").read_text()
    page.refresh()
    wait_for(page, SAYS.format("moved.yaml"))
    press(page, "Robot")
    wait_for(page, f"{FIELD.format(x)}?.value === '-0.37'")
    press(page, "Save")
    wait_for(page, SAYS.format("saved as moved.yaml"))
    assert (studio[0] / "moved.yaml").read_text() == text


def test_a_point_is_dragged_with_the_mouse(page):
    from selenium.common.exceptions import TimeoutException

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


def test_a_foreign_robot_is_uploaded(page, tmp_path):
    caspr(tmp_path)
    press(page, "Open")
    wait_for(page, "document.querySelector('input[type=file]') !== null")
    field = page.find_element("css selector", "input[type=file]")
    field.send_keys("\n".join(str(path) for path in sorted(tmp_path.glob("*.xml"))))
    wait_for(page, "document.querySelector('.studio-title').textContent.startsWith('toy')")
    wait_for(page, SAYS.format("read as CASPR"))


def test_nothing_is_wanted_from_a_network(page):
    assert not complaints(page)
    sources = page.execute_script(
        "return performance.getEntriesByType('resource').map(entry => entry.name)"
    )
    assert all(source.startswith((page.current_url, "data:", "blob:")) for source in sources)

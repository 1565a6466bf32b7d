"""The replay page in a real browser: time, tensions and camera against the log."""

import numpy as np
import pytest
from pydrake.geometry import Box, Rgba

from cdpr_drake.analyses.visualization.replay import RobotPicture, write_replay
from cdpr_drake.analyses.visualization.replay_page import CameraView
from cdpr_drake.analyses.visualization.shown_things import ShownThing, ShownView, Surroundings
from cdpr_drake.analyses.visualization.solids import add_solid
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import CAMERA, SLACK, TENSIONS, nth_look, rgb
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.workspaces.volume import surface_quads, triangles
from tests.chromium import cleared, complaints, wait_for

PINHOLE = Pinhole.from_view_angles(640, 480, 1.0, 0.8)
FLOAT32 = 1e-6
"""Relative: the page keeps tensions in single precision."""

SHADES = 12
"""Change of a pixel's channel, of 255, that is another layer and not a face's shade: without
depth there were changes up to 11, with it 1900 pixels had larger ones, up to 45."""


@pytest.fixture(scope="module")
def browser(started_browser):
    with cleared(started_browser) as page:
        yield page


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    robot, path = load_robot("acrobot_small"), tmp_path_factory.mktemp("page") / "replay.html"
    times = np.arange(76) * 0.04
    poses = [pose_from_angles([0.1 * np.sin(t), 0.1, 0.3], np.zeros(3)) for t in times]
    tensions = 5.0 + 3.0 * np.sin(times[:, None] + np.arange(8))
    tensions[30:40, 2] = 0.0
    corners = np.array([300.0, 200, 340, 200, 340, 240, 300, 240])
    log = {
        "time": times,
        "X_WP": np.array([pose_row(pose) for pose in poses]),
        "tensions": tensions,
        "corners_px": corners + 20.0 * times[:, None],
        "found": (times[:, None] < 2.0).astype(float),
    }
    view = CameraView(
        pinhole=PINHOLE, kind="projected", mark="corners", desired=[(0.0, corners + 60.0)]
    )
    camera = CameraMounting(pose_from_angles([0.0, 0.0, 0.0], [np.pi, 0.0, 0.0])), PINHOLE
    write_replay(path, robot, log, camera=camera, view=view, title="a run")
    return path, log


LEFT_EDGE = """
    const chart = document.getElementById("cdpr-plot");
    return [...chart.getContext("2d").getImageData(0, 0, 1, chart.height).data];
"""
"""Pixels of the first column of the chart of tensions."""


def opened(browser, path, at=""):
    browser.get("about:blank")
    browser.get(f"file://{path}{at}")
    wait_for(browser, "viewer.animator.actions.length > 0 && viewer.animator.playing === false")
    return browser


def shown_time(browser):
    return float(browser.find_element("id", "cdpr-time").text.split()[0])


def shown_tensions(browser):
    return np.array(
        browser.execute_script(
            "return [...document.querySelectorAll('.cdpr-value b')]"
            ".map((cell) => Number(cell.dataset.newtons))"
        )
    )


def colors_of(browser, cells, side):
    """Colours of borders, in the order of the cables."""
    return browser.execute_script(
        f"return [...document.querySelectorAll('{cells}')]"
        f".map((cell) => getComputedStyle(cell).border{side}Color)"
    )


def css(color):
    return f"rgb({', '.join(f'{255.0 * channel:.0f}' for channel in rgb(color))})"


def scene_color(log, row, cable):
    """Of a cable in the scene: red if it is slack, else by its tension."""
    tension, most = log["tensions"][row, cable], np.max(log["tensions"])
    level = min(int(len(TENSIONS) * tension / most), len(TENSIONS) - 1)
    return css(SLACK if tension <= 0.0 else TENSIONS[level])


def press(browser, *keys):
    from selenium.webdriver.common.action_chains import ActionChains

    ActionChains(browser).send_keys(*keys).perform()
    browser.execute_async_script(  # two frames, after which all that changed is drawn
        "const done = arguments[0];requestAnimationFrame(() => requestAnimationFrame(() => done()))"
    )


def scrub(browser, time):
    browser.execute_async_script(
        "const [time, done] = arguments, axis = document.getElementById('cdpr-axis');"
        "axis.value = time; axis.dispatchEvent(new Event('input'));"
        "requestAnimationFrame(() => requestAnimationFrame(() => done()))",
        time,
    )


def platform_x(browser):
    """Where the scene has the platform, in W [m]."""
    return browser.execute_script(
        "viewer.scene.updateMatrixWorld(true); let x = null;"
        "viewer.scene.traverse((node) => { if (x === null && node.name === 'platform') {"
        "x = viewer.scene.matrixWorld.clone().invert().multiply(node.matrixWorld).elements[12]"
        "} }); return x"
    )


def test_scrubbing_shows_the_time_and_tensions_of_the_log(browser, run):
    path, log = run
    opened(browser, path, "#t=0")
    for wanted in (1.4, 0.613, 2.999):
        scrub(browser, wanted)
        row = int(np.argmin(np.abs(log["time"] - wanted)))
        assert shown_time(browser) == pytest.approx(log["time"][row], abs=0.005)
        np.testing.assert_allclose(shown_tensions(browser), log["tensions"][row], rtol=FLOAT32)
        # The scene interpolates between frames, which are 1 ms early at most.
        assert platform_x(browser) == pytest.approx(log["X_WP"][row, 4], abs=2e-4)
        image = browser.find_element("id", "cdpr-image")
        assert image.get_attribute("data-found") == str(int(log["found"][row, 0]))
        colors = colors_of(browser, ".cdpr-value b", "Right")
        assert colors == [scene_color(log, row, k) for k in range(8)]
        # A name in the scene has the colour of its curve, whatever its tension is.
        names = colors_of(browser, ".cdpr-name", "Bottom")
        assert names == [css(nth_look(k).color) for k in range(8)]
    scrub(browser, 1.4)
    slack = browser.find_elements("css selector", ".cdpr-value.cdpr-slack")
    assert [cell.text.split()[:2] for cell in slack] == [["C3", "slack"]]
    assert not any(browser.execute_script(LEFT_EDGE)), "a label of the chart is cut off"
    assert complaints(browser) == []


def test_keys_step_jump_play_and_pause(browser, run):
    from selenium.webdriver.common.keys import Keys

    path, log = run
    opened(browser, path, "#t=1")
    for keys, row in (((Keys.ARROW_RIGHT,), 26), ((Keys.ARROW_LEFT,) * 2, 24), ((Keys.END,), 75)):
        press(browser, *keys)
        assert shown_time(browser) == pytest.approx(log["time"][row], abs=0.005)
    press(browser, Keys.HOME)
    assert shown_time(browser) == 0.0
    press(browser, *(Keys.ARROW_DOWN,) * 3)  # slowly, so that it is not at the end before a pause
    assert browser.find_element("id", "cdpr-speed").get_attribute("value") == "0.1"
    press(browser, Keys.SPACE)
    wait_for(browser, "parseFloat(document.getElementById('cdpr-time').textContent) > 0")
    press(browser, Keys.SPACE)
    stopped = shown_time(browser)
    press(browser)
    assert shown_time(browser) == stopped
    assert np.min(np.abs(log["time"] - stopped)) < 0.005


@pytest.mark.parametrize(("width", "theme"), [(390, "light"), (1280, "dark"), (1920, "light")])
def test_nothing_is_cut_off_at_any_width(browser, run, width, theme):
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    scheme = {"features": [{"name": "prefers-color-scheme", "value": theme}]}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", scheme)
    try:
        opened(browser, run[0], "#t=1")
        press(browser)
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
        boxes = browser.execute_script(
            "return ['meshcat-pane', 'cdpr-plot', 'cdpr-image', 'cdpr-deck', 'cdpr-values'].map("
            "(id) => { const b = document.getElementById(id).getBoundingClientRect();"
            "return [b.left, b.right, b.width, b.height]; })"
        )
        for left, right, wide, high in boxes:
            assert left >= 0.0
            assert right <= width
            assert wide > 200.0
            assert high > 40.0
        dark = browser.execute_script(
            "return document.documentElement.classList.contains('cdpr-dark')"
        )
        assert dark == (theme == "dark")
        assert painted_share(browser) > 0.002
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def pixels(browser, before=""):
    """What the scene's canvas shows after a change, as numbers of its pixels."""
    flat = browser.execute_script(
        f"{before}; viewer.render(); const from = viewer.renderer.domElement;"
        "const to = document.createElement('canvas'); to.width = 320; to.height = 200;"
        "const pen = to.getContext('2d'); pen.drawImage(from, 0, 0, 320, 200);"
        "return [...pen.getImageData(0, 0, 320, 200).data]"
    )
    return np.array(flat).reshape(-1, 4)[:, :3]


def painted_share(browser):
    """Share of the scene in colours, as platform and cables are: WebGL draws, also in software."""
    return float(np.mean(np.ptp(pixels(browser), axis=1) > 60))


def test_a_transparent_solid_looks_the_same_in_whatever_order_its_triangles_are_drawn(
    browser, tmp_path
):
    """Triangles drawn first once hid what is behind them: patches with ragged, dark edges."""
    robot = load_robot("acrobot_small")
    across = np.linspace(-0.4, 0.4, 9)
    axes = across, across, np.linspace(0.1, 0.8, 9)
    x, y, z = np.meshgrid(*axes, indexing="ij")
    ring = (np.hypot(x, z - 0.45) > 0.15) & (np.hypot(x, z - 0.45) < 0.37) & (np.abs(y) < 0.31)
    picture = RobotPicture(robot, 0.0)
    picture.draw(robot.home.transform(), np.zeros(8))
    solid = triangles(surface_quads(ring, axes))
    add_solid(picture.meshcat, "workspaces/ring", *solid, Rgba(0.2, 0.6, 0.4, 0.5))
    page = tmp_path / "still.html"
    page.write_text(picture.html())
    browser.get(f"file://{page}")
    find = (
        "let solid = null; viewer.scene.traverse((node) => { if (node.isMesh "
        "&& node.material.transparent) { solid = node; } });"
    )
    wait_for(browser, f"(() => {{ {find} return solid !== null && !solid.material.depthWrite }})()")
    turned = (
        f"{find} const index = solid.geometry.index; index.array.reverse(); "
        "for (let k = 0; k < index.count; k += 3) { const first = index.array[k];"
        "index.array[k] = index.array[k + 1]; index.array[k + 1] = first; }"
        "index.needsUpdate = true"
    )

    def changed(one, other):
        return int(np.sum(np.max(np.abs(one - other), axis=1) > SHADES))

    def write_depth(wanted):
        return f"{find} solid.material.depthWrite = {wanted}"

    near = pixels(browser, "viewer.camera.zoom = 3; viewer.controls.target.set(0, 0.45, 0)")
    assert changed(near, pixels(browser, turned)) == 0
    assert changed(pixels(browser, write_depth("true")), pixels(browser, turned)) > 500
    assert complaints(browser) == []


def test_things_are_there_while_the_log_says_so_and_go_with_the_platform(browser, run, tmp_path):
    """A plate that lies over a tag for a while, and the view of a camera."""
    robot, (_, log) = load_robot("acrobot_small"), run
    hidden = (log["time"] > 1.0) & (log["time"] < 2.0)
    things = (
        ShownThing("plate", Box(0.1, 0.1, 0.001), while_positive="hidden"),
        ShownView("eye", "view of an eye", PINHOLE, CAMERA, quantity="X_WP"),
    )
    path = tmp_path / "replay.html"
    log = {**log, "hidden": hidden[:, None].astype(float)}
    write_replay(path, robot, log, around=Surroundings(things=things))
    script = """const found = {};
        viewer.scene.traverse((node) => { if (["plate", "eye"].includes(node.name)) {
            const at = node.getWorldPosition(node.position.clone());
            found[node.name] = [node.visible, at.x, -at.z, at.y];  // the page has y upwards
        } });
        return found"""
    for time, there in ((0.0, False), (1.52, True), (2.52, False)):
        page = opened(browser, path, f"#t={time}")
        assert shown_time(page) == pytest.approx(time)
        found = page.execute_script(script)
        assert found["plate"][0] is there
        row = np.argmin(np.abs(log["time"] - time))
        assert found["eye"][0] is True
        np.testing.assert_allclose(found["eye"][1:], log["X_WP"][row, 4:], atol=1e-3)
    assert "view of an eye" in page.find_element("tag name", "body").text
    assert complaints(page) == []

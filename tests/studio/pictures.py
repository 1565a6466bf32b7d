"""Pictures of the studio to be looked at: each tab, with results also at full length, and dialogs.

`python -m tests.studio.pictures FOLDER`, or `FOLDER --guide`: those of docs/guides/studio.md too.
"""

import json
import subprocess
import sys
import tempfile
import time
from itertools import product
from pathlib import Path

from PIL import Image
from selenium.webdriver import Keys

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.boards import ASKED, write_asked
from cdpr_drake.studio.panel import PANELS
from cdpr_drake.studio.results import subject_of
from tests.chromium import chromium, wait_for
from tests.studio.served import press, served, text_of

SIZES = {"1280": (1280, 800), "phone": (390, 844)}

IMAGES = Path(__file__).parents[2] / "docs" / "images"
GUIDE = {
    "robot_1280_light": "studio", "robot_1280_dark": "studio_dark",
    "logs_1280_light": "studio_logs", "drag_1280_light": "studio_drag",
}  # fmt: skip
"""Pictures of the guide, by those of the folder."""

VIEWER = "document.getElementById('scene')?.contentWindow.viewer"

DRAWN = f"""({VIEWER}?.scene_tree.find(['drake', 'studio', 'exit', '7']).object !== undefined &&
    Object.keys({VIEWER}.scene_tree.find(['drake', 'cables']).children).length === 8 &&
    {VIEWER}.renderer.domElement.studioListens)"""
"""A robot of eight cables is in the scene, which follows the mouse."""

POINT = """
const scene = document.getElementById('scene'), viewer = scene.contentWindow.viewer;
const canvas = viewer.renderer.domElement;
viewer.scene.updateMatrixWorld(true);
viewer.camera.updateMatrixWorld(true);
const point = viewer.scene_tree.find(['drake', 'studio', 'exit', '1']).object;
const p = point.position.clone().setFromMatrixPosition(point.matrixWorld).project(viewer.camera);
const box = canvas.getBoundingClientRect();
const x = box.left + (p.x + 1) / 2 * box.width, y = box.top + (1 - p.y) / 2 * box.height;
"""
"""Where the exit point of C2 is in the scene's frame [px]."""

UNCHOSEN = """
const of = (e) => e.querySelector('.q-field__label')?.innerText;
return [...document.querySelectorAll('.q-tab-panel .q-select')].find(
    e => ['results', 'run'].includes(of(e)) && !e.querySelector('.q-field__native').innerText &&
        !e.querySelector('input')?.value)?.querySelector('.q-field__append');
"""
"""What unfolds the list of results in a tab that shows none."""

LONG = "return Math.max(document.querySelector('.q-tab-panel').scrollHeight + 60, \
innerWidth < 500 ? document.documentElement.scrollHeight : 0)"
"""Height of a tab with all that is in it [px]."""


def look(page, size, dark, height=0):
    """Gives the page a size and a liking for dark or light."""
    width, least = SIZES[size]
    page.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": max(height, least), "deviceScaleFactor": 1.0,
         "mobile": size == "phone"},
    )  # fmt: skip
    liking = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": liking})


def fill(folder):
    """A run, its log beside the model of its robot, a workspace and a study."""
    run = folder / "runs" / "acrobot_pbvs"
    for words in (
        ["workspace", "acrobot_small", "--grid=9,9,9", f"--out={folder / 'workspaces' / 'small'}"],
        ["simulate", "acrobot_pbvs", "--set=camera.kind=projected", "--set=duration=2.0",
         f"--out={run}"],
        ["replay", run / "log.csv", "--robot=acrobot_small", f"--out={folder / 'logs' / run.name}"],
    ):  # fmt: skip
        subprocess.run([sys.executable, "-m", "cdpr_drake", *words], check=True)
    study = folder / "studies" / "tension-methods"
    study.mkdir(parents=True)
    said = {"words": "methods agree", "printed": "1", "found": "1", "verdict": "confirmed"}
    (study / "results.json").write_text(json.dumps({"study": "x", "statements": [said]}))
    about = subject_of(load_robot("acrobot_small"))
    write_asked(folder / "logs" / f".acrobot_pbvs{ASKED}", (), about)


def photograph(page, size, dark, folder):
    """Takes pictures of all tabs and dialogs, and at last of an exit point that was moved."""

    def keep(name):
        time.sleep(4.0)  # fonts and numbers come
        kind = f"{size}_{'dark' if dark else 'light'}"
        page.save_screenshot(str(folder / f"{name.lower().replace(' ', '_')}_{kind}.png"))

    look(page, size, dark)
    wait_for(page, DRAWN)
    for panel in PANELS.values():
        press(page, panel.title)
        keep(panel.title)
        if unfold := page.execute_script(UNCHOSEN):
            unfold.click()
            wait_for(page, "document.querySelector('.q-menu .q-item') !== null")
            page.find_element("css selector", ".q-menu .q-item").click()
            time.sleep(4.0)
        look(page, size, dark, page.execute_script(LONG))
        keep(f"{panel.title}_whole")
        look(page, size, dark)
    press(page, "Robot")
    for words in ("Open", "Save as", "Export", "As text", "Add cable"):
        press(page, words)
        wait_for(page, "document.querySelector('.q-dialog') !== null")
        keep(f"dialog_{words}")
        page.find_element("css selector", "body").send_keys(Keys.ESCAPE)
        wait_for(page, "document.querySelector('.q-dialog') === null")
    field = page.find_element("css selector", 'input[aria-label="cables 0 exit point x"]')
    field.send_keys(Keys.CONTROL, "a")
    field.send_keys("-0.3", Keys.ENTER)
    wait_for(page, f"{text_of('.studio-live')}.includes('refined')")
    keep("drag")


def main(folder, guide=""):
    """Writes them."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        fill(Path(work))
        with served(work, "acrobot_small") as (address, _):
            for size, dark in product(SIZES, (False, True)):
                with tempfile.TemporaryDirectory() as profile, chromium(Path(profile)) as page:
                    page.get(address)
                    photograph(page, size, dark, folder)
    for name, of_guide in GUIDE.items() if guide else ():
        picture = Image.open(folder / f"{name}.png").convert("RGB")
        picture.save(IMAGES / f"{of_guide}.webp", quality=80, method=6)


if __name__ == "__main__":
    main(*sys.argv[1:])

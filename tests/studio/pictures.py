"""Pictures of the studio to be looked at: each tab with results at full length, and each dialog.

`python -m tests.studio.pictures FOLDER`, or with `--guide` the pictures of docs/guides/studio.md.
"""

import argparse
import io
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image
from selenium.webdriver import Keys

from cdpr_drake.analyses.logs.replay import replay_log
from cdpr_drake.analyses.runs.simulate import simulate
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.boards import ASKED, write_asked
from cdpr_drake.studio.results import subject_of
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.chromium import LONGEST_WAIT, chromium, wait_for
from tests.studio.run_page import press, text_of
from tests.studio.served import served

SIZES = {"1280": (1280, 800), "phone": (390, 844)}

IMAGES = Path(__file__).parents[2] / "docs" / "images"

CHOOSE = """
const of = (e) => e.querySelector('.q-field__label')?.innerText;
const field = [...document.querySelectorAll('.q-tab-panel .q-select')].find(
    e => ['results', 'run'].includes(of(e)) && !e.querySelector('.q-field__native').innerText &&
        !e.querySelector('input')?.value);
if (!field) return;
field.querySelector('.q-field__append').click();
setTimeout(() => document.querySelector('.q-menu .q-item')?.click(), 800);
"""
"""Shows a result in a tab that shows none."""

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
    words = ["workspace", "acrobot_small", "--grid=9,9,9", f"--out={folder / 'workspaces/small'}"]
    subprocess.run([sys.executable, "-m", "cdpr_drake", *words], check=True)
    study = folder / "studies" / "tension-methods"
    study.mkdir(parents=True)
    said = {"words": "methods agree", "printed": "1", "found": "1", "verdict": "confirmed"}
    (study / "results.json").write_text(json.dumps({"study": "x", "statements": [said]}))
    run = folder / "runs" / "acrobot_pbvs"
    simulate(load_scenario("acrobot_pbvs", ["camera.kind=projected", "duration=2.0"]), folder=run)
    replay_log(run / "log.csv", robot="acrobot_small", out=folder / "logs" / "acrobot_pbvs")
    about = {"robot": "acrobot_small", "digest": subject_of(load_robot("acrobot_small")).digest}
    write_asked(folder / "logs" / f".acrobot_pbvs{ASKED}", (), about)


def shot(page):
    """What the page looks like."""
    return Image.open(io.BytesIO(page.get_screenshot_as_png())).convert("RGB")


def keep(page, name):
    """Writes a picture of the guide, small, with cables that keep their colours."""
    shot(page).save(IMAGES / name, quality=80, method=6)


def wait_for_scene(page):
    """Returns once the robot is drawn; an empty scene is grey but for its axes."""
    end = time.monotonic() + LONGEST_WAIT
    coloured = 0
    while coloured < 800:
        if time.monotonic() > end:
            raise TimeoutError("the scene shows no robot")
        time.sleep(1.0)
        pixels = np.asarray(shot(page), int)
        scene = pixels[100:, pixels.shape[1] * 6 // 10 :]
        coloured = np.count_nonzero(np.ptp(scene, axis=2) > 60)


def tabs(page):
    """Turns to each tab, and waits until fonts and numbers are there."""
    labels = "[...document.querySelectorAll('.q-tab__label')].map(e => e.textContent)"
    for title in page.execute_script(f"return {labels}"):
        press(page, title)
        time.sleep(4.0)
        yield title.lower()


def photograph(page, size, dark, folder):
    """Takes pictures of all tabs and dialogs."""
    kind = f"{size}_{'dark' if dark else 'light'}.png"
    for name in tabs(page):
        page.execute_script(CHOOSE)
        time.sleep(4.0)
        look(page, size, dark, page.execute_script(LONG))
        time.sleep(1.0)
        page.save_screenshot(str(folder / f"{name}_{kind}"))
        look(page, size, dark)
    press(page, "Robot")
    for words in ("Open", "Save as", "Export", "As text", "Add cable"):
        press(page, words)
        wait_for(page, "document.querySelector('.q-dialog') !== null")
        time.sleep(1.0)
        page.save_screenshot(str(folder / f"dialog_{words.lower().replace(' ', '_')}_{kind}"))
        page.find_element("css selector", "body").send_keys(Keys.ESCAPE)
        wait_for(page, "document.querySelector('.q-dialog') === null")


def photograph_guide(page, dark):
    """Takes the pictures of the guide; the last has an exit point elsewhere, and its workspace."""
    wait_for_scene(page)
    names = {"robot": "studio_dark.webp"}
    if not dark:
        names = {"robot": "studio.webp", "logs": "studio_logs.webp"}
    for name in tabs(page):
        if name in names:
            keep(page, names[name])
    if not dark:
        press(page, "Robot")
        field = page.find_element("css selector", 'input[aria-label="cables 0 exit point x"]')
        field.send_keys(Keys.CONTROL, "a")
        field.send_keys("-0.3", Keys.ENTER)
        wait_for(page, f"{text_of('.studio-live')}.includes('refined')")
        time.sleep(4.0)
        keep(page, "studio_drag.webp")


def main():
    """Writes them."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", type=Path, nargs="?", default=IMAGES)
    options.add_argument("--guide", action="store_true")
    asked = options.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    looks = [(size, dark) for size in SIZES for dark in (False, True)]
    with tempfile.TemporaryDirectory() as folder:
        fill(Path(folder))
        with served(folder, "acrobot_small") as (address, _):
            for size, dark in looks[: 2 if asked.guide else None]:
                with tempfile.TemporaryDirectory() as profile, chromium(Path(profile)) as page:
                    look(page, size, dark)
                    page.get(address)
                    wait_for(page, "document.querySelectorAll('.q-tab').length > 0")
                    if asked.guide:
                        photograph_guide(page, dark)
                    else:
                        photograph(page, size, dark, asked.folder)


if __name__ == "__main__":
    main()

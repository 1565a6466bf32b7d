"""Pictures of the studio to be looked at: each tab with results at full length, and each dialog.

`python -m tests.studio.pictures FOLDER`, or with `--guide` the pictures of docs/guides/studio.md.
"""

from __future__ import annotations

import argparse
import io
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from selenium.webdriver.common.keys import Keys

from cdpr_drake.analyses.logs.replay import replay_log
from cdpr_drake.analyses.runs.simulate import simulate
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.boards import ASKED, write_asked
from cdpr_drake.studio.results import subject_of
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.chromium import LONGEST_WAIT, chromium, wait_for
from tests.studio.run_page import press
from tests.studio.served import served

SIZES = {"1280": (1280, 800, 1.0), "phone": (390, 844, 1.0)}
DIALOGS = ("Open", "Save as", "Export", "As text", "Add cable")
"""Buttons of the tab Robot that open one."""

IMAGES = Path(__file__).parents[2] / "docs" / "images"
GUIDE = {
    ("robot", False): "studio.webp", ("robot", True): "studio_dark.webp",
    ("logs", False): "studio_logs.webp",
}  # fmt: skip
"""Pictures of the guide by panel and whether they are dark."""

DRAGGED = "studio_drag.webp"
"""Picture of the guide with an exit point elsewhere, and the workspace that follows."""

MOVED = "cables 0 exit point x"
"""Name of the field that moves it."""

QUALITY = 80
"""Of the guide's pictures, so that they stay small and cables keep their colours."""
SETTLED = 4.0
"""Until fonts and numbers are there [s]."""

COLOURED = 800
"""So many pixels have a colour in a scene with a robot; an empty one is grey but for its axes."""


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


def look(page: Any, size: str, dark: bool, height: int = 0) -> None:
    """Gives the page a size and a liking for dark or light."""
    width, least, scale = SIZES[size]
    page.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": max(height, least), "deviceScaleFactor": scale,
         "mobile": size == "phone"},
    )  # fmt: skip
    liking = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": liking})


def fill(folder: Path) -> None:
    """A run, its log beside the model of its robot, a workspace and a study."""
    words = ["workspace", "acrobot_small", "--grid=9,9,9", f"--out={folder / 'workspaces/small'}"]
    subprocess.run([sys.executable, "-m", "cdpr_drake", *words], check=True)
    study = folder / "studies" / "tension-methods"
    study.mkdir(parents=True)
    said = {"words": "methods agree", "printed": "1", "found": "1", "verdict": "confirmed"}
    (study / "results.json").write_text(json.dumps({"study": "x", "statements": [said]}))
    run = folder / "runs" / "acrobot_pbvs"
    scenario = load_scenario("acrobot_pbvs", ["camera.kind=projected", "duration=2.0"])
    simulate(scenario, folder=run)
    replay_log(run / "log.csv", robot="acrobot_small", out=folder / "logs" / "acrobot_pbvs")
    about = {"robot": "acrobot_small", "digest": subject_of(load_robot("acrobot_small")).digest}
    write_asked(folder / "logs" / f".acrobot_pbvs{ASKED}", (), about)


def coloured(page: Any) -> int:
    """How many pixels in the right half of the page have a colour."""
    with Image.open(io.BytesIO(page.get_screenshot_as_png())) as image:
        pixels = np.asarray(image.convert("RGB"), int)
    scene = pixels[100:, pixels.shape[1] * 6 // 10 :]
    return int(np.count_nonzero(np.ptp(scene, axis=2) > 60))


def wait_for_scene(page: Any) -> None:
    """Returns once the robot is drawn; in software that may take long."""
    end = time.monotonic() + LONGEST_WAIT
    while coloured(page) < COLOURED:
        if time.monotonic() > end:
            raise TimeoutError("the scene shows no robot")
        time.sleep(1.0)


def keep(page: Any, name: str) -> None:
    """Writes a picture of the guide."""
    with Image.open(io.BytesIO(page.get_screenshot_as_png())) as image:
        image.convert("RGB").save(IMAGES / name, quality=QUALITY, method=6)


def move_a_point(page: Any) -> None:
    """Gives an exit point another place, and waits for the workspace that follows."""
    press(page, "Robot")
    field = page.find_element("css selector", f'input[aria-label="{MOVED}"]')
    field.send_keys(Keys.CONTROL, "a")
    field.send_keys("-0.3", Keys.ENTER)
    wait_for(page, "document.querySelector('.studio-live').innerText.includes('refined')")
    time.sleep(SETTLED)


def main() -> None:
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


def tabs(page: Any) -> Iterator[str]:
    """Turns to each tab, and waits until it is there."""
    for title in page.execute_script(
        "return [...document.querySelectorAll('.q-tab__label')].map(e => e.textContent)"
    ):
        press(page, title)
        time.sleep(SETTLED)
        yield title.lower()


def photograph(page: Any, size: str, dark: bool, folder: Path) -> None:
    """Takes pictures of all tabs and dialogs."""
    kind = f"{size}_{'dark' if dark else 'light'}.png"
    for name in tabs(page):
        page.execute_script(CHOOSE)
        time.sleep(SETTLED)
        look(page, size, dark, page.execute_script(LONG))
        time.sleep(1.0)
        page.save_screenshot(str(folder / f"{name}_{kind}"))
        look(page, size, dark)
    press(page, "Robot")
    for words in DIALOGS:
        press(page, words)
        wait_for(page, "document.querySelector('.q-dialog') !== null")
        time.sleep(1.0)
        page.save_screenshot(str(folder / f"dialog_{words.lower().replace(' ', '_')}_{kind}"))
        page.find_element("css selector", "body").send_keys(Keys.ESCAPE)
        wait_for(page, "document.querySelector('.q-dialog') === null")


def photograph_guide(page: Any, dark: bool) -> None:
    """Takes the pictures of the guide."""
    wait_for_scene(page)
    for name in tabs(page):
        if (name, dark) in GUIDE:
            keep(page, GUIDE[name, dark])
    if not dark:
        move_a_point(page)
        keep(page, DRAGGED)


if __name__ == "__main__":
    main()

"""Pictures of the studio's panels, to be looked at, and the one of its guide.

`python -m tests.studio.pictures FOLDER`, or with `--guide` the pictures of docs/guides/studio.md.
"""

from __future__ import annotations

import argparse
import io
import tempfile
import time
from pathlib import Path

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

SIZES = {"1280": (1280, 800, 1.0), "1920": (1920, 1080, 1.0), "phone": (390, 844, 2.0)}
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


def look(page: object, size: str, dark: bool) -> None:
    """Gives the page a size and a liking for dark or light."""
    width, height, scale = SIZES[size]
    page.execute_cdp_cmd(  # type: ignore[attr-defined]
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": size == "phone"},
    )
    liking = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": liking})  # type: ignore[attr-defined]


def fill(folder: Path) -> None:
    """A run, and its log beside the model of its robot."""
    run = folder / "runs" / "acrobot_pbvs"
    scenario = load_scenario("acrobot_pbvs", ["camera.kind=projected", "duration=2.0"])
    simulate(scenario, folder=run)
    replay_log(run / "log.csv", robot="acrobot_small", out=folder / "logs" / "acrobot_pbvs")
    about = {"robot": "acrobot_small", "digest": subject_of(load_robot("acrobot_small")).digest}
    write_asked(folder / "logs" / f".acrobot_pbvs{ASKED}", (), about)


def coloured(page: object) -> int:
    """How many pixels in the right half of the page have a colour."""
    with Image.open(io.BytesIO(page.get_screenshot_as_png())) as image:  # type: ignore[attr-defined]
        pixels = np.asarray(image.convert("RGB"), int)
    scene = pixels[100:, pixels.shape[1] * 6 // 10 :]
    return int(np.count_nonzero(np.ptp(scene, axis=2) > 60))


def wait_for_scene(page: object) -> None:
    """Returns once the robot is drawn; in software that may take long."""
    end = time.monotonic() + LONGEST_WAIT
    while coloured(page) < COLOURED:
        if time.monotonic() > end:
            raise TimeoutError("the scene shows no robot")
        time.sleep(1.0)


def keep(page: object, name: str) -> None:
    """Writes a picture of the guide."""
    with Image.open(io.BytesIO(page.get_screenshot_as_png())) as image:  # type: ignore[attr-defined]
        image.convert("RGB").save(IMAGES / name, quality=QUALITY, method=6)


def move_a_point(page: object) -> None:
    """Gives an exit point another place, and waits for the workspace that follows."""
    press(page, "Robot")
    field = page.find_element("css selector", f'input[aria-label="{MOVED}"]')  # type: ignore[attr-defined]
    field.send_keys(Keys.CONTROL, "a")
    field.send_keys("-0.3", Keys.ENTER)
    wait_for(page, "document.querySelector('.studio-live').innerText.includes('refined')")
    time.sleep(SETTLED)


def main() -> None:
    """Writes them."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", type=Path, nargs="?")
    options.add_argument("--guide", action="store_true")
    asked = options.parse_args()
    sizes = ("1280",) if asked.guide else tuple(SIZES)
    looks = [(size, dark) for dark in (False, True) for size in sizes]
    with tempfile.TemporaryDirectory() as folder:
        fill(Path(folder))
        photograph(Path(folder), looks, asked)


def photograph(folder: Path, looks: list[tuple[str, bool]], asked: argparse.Namespace) -> None:
    """Takes pictures of all panels of a studio that works in a folder."""
    with served(folder, "acrobot_small") as (address, _):
        for size, dark in looks:
            with tempfile.TemporaryDirectory() as profile, chromium(Path(profile)) as page:
                look(page, size, dark)
                page.get(address)
                wait_for(page, "document.querySelectorAll('.q-tab').length > 0")
                if size != "phone":  # there the scene is below the panel
                    wait_for_scene(page)
                count = page.execute_script("return document.querySelectorAll('.q-tab').length")
                for number in range(count):
                    tab = page.find_elements("css selector", ".q-tab")[number]
                    name = tab.text.split("\n")[-1].lower()
                    tab.click()
                    time.sleep(SETTLED)
                    if asked.guide and (name, dark) in GUIDE:
                        keep(page, GUIDE[name, dark])
                    elif not asked.guide:
                        asked.folder.mkdir(parents=True, exist_ok=True)
                        kind = "dark" if dark else "light"
                        page.save_screenshot(str(asked.folder / f"{name}_{size}_{kind}.png"))
                if not dark and size == "1280":
                    move_a_point(page)
                    if asked.guide:
                        keep(page, DRAGGED)
                    else:
                        page.save_screenshot(str(asked.folder / "moved_1280_light.png"))


if __name__ == "__main__":
    main()

"""Frames of plots per second of a run at real time: python -m tests.studio.measure_plots [PICTURE]

In Chromium, with the scene beside them, which here the processor draws, and without. On a machine
with nothing else to do; a graphics card takes the scene off the processor.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

from tests.chromium import chromium, complaints, wait_for
from tests.studio.run_page import FRAMES, frames, press, wait_for_start, write_scenario
from tests.studio.served import served

SECONDS = 8.0
"""Time that is measured [s]."""


def rate(page):
    """Frames per second of the plots, and rows that came in that time."""
    first = frames(page)
    time.sleep(SECONDS)
    last = frames(page)
    passed = last[2] - first[2]
    return {"frames_per_s": (last[0] - first[0]) / passed, "rows": last[1] - first[1]}


def main(picture=""):
    """Prints what was measured as JSON; keeps a picture of the page, if a name is given."""
    with tempfile.TemporaryDirectory() as name, tempfile.TemporaryDirectory() as profile:
        folder = Path(name)
        replaced = {"duration: 30.0": "duration: 300.0", "position: 0.0003": "position: 1.0e-9"}
        scenario = write_scenario(folder, **replaced)
        with chromium(Path(profile), (1280, 1000)) as page, served(folder, str(scenario)) as server:
            page.get(server[0])
            press(page, "Run")
            wait_for(page, "document.querySelector('[aria-label=duration]') !== null")
            press(page, "Start")
            wait_for(page, "document.querySelector('.cdpr-state').innerText === 'running'")
            wait_for_start(page, f"{FRAMES}[1] > 20")
            found = {"with_scene": rate(page)}
            if picture:
                page.save_screenshot(picture)
            page.execute_script("document.querySelector('#scene').remove()")
            time.sleep(2.0)
            found["without_scene"] = rate(page)
            found["complaints"] = complaints(page)
            press(page, "Stop")
            wait_for(page, "document.querySelector('.cdpr-state').innerText === 'stopped'")
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main(*sys.argv[1:])

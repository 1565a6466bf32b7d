"""Frames of plots per second of a run at real time: python -m tests.studio.measure_plots

In Chromium, with the scene beside them, which here the processor draws, and without. On a machine
with nothing else to do; a graphics card takes the scene off the processor.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

from tests.studio.run_page import RunPage, browser, served

SECONDS = 8.0
"""Time that is measured [s]."""


def rate(page):
    """Frames per second of the plots, and rows that came in that time."""
    first = page.frames()
    time.sleep(SECONDS)
    last = page.frames()
    passed = last[2] - first[2]
    return {"frames_per_s": (last[0] - first[0]) / passed, "rows": last[1] - first[1]}


def main(picture=""):
    """Prints what was measured as JSON; keeps a picture of the page, if a name is given."""
    with tempfile.TemporaryDirectory() as folder, served(folder) as address:
        with browser() as driver:
            page = RunPage(driver, address)
            page.choose("scenario", "acrobot_pbvs")
            page.choose("camera.kind", "projected")
            page.click(".cdpr-fold .q-item", "stop:")
            page.until(lambda: page.found(".q-field", "stop.position"))
            page.type("stop.position", "1e-9")  # so that it goes on
            page.type("duration", "120")
            time.sleep(2.0)
            page.click("button", "Start")
            page.until(lambda: page.frames()[1] > 20)
            time.sleep(3.0)
            found = {"with_scene": rate(page)}
            if picture:
                driver.save_screenshot(picture)
            driver.execute_script("document.querySelector('#scene').remove()")
            time.sleep(2.0)
            found["without_scene"] = rate(page)
            found["words"] = page.words()
            found["log"] = [entry["message"] for entry in driver.get_log("browser")]
        found["left"] = sorted(path.name for path in Path(folder).rglob("*"))
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main(*sys.argv[1:])

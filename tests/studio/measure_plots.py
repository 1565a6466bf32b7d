"""Frames of plots per second of a run at real time: python -m tests.studio.measure_plots [PICTURE]

In Chromium, with the scene beside them, which here the processor draws, and without. On a machine
with nothing else to do; a graphics card takes the scene off the processor.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

from tests.chromium import complaints, wait_for
from tests.studio.run_page import FRAMES, opened, press, text_of, write_scenario
from tests.studio.served import LONGEST_START

LONG = {"duration: 30.0": "duration: 300.0", "position: 0.0003": "position: 1.0e-9"}


def rate(page):
    """Frames per second of the plots, and rows that came in eight seconds."""
    frames, rows, start = page.execute_script(f"return {FRAMES}")
    time.sleep(8.0)
    last = page.execute_script(f"return {FRAMES}")
    return {"frames_per_s": (last[0] - frames) / (last[2] - start), "rows": last[1] - rows}


def main(picture=""):
    """Prints what was measured as JSON; keeps a picture of the page, if a name is given."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = write_scenario(Path(folder), **LONG)
        with opened(str(scenario), folder=folder, size=(1280, 1000)) as page:
            press(page, "Run")
            wait_for(page, "document.querySelector('[aria-label=duration]') !== null")
            press(page, "Start")
            wait_for(page, f"{FRAMES}[1] > 20", LONGEST_START)
            told = {"with_scene": rate(page)}
            if picture:
                page.save_screenshot(picture)
            page.execute_script("document.querySelector('#scene').remove()")
            time.sleep(2.0)
            told |= {"without_scene": rate(page), "complaints": complaints(page)}
            press(page, "Stop")
            wait_for(page, f"{text_of('.cdpr-state')} === 'stopped'")
    print(json.dumps(told, indent=2))


if __name__ == "__main__":
    main(*sys.argv[1:])

"""How fast the page answers, and what a long session takes of memory; in Chromium.

`python -m tests.studio.measure`

From the step of a slider to the numbers on the screen: from the event in the page to the second
frame after the table of tensions has changed, median and 95 per cent. Memory: of the server's
process before and after many actions.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
import time
from pathlib import Path

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from tests.chromium import chromium, wait_for
from tests.studio.served import served

WATCH = """
window.studioTimes = [];
let begin = null;
document.addEventListener('keydown', () => { begin = performance.now(); }, true);
new MutationObserver(() => {
  if (begin === null || !document.querySelector('.studio-cables')) return;
  const began = begin;
  begin = null;
  requestAnimationFrame(() => requestAnimationFrame(
    () => window.studioTimes.push(performance.now() - began)));
}).observe(document.querySelector('.studio-cables').parentElement, {childList: true});
"""
"""Notes the time from each key to the second frame after the table of tensions has changed."""

FOCUS = """
const slider = document.querySelectorAll('.studio-sliders .q-slider')[arguments[0]];
(slider.querySelector('[tabindex]') || slider).focus();
"""

WARM = 12
"""Steps that do not count."""


def memory(pid: int) -> float:
    """Resident memory of a process [MB]."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024.0
    raise ValueError(f"process {pid} has no memory")


def press(page: object, words: str) -> None:
    """Clicks a tab or button by its words."""
    page.execute_script(  # type: ignore[attr-defined]
        "[...document.querySelectorAll('button, .q-tab')].find(e => e.ariaLabel === arguments[0] ||"
        " (e.querySelector('.q-tab__label, .block') || e).textContent.trim() === arguments[0])"
        ".click()",
        words,
    )


def main() -> None:
    """Measures, and prints JSON."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--steps", type=int, default=100)
    options.add_argument("--actions", type=int, default=500)
    asked = options.parse_args()
    with (
        tempfile.TemporaryDirectory() as folder,
        tempfile.TemporaryDirectory() as profile,
        chromium(Path(profile)) as page,
        served(Path(folder)) as (address, process),
    ):
        page.get(address)
        wait_for(page, "document.querySelector('input[aria-label]') !== null")
        press(page, "Pose")
        page.set_script_timeout(120.0)
        wait_for(page, "document.querySelector('.studio-cables tbody') !== null")

        page.execute_script(WATCH)

        def step(k: int) -> None:
            page.execute_script(FOCUS, k % 3)
            key = Keys.ARROW_RIGHT if k // 3 % 2 else Keys.ARROW_LEFT
            ActionChains(page).send_keys(key).perform()
            while page.execute_script("return window.studioTimes.length") <= k:
                time.sleep(0.01)

        for k in range(WARM + asked.steps):
            step(k)
        times = sorted(page.execute_script("return window.studioTimes")[WARM:])
        before = memory(process.pid)
        for k in range(asked.actions):
            step(WARM + asked.steps + k)
        print(json.dumps({
            "slider_to_screen_ms_median": statistics.median(times),
            "slider_to_screen_ms_95": times[int(0.95 * len(times))],
            "steps": asked.steps,
            "memory_mb_before": before,
            "memory_mb_grown": memory(process.pid) - before,
            "actions": asked.actions,
        }, indent=2))  # fmt: skip


if __name__ == "__main__":
    main()

"""What grows in a studio's server that is used for long: 20 tabs of four sessions, and requests.

`nice python -m tests.studio.soak --minutes 60 --csv soak.csv`

The server writes a row every ten seconds: its memory, and how much there is of what may leak. Said
at the end is what the second half of the time added.
"""

from __future__ import annotations

import argparse
import asyncio
import csv
import gc
import http.client
import os
import random
import statistics
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable
from itertools import cycle
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from tests.chromium import chromium
from tests.studio.run_page import write_scenario
from tests.studio.served import served

EVERY = 10.0
"""Between two rows [s]."""

HOSTS = tuple(f"127.0.0.{k}" for k in range(1, 5))
"""Cookies are kept by host: a session each, in one browser."""

TABS, REQUESTS = 20, 500

STILL = """
if (location.pathname.startsWith('/scene/'))
    window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 3000);
"""
"""Scenes are drawn in software, and nobody looks at them."""

TURN = """
const tabs = [...document.querySelectorAll('.q-tab')];
const tab = tabs.find(e => e.innerText.split('\\n').pop().trim() === arguments[0]) ??
    tabs[Math.floor(Math.random() * tabs.length)];
tab.click();
"""

SLIDE = """
const sliders = [...document.querySelectorAll('.q-slider [tabindex="0"]')];
for (const kind of ['keydown', 'keyup'])
    sliders[Math.floor(Math.random() * sliders.length)].dispatchEvent(new KeyboardEvent(
        kind, {keyCode: Math.random() < 0.5 ? 37 : 39, bubbles: true}));
"""

PRESS = """
[...document.querySelectorAll('.q-tab-panel button')].find(e => e.checkVisibility() &&
    (e.ariaLabel ?? e.innerText.split('\\n').pop().trim()) === arguments[0]).click();
"""

TYPE = """
const field = document.querySelector('input[aria-label="cables 0 exit point x"]');
field.focus();
field.value = arguments[0];
field.dispatchEvent(new Event('input', {bubbles: true}));
field.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', keyCode: 13, bubbles: true}));
"""

CHOOSE = """
const field = [...document.querySelectorAll('.q-select')].find(
    e => e.innerText.includes('scenario'));
field.querySelector('.q-select__dropdown-icon').click();
setTimeout(() => {
    const items = document.querySelectorAll('.q-menu .q-item');
    items[Math.floor(Math.random() * items.length)]?.click();
}, 400);
"""


# In the server's process.


def watched() -> None:
    """Runs `cdpr studio` with the arguments of this process; it writes rows to $SOAK_CSV."""
    from nicegui import app, background_tasks

    from cdpr_drake.cli.app import main

    app.on_startup(lambda: background_tasks.create(_write_rows(), name="soak"))
    main(["studio", *sys.argv[1:]])


async def _write_rows() -> None:
    start, writer = time.monotonic(), None
    with open(os.environ["SOAK_CSV"], "w", newline="") as file:
        while True:
            row = {"time_s": round(time.monotonic() - start, 1)} | held()
            writer = writer or csv.DictWriter(file, list(row))
            if file.tell() == 0:
                writer.writeheader()
            writer.writerow(row)
            file.flush()
            await asyncio.sleep(EVERY)


def held() -> dict[str, float]:
    """What this process holds."""
    from nicegui import Client, Event
    from nicegui.element import Element

    from cdpr_drake.studio.session import Workbench

    pages = int(Path("/proc/self/statm").read_text().split()[1])
    kinds: Counter[type] = Counter()
    objects = gc.get_objects()
    for thing in objects:
        for kind in (Workbench, Client, Element):
            if issubclass(type(thing), kind):
                kinds[kind] += 1
    return {
        "rss_mb": round(pages * os.sysconf("SC_PAGE_SIZE") / 1e6, 1),
        "tasks": len(asyncio.all_tasks()), "threads": threading.active_count(),
        "files": len(os.listdir("/proc/self/fd")), "objects": len(objects),
        "sessions": kinds[Workbench], "clients": kinds[Client], "elements": kinds[Element],
        "listeners": sum(len(event.callbacks) for event in Event.instances),
    }  # fmt: skip


# In the process that uses it.


def request_all(address: str, seconds: float, found: Counter[str]) -> None:
    """Plain requests to all of a server's addresses, with a cookie and without."""
    parts = urlsplit(address)
    cookie = ""
    paths = ["/", "/scene/", "/scene/meshcat.js", "/favicon.ico", "/nothing", f"/?{parts.query}",
             "/_nicegui_ws/socket.io/?EIO=4&transport=polling"]  # fmt: skip
    for number, path in zip(range(REQUESTS), cycle(paths), strict=False):
        connection = http.client.HTTPConnection(HOSTS[0], parts.port, timeout=60.0)
        try:
            connection.request("GET", path, headers={"Cookie": cookie} if number % 3 else {})
            answer = connection.getresponse()
            body = answer.read().decode(errors="replace")
            found[f"HTTP {answer.status}"] += 1
            cookie = cookie or (answer.headers["Set-Cookie"] or "").partition(";")[0]
            if path == "/" and answer.status == 200 and len(paths) < 12:
                paths += [x.partition('"')[0] for x in body.split('="')[1:] if x[0] == "/"]
        except OSError as problem:
            found[type(problem).__name__] += 1
        finally:
            connection.close()
        time.sleep(seconds / REQUESTS)


def use(page: Any, address: str, seconds: float, chance: random.Random) -> Counter[str]:
    """Uses a studio in many tabs; how often each action succeeded or failed."""
    parts, found = urlsplit(address), Counter[str]()
    url = "http://{}:" + f"{parts.port}/?{parts.query}"

    def open_tab(number: int) -> None:
        page.switch_to.new_window("tab")
        page.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": STILL})
        page.get(url.format(HOSTS[number % len(HOSTS)]))

    def in_panel(panel: str, script: str, *words: str) -> Callable[[], None]:
        def act() -> None:
            page.execute_script(TURN, panel)
            time.sleep(0.4)
            page.execute_script(script, *words)

        return act

    def replace_tab() -> None:
        page.close()
        page.switch_to.window(page.window_handles[0])
        open_tab(chance.randrange(len(HOSTS)))

    def field() -> None:
        in_panel("Robot", TYPE, f"{-0.4 - 0.1 * chance.random():.3f}")()
        time.sleep(0.3)
        page.execute_script(PRESS, "Undo, Ctrl-Z")

    actions: dict[str, tuple[float, Callable[[], None]]] = {
        "tab": (4.0, lambda: page.execute_script(TURN, "")),
        "slider": (5.0, in_panel("Pose", SLIDE)),
        "field and undo": (4.0, field),
        "scenario": (1.0, in_panel("Run", CHOOSE)),
        "run": (0.3, in_panel("Run", PRESS, "Start")),
        "reload": (1.0, page.refresh),
        "another tab": (0.5, replace_tab),
    }
    for number in range(TABS):
        open_tab(number)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        page.switch_to.window(chance.choice(page.window_handles[1:]))
        name = chance.choices(list(actions), [weight for weight, _ in actions.values()])[0]
        try:
            actions[name][1]()
            found[name] += 1
        except Exception as problem:  # it is not there yet, or the page has gone
            found[f"{name}: {type(problem).__name__}"] += 1
        time.sleep(1.0)
    return found


def verdict(rows: list[dict[str, float]]) -> str:
    """What the second half of the time added, from medians of its first and its last sixth."""
    last = rows[len(rows) // 2 :]
    sixth = max(len(last) // 6, 1)
    lines = []
    for name in rows[0]:
        early, late = (
            statistics.median(row[name] for row in part) for part in (last[:sixth], last[-sixth:])
        )
        lines.append(f"{name:10} {early:12.1f} -> {late:12.1f}  {late - early:+.1f}")
    return "\n".join(lines)


def main() -> None:
    """Runs it from the command line."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--minutes", type=float, default=60.0)
    options.add_argument("--csv", type=Path, default=Path("soak.csv"))
    options.add_argument("--seed", type=int, default=0)
    asked = options.parse_args()
    seconds, found = 60.0 * asked.minutes, Counter[str]()
    os.environ["SOAK_CSV"] = str(asked.csv.resolve())
    inside = ("-c", "from tests.studio.soak import watched; watched()")
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as profile:
        short = write_scenario(Path(folder), **{"duration: 30.0": "duration: 0.5"})
        with (
            served(folder, str(short), "--host=*", program=inside) as (address, process),
            chromium(Path(profile)) as page,
        ):
            other = threading.Thread(target=request_all, args=(address, seconds, found))
            other.start()
            found += use(page, address, seconds, random.Random(asked.seed))
            other.join()
            assert process.poll() is None, "the server has ended"
    with asked.csv.open() as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    print(verdict(rows))
    print(dict(sorted(found.items())))


if __name__ == "__main__":
    main()

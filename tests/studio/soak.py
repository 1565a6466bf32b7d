"""What grows in a studio's server that is used for long: 20 tabs of four sessions, and requests.

`nice python -m tests.studio.soak --minutes 60 --csv soak.csv`

The server writes a row every ten seconds: its memory, and how much there is of what may leak. Said
at the end is what the second half of the time added.
"""

import argparse
import asyncio
import csv
import os
import random
import sys
import tempfile
import threading
import time
from collections import Counter
from itertools import cycle
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import numpy as np

from cdpr_drake.studio.panel import PANELS
from tests.chromium import chromium
from tests.studio.served import button, served, write_scenario

HOSTS = tuple(f"127.0.0.{k}" for k in range(1, 5))
"""Cookies are kept by host: a session each, in one browser."""

TABS, REQUESTS = 20, 500

STILL = """
if (location.pathname.startsWith('/scene/'))
    window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 60000);
"""
"""Scenes are drawn in software, and nobody looks at them."""

SLIDE = """
const sliders = [...document.querySelectorAll('.q-slider [tabindex="0"]')];
for (const kind of ['keydown', 'keyup'])
    sliders[Math.floor(Math.random() * sliders.length)].dispatchEvent(new KeyboardEvent(
        kind, {keyCode: Math.random() < 0.5 ? 37 : 39, bubbles: true}));
"""

TYPE = """
const field = document.querySelector('input[aria-label="cables 0 exit point x"]');
field.focus();
field.value = (-0.4 - 0.1 * Math.random()).toFixed(3);
field.dispatchEvent(new Event('input', {bubbles: true}));
field.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', keyCode: 13, bubbles: true}));
setTimeout(() => document.querySelector('[aria-label="Undo, Ctrl-Z"]').click(), 300);
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

ACTIONS = {
    "tab": (4.0, "", ""),
    "slider": (5.0, "Pose", SLIDE),
    "field and undo": (4.0, "Robot", TYPE),
    "scenario": (1.0, "Run", CHOOSE),
    "run": (0.3, "Run", f"{button('Start')}.click()"),
    "reload": (1.0, "", "location.reload()"),
    "another tab": (0.5, "", ""),
}
"""How often each is done, in which panel (any), and its script."""


# In the server's process.


def watched():
    """Runs `cdpr studio` with the arguments of this process; it writes rows to $SOAK_CSV."""
    from nicegui import app, background_tasks

    from cdpr_drake.cli.app import main

    app.on_startup(lambda: background_tasks.create(_write_rows(), name="soak"))
    main(["studio", *sys.argv[1:]])


async def _write_rows():
    start = time.monotonic()
    with open(os.environ["SOAK_CSV"], "w", newline="") as file:
        writer = csv.DictWriter(file, ["time_s", *held()])
        writer.writeheader()
        while True:
            writer.writerow({"time_s": round(time.monotonic() - start, 1)} | held())
            file.flush()
            await asyncio.sleep(10.0)


def held():
    """What this process holds; it makes no large object itself, which would be measured, too."""
    from nicegui import Client, Event

    pages, clients = int(Path("/proc/self/statm").read_text().split()[1]), Client.instances
    return {
        "rss_mb": round(pages * os.sysconf("SC_PAGE_SIZE") / 1e6, 1),
        "tasks": len(asyncio.all_tasks()), "threads": threading.active_count(),
        "files": len(os.listdir("/proc/self/fd")), "blocks": sys.getallocatedblocks(),
        "clients": len(clients),
        "elements": sum(len(client.elements) for client in clients.values()),
        "listeners": sum(len(event.callbacks) for event in Event.instances),
    }  # fmt: skip


# In the process that uses it.


def request_all(url, seconds, found):
    """Plain requests to all of a server's addresses, with a cookie and without."""
    home, _, query = url.partition("/?")
    start = time.monotonic()
    paths = ["/", "/scene/", "/scene/meshcat.js", "/favicon.ico", "/nothing", f"/?{query}",
             "/_nicegui_ws/socket.io/?EIO=4&transport=polling"]  # fmt: skip
    cookies = {}
    for number, path in zip(range(REQUESTS), cycle(paths), strict=False):
        try:
            sent = cookies if number % 3 else {}
            answer = httpx.get(home + path, cookies=sent, timeout=60.0)
            found[f"HTTP {answer.status_code}"] += 1
            cookies = cookies or dict(answer.cookies)
            if path == "/" and answer.status_code == 200 and len(paths) < 12:
                paths += [x.partition('"')[0] for x in answer.text.split('="')[1:] if x[0] == "/"]
        except httpx.HTTPError as problem:
            found[type(problem).__name__] += 1
        time.sleep(max(start + number * seconds / REQUESTS - time.monotonic(), 0.0))


def use(page, url, seconds):
    """Uses a studio in many tabs; how often each action succeeded or failed."""

    def open_tab():
        page.switch_to.new_window("tab")
        page.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": STILL})
        page.get(url.replace(HOSTS[0], random.choice(HOSTS)))

    random.seed(0)
    for _ in range(TABS):
        open_tab()
    found, end = Counter(), time.monotonic() + seconds
    titles = [panel.title for panel in PANELS.values()]
    while time.monotonic() < end:
        page.switch_to.window(random.choice(page.window_handles[1:]))
        (name,) = random.choices(list(ACTIONS), [often for often, *_ in ACTIONS.values()])
        _, panel, script = ACTIONS[name]
        try:
            if name == "another tab":
                page.close()
                page.switch_to.window(page.window_handles[0])
                open_tab()
            else:
                page.execute_script(f"{button(panel or random.choice(titles))}.click()")
                time.sleep(0.4)
                page.execute_script(script)
            found[name] += 1
        except Exception as problem:  # it is not there yet, or the page has gone
            found[f"{name}: {type(problem).__name__}"] += 1
        time.sleep(1.0)
    return found


def verdict(rows):
    """What the second half of the time added, from medians of its first and its last sixth."""
    last = rows[len(rows) // 2 :]
    sixth = max(len(last) // 6, 1)
    for name in rows.dtype.names:
        early, late = np.median(last[name][:sixth]), np.median(last[name][-sixth:])
        yield f"{name:10} {early:12.1f} -> {late:12.1f}  {late - early:+.1f}"


def main():
    """Runs it from the command line."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--minutes", type=float, default=60.0)
    options.add_argument("--csv", type=Path, default=Path("soak.csv"))
    asked = options.parse_args()
    seconds, found = 60.0 * asked.minutes, Counter()
    os.environ["SOAK_CSV"] = str(asked.csv.resolve())
    inside = ("-c", "from tests.studio.soak import watched; watched()")
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as profile:
        short = write_scenario(Path(folder), **{"duration: 30.0": "duration: 0.5"})
        with (
            served(folder, str(short), "--host=*", program=inside) as (address, process),
            chromium(Path(profile)) as page,
        ):
            url = f"http://{HOSTS[0]}:{urlsplit(address).port}/?{urlsplit(address).query}"
            other = threading.Thread(target=request_all, args=(url, seconds, found))
            other.start()
            found += use(page, url, seconds)
            other.join()
            assert process.poll() is None, "the server has ended"
    rows = np.genfromtxt(asked.csv, delimiter=",", names=True)
    print(*verdict(np.atleast_1d(rows)), sep="\n")
    print(dict(sorted(found.items())))


if __name__ == "__main__":
    main()

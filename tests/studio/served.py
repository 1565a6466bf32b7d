"""The studio as a user starts it: `cdpr studio` in a process of its own, and in Chromium."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread

from cdpr_drake.systems.scenarios.files import scenario_file
from tests.chromium import chromium, wait_for

LONGEST_START = 600.0
"""Until the address is printed [s]; Drake is imported before."""

FRAMES = """(() => {
    const data = (document.querySelector('.cdpr-plots') || {dataset: {}}).dataset;
    return [Number(data.frames || 0), Number(data.rows || 0), performance.now() / 1000];
})()"""
"""Frames of plots that were drawn, rows that they have, and the browser's time [s]."""


@contextmanager
def served(folder, *arguments, program=("-m", "cdpr_drake", "studio")):
    """The address of a studio that works in a folder, its process, with what it has `said`."""
    words = [sys.executable, *program, *arguments, "--folder", str(folder), "--port", "0",
             "--no-browser"]  # fmt: skip
    # Else NiceGUI takes the port of its own tests.
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "NICEGUI"))}
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
    )
    process.said = []
    reader = Thread(target=lambda: [process.said.append(line) for line in process.stdout])
    reader.start()  # or the server would wait, once the pipe is full
    try:
        yield _address(process), process
    finally:
        process.terminate()
        try:
            process.wait(20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        reader.join()
        process.stdout.close()


def _address(process):
    end = time.monotonic() + LONGEST_START
    while time.monotonic() < end and process.poll() is None:
        for line in list(process.said):
            if line.startswith("cdpr studio at "):
                return line.split()[3]
        time.sleep(0.05)
    raise AssertionError(f"the studio did not start: {''.join(process.said)}")


def write_scenario(folder, **replaced):
    """acrobot_pbvs with a projected camera and other values at its top or in `stop`; its file."""
    text = scenario_file("acrobot_pbvs").read_text()
    for old, new in ({"kind: rendered": "kind: projected"} | replaced).items():
        assert old in text
        text = text.replace(old, new)
    path = folder / "acrobot_pbvs.yaml"
    path.write_text(text)
    return path


@contextmanager
def opened(*arguments, folder=None, size=(1280, 800)):
    """A browser at the page of a studio that works in a folder, or in a new one."""
    with (
        TemporaryDirectory() as new,
        TemporaryDirectory() as profile,
        served(folder or new, *arguments) as (address, _),
        chromium(Path(profile), size) as page,
    ):
        page.get(address)
        yield page


def button(words):
    """JavaScript for the tab or button with these words, or this name."""
    wanted = json.dumps(words)
    return (
        "[...document.querySelectorAll('button, .q-tab')].find(e => !e.disabled && "
        "((e.querySelector('.q-tab__label, .block') || e).textContent.trim() === "
        f"{wanted} || e.ariaLabel === {wanted}))"
    )


def press(page, words):
    """Clicks it."""
    wait_for(page, f"{button(words)} !== undefined")
    page.execute_script(f"{button(words)}.click()")


def text_of(selector):
    """JavaScript for the words of an element; empty where there is none."""
    return f"((document.querySelector('{selector}') || {{}}).innerText || '')"

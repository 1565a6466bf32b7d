"""The run panel in Chromium: what tests and measurements do with it."""

import json
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from cdpr_drake.systems.scenarios.files import scenario_file
from tests.chromium import chromium, wait_for
from tests.studio.served import served

FRAMES = """(() => {
    const data = (document.querySelector('.cdpr-plots') || {dataset: {}}).dataset;
    return [Number(data.frames || 0), Number(data.rows || 0), performance.now() / 1000];
})()"""
"""Frames of plots that were drawn, rows that they have, and the browser's time [s]."""


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

"""How far the workspace in the scene is behind the hand that drags a point; in Chromium.

`python -m tests.studio.measure_drag`

An exit point is dragged by real events of the mouse, without waiting for what is drawn. Each place
that the page tells the server is remembered with the browser's time at the event. The messages of
Meshcat are read as they come to the scene: the exit point's place says of which event the workspace
is that follows it. Its time is that of the second picture of the page after the scene was drawn
with it: by then it is seen. Places that no workspace was drawn for were overtaken by newer ones.
Chromium draws by the processor here; a graphics card takes the drawing off it. Printed as JSON:
`behind_ms` from the event of the pointer to the picture; by how much a whole drag is behind at each
moment (`still_ms`: the age of what the scene shows, once in each picture); and from the letting go
of the hand to the refined workspace.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder

from tests.chromium import chromium, complaints, wait_for
from tests.studio.run_page import press
from tests.studio.served import served

CABLE = 1
"""Number of the cable whose exit point is dragged."""

WATCH = """
const viewer = document.getElementById('scene').contentWindow.viewer;
const exit = '/drake/studio/exit/' + arguments[0];
const told = window.dragTold = [], drawn = window.dragDrawn = [];
let moved = 0;
document.getElementById('scene').contentWindow.addEventListener(
  'pointermove', () => moved = performance.now(), true);
const emit = window.emitEvent;
window.emitEvent = (name, ...rest) => {
  if (name === 'studio_point') told.push({t: performance.now(), moved, at: rest[0].at});
  emit(name, ...rest);
};
let place = null, waiting = [];
const render = viewer.render.bind(viewer);
viewer.render = (...rest) => {
  render(...rest);
  const shown = waiting;
  waiting = [];
  requestAnimationFrame(() => requestAnimationFrame(
    () => shown.forEach((one) => drawn.push({t: performance.now(), ...one}))));
};
const handle = viewer.handle_command.bind(viewer);
viewer.handle_command = (command) => {
  handle(command);
  if (command.type === 'set_transform' && command.path === exit)
    place = [...command.matrix].slice(12, 15);
  if (command.type === 'set_object' && command.path === '/drake/studio_workspace') {
    if (place) waiting.push({came: performance.now(), at: place});
  }
};
"""
"""Notes the places that are told to the server, and those that workspaces are drawn for."""

PLACE = """
const viewer = document.getElementById('scene').contentWindow.viewer;
viewer.scene.updateMatrixWorld(true);
viewer.camera.updateMatrixWorld(true);
const object = viewer.scene_tree.find(['drake', 'studio', 'exit', String(arguments[0])]).object;
const p = object.position.clone().setFromMatrixPosition(object.matrixWorld);
p.project(viewer.camera);
const frame = document.getElementById('scene').getBoundingClientRect();
return [frame.left + (p.x + 1) / 2 * frame.width, frame.top + (1 - p.y) / 2 * frame.height];
"""
"""Where the exit point is in the page [px]."""

LISTENS = (
    "document.getElementById('scene').contentWindow.viewer && "
    "document.getElementById('scene').contentWindow.viewer.renderer.domElement.studioListens"
)

SAME = 1e-3
"""Places that differ by less are the same: the page tells all digits, the robot has four [m]."""

STEP = 3
"""Of the mouse between two events [px]."""

PERIOD = 0.06
"""Between two events of the mouse [s]."""

REFINED = "document.querySelector('.studio-live').innerText.includes('refined')"


def _same(event: dict, one: dict) -> bool:
    """Whether a workspace is of the place that an event told."""
    return bool(np.max(np.abs(np.subtract(event["at"], one["at"]))) < SAME)


def matched(told: list[dict], drawn: list[dict]) -> list[tuple[dict, dict]]:
    """Each coarse workspace that was drawn, with the last event before it that told its place."""
    pairs = []
    for one in drawn:
        before = [event for event in told if event["t"] < one["came"] and _same(event, one)]
        # What comes once more for the same event is the refined workspace.
        if before and (not pairs or pairs[-1][0] is not before[-1]):
            pairs.append((before[-1], one))
    return pairs


def ages(pairs: list[tuple[dict, dict]], told: list[dict]) -> np.ndarray:
    """How old what the scene shows is, just before each picture of a workspace [ms].

    Counted from the event after the one that is shown: until that the scene shows the newest.
    """
    found = []
    for (shown, _), (_, following) in pairwise(pairs):
        newer = [event["t"] for event in told if event["t"] > shown["t"]]
        if newer and newer[0] < following["t"]:
            found.append(following["t"] - newer[0])
    return np.array(found)


def percentiles(values: np.ndarray) -> dict[str, float]:
    """Median and 95 per cent."""
    return {"median": float(np.median(values)), "95": float(np.percentile(values, 95.0))}


def main() -> None:
    """Measures, and prints JSON."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--drags", type=int, default=150, help="events of the mouse")
    options.add_argument("--longest", type=float, default=600.0, help="time for them [s]")
    options.add_argument("--robot", default="acrobot_large")
    asked = options.parse_args()
    with (
        tempfile.TemporaryDirectory() as folder,
        tempfile.TemporaryDirectory() as profile,
        chromium(Path(profile)) as page,
        served(Path(folder), asked.robot) as (address, _),
    ):
        page.get(address)
        press(page, "Robot")
        wait_for(page, LISTENS)
        wait_for(page, "document.querySelector('.studio-live').innerText.includes('limits')")
        time.sleep(3.0)  # the camera turns to the robot
        x, y = page.execute_script(PLACE, CABLE)
        hand = ActionBuilder(page, duration=0)
        hand.pointer_action.move_to_location(int(x), int(y)).pointer_down()
        hand.perform()
        ActionChains(page, duration=0).move_by_offset(-STEP, 0).perform()
        wait_for(page, "document.querySelector('.studio-live').innerText.includes('grid')")
        page.execute_script(WATCH, CABLE)
        end = time.monotonic() + asked.longest
        for k in range(asked.drags):
            if time.monotonic() > end:
                break
            there = -STEP if k // 20 % 2 == 0 else STEP
            ActionChains(page, duration=0).move_by_offset(there, there // STEP).perform()
            time.sleep(PERIOD)
        time.sleep(0.4)
        let_go = time.monotonic()
        ActionChains(page).release().perform()
        told, drawn = page.execute_script("return [window.dragTold, window.dragDrawn]")
        wait_for(page, REFINED)
        refined = time.monotonic() - let_go
        pairs = matched(told, drawn)
        behind = np.array([one["t"] - event["moved"] for event, one in pairs])
        print(json.dumps({
            "robot": asked.robot,
            "events_told": len(told),
            "workspaces_drawn": len(pairs),
            "behind_ms": percentiles(behind),
            "still_ms": percentiles(ages(pairs, told)),
            "to_message_ms": percentiles(np.array([d["came"] - e["moved"] for e, d in pairs])),
            "refined_after_letting_go_s": refined,
            "complaints": complaints(page),
        }, indent=2))  # fmt: skip


if __name__ == "__main__":
    main()

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

import argparse
import json
import time
from itertools import pairwise

import numpy as np
from selenium.webdriver import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder

from tests.chromium import complaints, wait_for
from tests.studio.run_page import opened, press, text_of

WATCH = """
const viewer = document.getElementById('scene').contentWindow.viewer;
const told = window.dragTold = [], drawn = window.dragDrawn = [];
let moved = 0, place = null, waiting = [];
document.getElementById('scene').contentWindow.addEventListener(
  'pointermove', () => moved = performance.now(), true);
const emit = window.emitEvent;
window.emitEvent = (name, ...rest) => {
  if (name === 'studio_point') told.push({t: performance.now(), moved, at: rest[0].at});
  emit(name, ...rest);
};
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
  if (command.type === 'set_transform' && command.path === '/drake/studio/exit/1')
    place = [...command.matrix].slice(12, 15);
  if (command.type === 'set_object' && command.path === '/drake/studio_workspace' && place)
    waiting.push({came: performance.now(), at: place});
};
"""
"""Notes the places that are told to the server, and those that workspaces are drawn for."""

PLACE = """
const scene = document.getElementById('scene'), viewer = scene.contentWindow.viewer;
viewer.scene.updateMatrixWorld(true);
viewer.camera.updateMatrixWorld(true);
const point = viewer.scene_tree.find(['drake', 'studio', 'exit', '1']).object;
const p = point.position.clone().setFromMatrixPosition(point.matrixWorld).project(viewer.camera);
const frame = scene.getBoundingClientRect();
return [Math.trunc(frame.left + (p.x + 1) / 2 * frame.width),
        Math.trunc(frame.top + (1 - p.y) / 2 * frame.height)];
"""
"""Where the exit point of C2 is in the page [px]."""

LISTENS = (
    "document.getElementById('scene')?.contentWindow.viewer?.renderer?.domElement.studioListens"
)

STEP, PERIOD = 3, 0.06
"""Of the mouse between two events [px] [s]."""


def matched(told, drawn):
    """Each coarse workspace that was drawn, with the last event before it that told its place.

    The page tells all digits of places, the robot has four.
    """
    pairs = []
    for one in drawn:
        before = [
            event
            for event in told
            if event["t"] < one["came"] and np.allclose(event["at"], one["at"], rtol=0.0, atol=1e-3)
        ]
        # What comes once more for the same event is the refined workspace.
        if before and (not pairs or pairs[-1][0] is not before[-1]):
            pairs.append((before[-1], one))
    return pairs


def ages(pairs, told):
    """How old what the scene shows is, just before each picture of a workspace [ms].

    Counted from the event after the one that is shown: until that the scene shows the newest.
    """
    found = []
    for (shown, _), (_, following) in pairwise(pairs):
        newer = [event["t"] for event in told if event["t"] > shown["t"]]
        if newer and newer[0] < following["t"]:
            found.append(following["t"] - newer[0])
    return found


def percentiles(values):
    """Median and 95 per cent."""
    return {"median": float(np.median(values)), "95": float(np.percentile(values, 95.0))}


def move(page, x, y):
    """Moves the mouse by so many pixels."""
    ActionChains(page, duration=0).move_by_offset(x, y).perform()


def main():
    """Measures, and prints JSON."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--drags", type=int, default=150, help="events of the mouse")
    options.add_argument("--longest", type=float, default=600.0, help="time for them [s]")
    options.add_argument("--robot", default="acrobot_large")
    asked = options.parse_args()
    live = text_of(".studio-live")
    with opened(asked.robot) as page:
        press(page, "Robot")
        wait_for(page, f"{LISTENS} && {live}.includes('limits')")
        time.sleep(3.0)  # the camera turns to the robot
        hand = ActionBuilder(page, duration=0)
        hand.pointer_action.move_to_location(*page.execute_script(PLACE)).pointer_down()
        hand.perform()
        move(page, -STEP, 0)
        wait_for(page, f"{live}.includes('grid')")
        page.execute_script(WATCH)
        end = time.monotonic() + asked.longest
        for k in range(asked.drags):
            if time.monotonic() > end:
                break
            there = -STEP if k // 20 % 2 == 0 else STEP
            move(page, there, there // STEP)
            time.sleep(PERIOD)
        time.sleep(0.4)
        let_go = time.monotonic()
        ActionChains(page).release().perform()
        told, drawn = page.execute_script("return [window.dragTold, window.dragDrawn]")
        wait_for(page, f"{live}.includes('refined')")
        refined = time.monotonic() - let_go
        pairs = matched(told, drawn)
        print(json.dumps({
            "robot": asked.robot,
            "events_told": len(told),
            "workspaces_drawn": len(pairs),
            "behind_ms": percentiles([one["t"] - event["moved"] for event, one in pairs]),
            "still_ms": percentiles(ages(pairs, told)),
            "to_message_ms": percentiles([one["came"] - event["moved"] for event, one in pairs]),
            "refined_after_letting_go_s": refined,
            "complaints": complaints(page),
        }, indent=2))  # fmt: skip


if __name__ == "__main__":
    main()

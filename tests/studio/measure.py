"""Measures the studio's scene while a point is dragged, and plots; prints JSON.

`python -m tests.studio.measure drag`: how far the workspace in the scene is behind the hand that
drags an exit point, by real events of the mouse, without waiting for what is drawn. The place of
that point, told to the server and drawn, says which event a workspace belongs to. It is seen at the
second picture of the page after it was drawn. Places without a workspace were overtaken by newer
ones. Chromium draws by the processor here; a graphics card takes the drawing off it.

`python -m tests.studio.measure plots`: frames of plots per second of a run at real time, with the
scene beside them, and without, and rows that came in eight seconds.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from selenium.webdriver import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder

from tests.chromium import complaints, wait_for
from tests.studio.pictures import DRAWN, POINT
from tests.studio.served import FRAMES, LONGEST_START, opened, press, text_of, write_scenario

LIVE = text_of(".studio-live")

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

PLACE = f"""{POINT}
const frame = scene.getBoundingClientRect();
return [Math.trunc(frame.left + x), Math.trunc(frame.top + y)];
"""
"""Where the exit point of C2 is in the page [px]."""

DRAGS, STEP, PERIOD = 150, 3, 0.06
"""Events of the mouse, what it moves between two of them [px], and the time [s]."""


def drag():
    """From the event of the pointer until a workspace came, and is seen; how long it is refined."""
    with opened("acrobot_large") as page:
        press(page, "Robot")
        wait_for(page, f"{DRAWN} && {LIVE}.includes('limits')")
        time.sleep(3.0)  # the camera turns to the robot
        hand = ActionBuilder(page, duration=0)
        hand.pointer_action.move_to_location(*page.execute_script(PLACE)).pointer_down()
        hand.perform()
        move(page, -STEP, 0)
        wait_for(page, f"{LIVE}.includes('grid')")
        page.execute_script(WATCH)
        for k in range(DRAGS):
            there = -STEP if k // 20 % 2 == 0 else STEP
            move(page, there, there // STEP)
            time.sleep(PERIOD)
        time.sleep(0.4)
        let_go = time.monotonic()
        ActionChains(page).release().perform()
        told, drawn = page.execute_script("return [window.dragTold, window.dragDrawn]")
        wait_for(page, f"{LIVE}.includes('refined')")
        pairs = matched(told, drawn)
        print(json.dumps({
            "events_told": len(told),
            "workspaces_drawn": len(pairs),
            "came_ms": percentiles(one["came"] - event["moved"] for event, one in pairs),
            "seen_ms": percentiles(one["t"] - event["moved"] for event, one in pairs),
            "refined_after_letting_go_s": time.monotonic() - let_go,
            "complaints": complaints(page),
        }, indent=2))  # fmt: skip


def move(page, x, y):
    """Moves the mouse by so many pixels."""
    ActionChains(page, duration=0).move_by_offset(x, y).perform()


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


def plots():
    """Frames of plots with the scene, and without."""
    endless = {"duration: 30.0": "duration: 300.0", "position: 0.0003": "position: 1.0e-9"}
    with tempfile.TemporaryDirectory() as folder:
        scenario = write_scenario(Path(folder), **endless)
        with opened(str(scenario), folder=folder, size=(1280, 1000)) as page:
            press(page, "Run")
            wait_for(page, "document.querySelector('[aria-label=duration]') !== null")
            press(page, "Start")
            wait_for(page, f"{FRAMES}[1] > 20", LONGEST_START)
            told = {"with_scene": rate(page)}
            page.execute_script("document.querySelector('#scene').remove()")
            time.sleep(2.0)
            told |= {"without_scene": rate(page), "complaints": complaints(page)}
            press(page, "Stop")
            wait_for(page, f"{text_of('.cdpr-state')} === 'stopped'")
    print(json.dumps(told, indent=2))


def rate(page):
    """Frames per second of the plots, and rows that came in eight seconds."""
    frames, rows, start = page.execute_script(f"return {FRAMES}")
    time.sleep(8.0)
    last = page.execute_script(f"return {FRAMES}")
    return {"frames_per_s": (last[0] - frames) / (last[2] - start), "rows": last[1] - rows}


def percentiles(values):
    """Median and 95 per cent."""
    return np.percentile(list(values), [50.0, 95.0]).tolist()


if __name__ == "__main__":
    {"drag": drag, "plots": plots}[sys.argv[1]]()

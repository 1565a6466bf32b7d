"""What a page of the browser says beside the 3D scene: tensions, time, names, what lines mean.

Meshcat's page is one file that needs no server, and stays so: all of this is written into it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

from cdpr_drake.arrays import Array
from cdpr_drake.palette import SLACK, TENSIONS, Look


@dataclass(frozen=True)
class PageNotes:
    """What there is to say.

    Attributes:
        names: Of the cables.
        places: Where their names stand, in W, shape (3, m) [m].
        full_scale: Tension of the last colour [N]; 0: tensions are not coloured.
        recorded: Whether there is a recording, whose time is shown.
        title: What the page shows.
        lines: What is drawn beside the robot, with its look.
    """

    names: Sequence[str]
    places: Array
    full_scale: float
    recorded: bool = False
    title: str = ""
    lines: Sequence[tuple[str, Look]] = ()


def with_notes(page: str, notes: PageNotes) -> str:
    """Meshcat's page with notes; it opens without a server as before."""
    data = {
        "names": list(notes.names),
        "places": [[float(x) for x in place] for place in notes.places.T],
        "scale": float(notes.full_scale),
        "colors": TENSIONS,
        "slack": SLACK,
        "recorded": notes.recorded,
        "title": notes.title,
        "lines": [[words, look.color] for words, look in notes.lines],
    }
    words = json.dumps(data).replace("<", "\\u003c")  # no name can end the script
    body = page.rindex("</body>")
    return f"{page[:body]}{_NOTES.replace('@DATA@', words)}{page[body:]}"


_NOTES = """
<style>
  .cdpr-note { position: fixed; left: 12px; font: 13px sans-serif; color: #202020;
    background: rgba(255, 255, 255, 0.8); padding: 6px 8px; border-radius: 4px; z-index: 5; }
  #cdpr-head { top: 12px; max-width: 40vw; }
  #cdpr-time { font-size: 17px; font-variant-numeric: tabular-nums; }
  #cdpr-bar { bottom: 12px; }
  #cdpr-bar i { display: inline-block; width: 18px; height: 12px; margin-right: 6px; }
  .cdpr-name { position: fixed; font: bold 12px sans-serif; color: #202020; z-index: 4;
    text-shadow: 0 0 3px white, 0 0 3px white; pointer-events: none; }
</style>
<script type="application/json" id="cdpr-data">@DATA@</script>
<script>
(function () {
  const data = JSON.parse(document.getElementById("cdpr-data").textContent);
  function add(parent, kind, name, words) {
    const made = document.createElement(kind);
    if (name.startsWith("#")) { made.id = name.slice(1); } else if (name) { made.className = name; }
    if (words) { made.textContent = words; }
    parent.appendChild(made);
    return made;
  }
  function row(parent, color, words) {
    const line = add(parent, "div", "");
    add(line, "i", "").style.background = color;
    add(line, "span", "", words);
  }
  const number = new Intl.NumberFormat("en", { maximumSignificantDigits: 3, useGrouping: false });
  let clock = null;
  if (data.title || data.recorded) {
    const head = add(document.body, "div", "#cdpr-head");
    head.classList.add("cdpr-note");
    if (data.title) { add(head, "div", "", data.title); }
    if (data.recorded) { clock = add(head, "div", "#cdpr-time"); }
  }
  const bar = add(document.body, "div", "#cdpr-bar");
  bar.classList.add("cdpr-note");
  if (data.scale > 0) {
    add(bar, "div", "", "cable tension [N]");
    const step = data.scale / data.colors.length;
    for (let k = data.colors.length - 1; k >= 0; k--) {
      row(bar, data.colors[k], number.format(k * step) + " to " + number.format((k + 1) * step));
    }
  }
  row(bar, data.slack, "slack");
  for (const line of data.lines) { row(bar, line[1], line[0]); }
  const choice = add(add(bar, "label", ""), "input", "");
  choice.type = "checkbox";
  choice.checked = true;
  choice.parentElement.append(" names of the cables");
  const names = data.names.map((name) => add(document.body, "div", "cdpr-name", name));

  function times(m, v) {  // a column-major matrix of three.js on a vector of four
    return [0, 1, 2, 3].map((i) => m[i] * v[0] + m[4 + i] * v[1] + m[8 + i] * v[2]
      + m[12 + i] * v[3]);
  }
  function tick() {
    requestAnimationFrame(tick);
    if (clock) { clock.textContent = viewer.animator.time.toFixed(2) + " s"; }
    const pane = viewer.renderer.domElement.getBoundingClientRect();
    const taken = [];
    names.forEach((name, k) => {
      let v = times(viewer.scene.matrixWorld.elements, [...data.places[k], 1]);
      v = times(viewer.camera.matrixWorldInverse.elements, v);
      v = times(viewer.camera.projectionMatrix.elements, v);
      const shown = choice.checked && v[3] > 0;
      name.style.display = shown ? "block" : "none";
      if (shown) {
        const left = pane.left + (v[0] / v[3] + 1) / 2 * pane.width;
        let top = pane.top + (1 - v[1] / v[3]) / 2 * pane.height - 18;
        const width = name.offsetWidth + 2;
        while (taken.some((t) => Math.abs(t[0] - left) < Math.max(width, t[2])
            && Math.abs(t[1] - top) < 14)) { top -= 14; }
        taken.push([left, top, width]);
        name.style.left = left + "px";
        name.style.top = top + "px";
      }
    });
  }
  tick();
})();
</script>
"""

"use strict";
(function () {
  const data = JSON.parse(document.getElementById("cdpr-data").textContent);
  const pane = document.getElementById("meshcat-pane");
  const number = new Intl.NumberFormat("en", { maximumSignificantDigits: 3, useGrouping: false });

  function add(parent, kind, name, words) {
    const made = document.createElement(kind);
    if (name.startsWith("#")) { made.id = name.slice(1); } else if (name) { made.className = name; }
    if (words) { made.textContent = words; }
    parent.appendChild(made);
    return made;
  }
  function unpacked(words, kind) {
    return new kind(Uint8Array.from(atob(words), (c) => c.charCodeAt(0)).buffer);
  }

  // Light or dark: as the system has it, until the button says otherwise.
  const system = matchMedia("(prefers-color-scheme: dark)");
  let dark = system.matches;
  const themed = [];  // what is drawn anew in another theme
  const color = (look) => (dark ? look.dark : look.light);
  function paintBackground() {
    const [top, bottom] = dark
      ? [[0.40, 0.43, 0.48], [0.30, 0.33, 0.37]] : [[0.92, 0.94, 0.97], [0.98, 0.98, 0.98]];
    setProperty(["Background", "<object>"], "top_color", top);
    setProperty(["Background", "<object>"], "bottom_color", bottom);
  }
  const setProperty = viewer.set_property.bind(viewer);
  viewer.set_property = (path, name, value) => {  // the scene brings a background of its own
    setProperty(path, name, value);
    if (path[0] === "Background" && name !== "visible") { paintBackground(); }
  };
  function setTheme(wanted) {
    dark = wanted;
    document.documentElement.classList.toggle("cdpr-dark", dark);
    paintBackground();
    for (const draw of themed) { draw(); }
    viewer.set_dirty();
  }
  system.addEventListener("change", (event) => setTheme(event.matches));

  // What the scene says: title, colours, names of the cables.
  function note(kind, name) {
    const made = add(pane, kind, name);
    made.classList.add("cdpr-note");
    for (const event of ["pointerdown", "wheel"]) {  // else the scene would turn under it
      made.addEventListener(event, (e) => e.stopPropagation());
    }
    return made;
  }
  const head = data.title ? note("div", "#cdpr-head") : null;
  if (head) { head.textContent = data.title; }
  const bar = note("details", "#cdpr-bar");
  bar.open = innerWidth > 820;
  add(bar, "summary", "", "colours");
  function row(words, paint) {
    const line = add(bar, "div", ""), square = add(line, "i", "");
    add(line, "span", "", words);
    themed.push(() => { square.style.background = paint(); });
  }
  if (data.scale > 0) {
    add(bar, "div", "", "cables by tension [N]");
    const step = data.scale / data.colors.length;
    for (let k = data.colors.length - 1; k >= 0; k--) {
      const words = number.format(k * step) + " to " + number.format((k + 1) * step);
      row(words, () => data.colors[k]);
    }
  }
  if (data.slack) { row("slack", () => data.slack); }
  for (const [words, look] of data.lines) { row(words, () => color(look)); }
  const choice = add(add(bar, "label", ""), "input", "");
  choice.type = "checkbox";
  choice.checked = true;
  choice.parentElement.append(" names of the cables");
  const names = data.names.map((name, k) => {
    const made = add(pane, "div", "cdpr-name", name);
    themed.push(() => { made.style.borderBottomColor = color(data.looks[k]); });
    return made;
  });
  function times(m, v) {  // a column-major matrix of three.js on a vector of four
    return [0, 1, 2, 3].map((i) => m[i] * v[0] + m[4 + i] * v[1] + m[8 + i] * v[2]
      + m[12 + i] * v[3]);
  }
  function placeNames() {
    const width = pane.clientWidth, height = pane.clientHeight, taken = [];
    const under = head ? head.offsetTop + head.offsetHeight + 2 : 0;
    const beside = head ? head.offsetLeft + head.offsetWidth : 0;
    const moved = replay ? replay.places() : null;  // exit points of a mechanism may move
    names.forEach((name, k) => {
      const place = moved ? moved.subarray(3 * k, 3 * k + 3) : data.places[k];
      let v = times(viewer.scene.matrixWorld.elements, [...place, 1]);
      v = times(viewer.camera.matrixWorldInverse.elements, v);
      v = times(viewer.camera.projectionMatrix.elements, v);
      const shown = choice.checked && v[3] > 0;
      name.style.display = shown ? "block" : "none";
      if (shown) {
        const left = (v[0] / v[3] + 1) / 2 * width, wide = name.offsetWidth + 2;
        const own = (1 - v[1] / v[3]) / 2 * height - 20;
        const isTaken = (top) => taken.some((t) => Math.abs(t[0] - left) < Math.max(wide, t[2])
            && Math.abs(t[1] - top) < 18);
        let top = own;
        while (isTaken(top)) { top -= 18; }
        if (top < under && left < beside) {  // it would lie under the title
          top = Math.max(own, under);
          while (isTaken(top)) { top += 18; }
        }
        taken.push([left, top, wide]);
        name.style.left = left + "px";
        name.style.top = top + "px";
      }
    });
  }
  new ResizeObserver(() => {
    viewer.set_3d_pane_size();
    // A narrow pane sees as much of the robot across as a wide one.
    viewer.camera.zoom = Math.min(1, pane.clientWidth / Math.max(pane.clientHeight, 1) / 1.25);
    viewer.set_dirty();
  }).observe(pane);

  const replay = data.frames ? makeReplay() : null;
  function tick(now) {
    requestAnimationFrame(tick);
    if (replay) { replay(now); }
    placeNames();
  }
  setTheme(dark);
  requestAnimationFrame(tick);

  // The rest is about recordings.
  function makeReplay() {
    const count = data.names.length;
    const time = unpacked(data.frames.time, Float64Array);
    const tensions = unpacked(data.frames.tensions, Float32Array);
    const slack = unpacked(data.frames.slack, Uint8Array);
    const last = time.length - 1, start = time[0], end = time[last];
    let t = start, frame = 0, playing = false, before = null, ready = false, changed = true;

    document.body.classList.add("cdpr-replay");
    const side = add(document.body, "div", "#cdpr-side");
    const drawImage = data.camera ? makeCamera(side) : null;
    const plot = makePlot(side);
    const values = makeValues(side);

    const deck = add(document.body, "div", "#cdpr-deck");
    function button(name, words, says, does) {
      const made = add(deck, "button", name, words);
      made.type = "button";
      made.title = says;
      made.setAttribute("aria-label", says);
      made.addEventListener("click", does);
      return made;
    }
    const play = button("#cdpr-play", "▶", "play or pause (space)", () => run(!playing));
    button("#cdpr-back", "◀|", "frame before (left)", () => step(-1));
    button("#cdpr-next", "|▶", "next frame (right)", () => step(1));
    const axis = add(deck, "input", "#cdpr-axis");
    Object.assign(axis, { type: "range", min: start, max: end, step: "any", value: start });
    axis.setAttribute("aria-label", "time [s]");
    axis.addEventListener("input", () => { run(false); seek(Number(axis.value)); });
    const clock = add(deck, "div", "#cdpr-time");
    const speed = add(deck, "select", "#cdpr-speed");
    speed.title = "play speed (up, down)";
    speed.setAttribute("aria-label", "play speed");
    for (const factor of [0.1, 0.25, 0.5, 1, 2, 5, 10, 50]) {
      const option = add(speed, "option", "", factor + " x");
      option.value = factor;
      option.selected = factor === 1;
    }
    button("#cdpr-theme", "◐", "light or dark", () => setTheme(!dark));
    add(deck, "span", "#cdpr-keys", "space: play · ←→: frame · shift ←→: 1 s · ↑↓: speed");

    function nearest(wanted) {
      let low = 0, high = last;
      while (low < high) {
        const middle = (low + high) >> 1;
        if (time[middle] < wanted) { low = middle + 1; } else { high = middle; }
      }
      return low > 0 && wanted - time[low - 1] < time[low] - wanted ? low - 1 : low;
    }
    function show(wanted) {  // a time; what is shown in numbers is that of the nearest frame
      t = Math.min(Math.max(wanted, start), end);
      frame = nearest(t);
      changed = true;
    }
    function seek(wanted) { show(time[nearest(wanted)]); }
    function step(by) { run(false); show(time[Math.min(Math.max(frame + by, 0), last)]); }
    function run(wanted) {
      if (wanted && t >= end) { show(start); }
      playing = wanted;
      before = null;
      play.textContent = playing ? "❚❚" : "▶";
      if (!playing) { seek(t); }
    }
    function onKey(event) {
      const typing = event.target.closest && event.target.closest(".dg, textarea");
      if (typing || event.ctrlKey || event.metaKey || event.altKey) { return; }
      const choices = speed.options.length - 1;
      const keys = {
        " ": () => run(!playing),
        ArrowLeft: () => (event.shiftKey ? (run(false), seek(t - 1)) : step(-1)),
        ArrowRight: () => (event.shiftKey ? (run(false), seek(t + 1)) : step(1)),
        ArrowUp: () => { speed.selectedIndex = Math.min(speed.selectedIndex + 1, choices); },
        ArrowDown: () => { speed.selectedIndex = Math.max(speed.selectedIndex - 1, 0); },
        Home: () => { run(false); show(start); },
        End: () => { run(false); show(end); },
      };
      if (keys[event.key]) {
        keys[event.key]();
        event.preventDefault();
        event.stopPropagation();
      }
    }
    document.addEventListener("keydown", onKey, true);

    // Meshcat loads what the page holds bit by bit; the recording is the last of it.
    function takeOver() {
      const animator = viewer.animator;
      if (!animator.actions.length) { return false; }
      for (const action of animator.actions) { action.play(); }
      animator.clock.stop();
      animator.playing = false;
      // The menu of Meshcat does what the page's buttons do.
      animator.play = () => run(true);
      animator.pause = () => { run(false); if (animator.recording) {
        animator.stop_capture(); animator.save_capture(); } };
      animator.reset = () => show(start);
      if (animator.time_scrubber) { animator.time_scrubber.onChange((wanted) => seek(wanted)); }
      const asked = /[#&]t=([0-9.]+)/.exec(location.hash);
      if (asked) { seek(Number(asked[1])); }
      run(!asked && !matchMedia("(prefers-reduced-motion: reduce)").matches);
      return true;
    }
    const pose = viewer.animator.seek.bind(viewer.animator);
    for (const draw of [plot.redraw, values.redraw, () => { changed = true; }]) {
      themed.push(draw);
    }
    const places = data.frames.places ? unpacked(data.frames.places, Float32Array) : null;
    function turn(now) {
      if (!ready) { ready = takeOver(); }
      if (playing) {
        if (before !== null) { show(t + (now - before) / 1000 * Number(speed.value)); }
        before = now;
        if (t >= end) { run(false); }
      }
      if (!changed) { return; }
      changed = false;
      if (ready) { pose(t); viewer.animator.time = t; }
      const words = time[frame].toFixed(2);
      clock.textContent = words + " / " + end.toFixed(2) + " s";
      axis.value = t;
      axis.setAttribute("aria-valuetext", words + " s");
      plot.cursor(t);
      values.show();
      if (drawImage) { drawImage(); }
    }
    turn.places = () => places && places.subarray(3 * count * frame, 3 * count * (frame + 1));
    return turn;

    function onCanvas(canvas) {  // sized to the pixels of the screen, in units of the page
      const ratio = devicePixelRatio || 1;
      const width = canvas.clientWidth, height = canvas.clientHeight;
      canvas.width = Math.max(1, Math.round(width * ratio));
      canvas.height = Math.max(1, Math.round(height * ratio));
      const pen = canvas.getContext("2d");
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.clearRect(0, 0, width, height);
      return [pen, width, height];
    }
    function style(name) {
      return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    }

    function makeValues(parent) {
      const box = add(parent, "div", "#cdpr-values");
      box.setAttribute("role", "table");
      box.setAttribute("aria-label", "tensions at the shown time [N]");
      const cells = data.names.map((name, k) => {
        const cell = add(box, "div", "cdpr-value");
        const look = data.looks[k];
        cell.innerHTML = '<svg viewBox="0 0 26 10" aria-hidden="true"><line x1="0" y1="5" '
          + 'x2="26" y2="5" stroke-width="3"/></svg>';
        const line = cell.querySelector("line");
        line.setAttribute("stroke-dasharray", look.dash.join(" "));
        add(cell, "span", "", name);
        return { cell, line, look, value: add(cell, "b", "") };
      });
      return {
        redraw: () => { for (const c of cells) { c.line.style.stroke = color(c.look); } },
        show: () => cells.forEach((c, k) => {
          const value = tensions[frame * count + k], hangs = slack[frame * count + k] > 0;
          const words = Number.isNaN(value) ? "unknown" : number.format(value) + " N";
          c.value.textContent = hangs ? "slack " + words : words;
          c.value.dataset.newtons = value;
          c.cell.classList.toggle("cdpr-slack", hangs);
          if (data.scale > 0) {
            const level = Math.min(Math.floor(data.colors.length * value / data.scale),
              data.colors.length - 1);
            c.value.style.borderRightColor = hangs ? data.slack : data.colors[level] || "";
          }
        }),
      };
    }

    function makePlot(parent) {
      const head = add(parent, "h2", "", "Tensions ");
      add(head, "span", "", "[N] over time [s]");
      const canvas = add(parent, "canvas", "#cdpr-plot");
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", "tensions of the cables over time");
      const at = unpacked(data.curves.time, Float64Array);
      const values = unpacked(data.curves.tensions, Float32Array);
      // When which cable is slack: a lane for each that ever is.
      const lanes = data.names.map((_, k) => k).filter((k) => time.some(
        (_, i) => slack[i * count + k]));
      const lane = lanes.length > 8 ? 6 : 12;
      let top = 0;
      for (const value of values) { if (value > top) { top = value; } }
      if (data.curves.limits && data.curves.limits[1] < 1.6 * top) {
        top = Math.max(top, data.curves.limits[1]);
      }
      top = top > 0 ? 1.05 * top : 1;
      let still = null, box = null;

      const x = (when) => box.left + (when - start) / Math.max(end - start, 1e-9) * box.width;
      const y = (value) => box.top + (1 - value / top) * box.height;
      function ticks(low, high, most) {
        const raw = (high - low) / most, size = 10 ** Math.floor(Math.log10(raw));
        const gap = [1, 2, 5, 10].map((f) => f * size).find((g) => g >= raw * (1 - 1e-9));
        const digits = Math.max(0, -Math.floor(Math.log10(gap) + 1e-9));
        const made = [];
        for (let k = Math.ceil(low / gap - 1e-9); k * gap <= high + 1e-9 * gap; k++) {
          made.push([k * gap, (k * gap).toFixed(digits)]);
        }
        return made;
      }
      function redraw() {
        const [pen, width, height] = onCanvas(canvas);
        const room = lanes.length ? lane * lanes.length + 6 : 0;
        box = { left: 44, top: 6, width: width - 52, height: height - 30 - room };
        if (box.width < 20 || box.height < 20) { still = null; return; }
        const words = style("--cdpr-words"), edge = style("--cdpr-edge");
        pen.font = "12px sans-serif";
        pen.lineWidth = 1;
        pen.strokeStyle = edge;
        pen.fillStyle = words;
        const line = (x0, y0, x1, y1) => {
          pen.beginPath(); pen.moveTo(x0, y0); pen.lineTo(x1, y1); pen.stroke();
        };
        pen.textAlign = "right";
        pen.textBaseline = "middle";
        for (const [value, label] of ticks(0, top, Math.max(2, box.height / 36))) {
          line(box.left, y(value), box.left + box.width, y(value));
          pen.fillText(label, box.left - 5, y(value));
        }
        pen.textAlign = "center";
        pen.textBaseline = "top";
        const foot = box.top + box.height + room;
        if (end > start) {
          for (const [when, label] of ticks(start, end, Math.max(2, box.width / 80))) {
            line(x(when), box.top, x(when), box.top + box.height);
            pen.fillText(label, x(when), foot + 6);
          }
        }
        pen.save();
        pen.beginPath();
        pen.rect(box.left, box.top - 2, box.width, box.height + 4);
        pen.clip();
        if (data.curves.limits) {
          pen.setLineDash(data.roles.bound.dash);
          pen.strokeStyle = color(data.roles.bound);
          for (const limit of data.curves.limits) {
            line(box.left, y(limit), box.left + box.width, y(limit));
          }
        }
        pen.lineWidth = 1.8;
        pen.lineJoin = "round";
        for (let k = 0; k < count; k++) {
          pen.setLineDash(data.looks[k].dash);
          pen.strokeStyle = color(data.looks[k]);
          pen.beginPath();
          let down = false;
          for (let i = 0; i < at.length; i++) {
            const value = values[i * count + k];
            if (Number.isNaN(value)) { down = false; continue; }
            if (down) { pen.lineTo(x(at[i]), y(value)); } else { pen.moveTo(x(at[i]), y(value)); }
            down = true;
          }
          pen.stroke();
        }
        pen.restore();
        pen.setLineDash([]);
        pen.textAlign = "right";
        pen.textBaseline = "middle";
        pen.font = "10px sans-serif";
        lanes.forEach((k, number) => {
          const high = box.top + box.height + 5 + lane * number;
          pen.fillStyle = edge;
          pen.fillRect(box.left, high + lane / 2 - 1, box.width, 1);
          pen.fillStyle = data.slack;
          for (let i = 0; i <= last; i++) {
            if (!slack[i * count + k]) { continue; }
            let j = i;
            while (j < last && slack[(j + 1) * count + k]) { j++; }
            pen.fillRect(x(time[i]), high, Math.max(x(time[j]) - x(time[i]), 2), lane - 2);
            i = j;
          }
          pen.fillStyle = words;
          const says = lane < 12 ? (number ? "" : "slack") : data.names[k] + " slack";
          pen.fillText(says, box.left - 4, high + lane / 2 - 1, box.left - 6);
        });
        pen.strokeStyle = words;
        pen.lineWidth = 1;
        pen.strokeRect(box.left, box.top, box.width, box.height);
        still = document.createElement("canvas");
        still.width = canvas.width;
        still.height = canvas.height;
        still.getContext("2d").drawImage(canvas, 0, 0);
      }
      function cursor(when) {
        if (!still) { return; }
        const pen = canvas.getContext("2d");
        pen.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
        pen.drawImage(still, 0, 0, canvas.clientWidth, canvas.clientHeight);
        pen.strokeStyle = style("--cdpr-words");
        pen.lineWidth = 2;
        pen.beginPath();
        pen.moveTo(x(when), box.top);
        pen.lineTo(x(when), box.top + box.height);
        pen.stroke();
        for (let k = 0; k < count; k++) {
          const value = tensions[frame * count + k];
          if (Number.isNaN(value)) { continue; }
          pen.fillStyle = slack[frame * count + k] ? data.slack : color(data.looks[k]);
          pen.beginPath();
          pen.arc(x(when), y(value), 4, 0, 7);
          pen.fill();
        }
      }
      function drag(event) {
        if (!still || !(event.buttons & 1)) { return; }
        run(false);
        seek(start + (event.offsetX - box.left) / box.width * (end - start));
      }
      canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        drag(event);
      });
      canvas.addEventListener("pointermove", drag);
      new ResizeObserver(() => { redraw(); changed = true; }).observe(canvas);
      return { redraw, cursor };
    }

    function makeCamera(parent) {
      const camera = data.camera, size = camera.size;
      const marks = unpacked(camera.marks, Float32Array);
      const found = unpacked(camera.found, Uint8Array);
      const head = add(parent, "h2", "", "Camera ");
      const source = camera.images.length ? "images and marks of the run"
        : "marks of the " + camera.kind + " camera";
      add(head, "span", "", source + ", " + camera.width + " x " + camera.height + " px");
      const canvas = add(parent, "canvas", "#cdpr-image");
      canvas.style.aspectRatio = camera.width + " / " + camera.height;
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", "image of the camera: the target's marks, and where "
        + "they should be, dashed");
      const per = camera.mark === "corners" ? 2 : 5;
      const images = camera.images.map(([when, address]) => {
        const image = new Image();
        image.onload = () => { changed = true; };
        image.src = address;
        return [when, image];
      });
      const centre = (from, list) => {
        let u = 0, v = 0;
        for (let k = 0; k < size; k += per) { u += list[from + k]; v += list[from + k + 1]; }
        return [u * per / size, v * per / size];
      };
      const stride = Math.max(1, Math.ceil(last / 600));
      const path = [];
      for (let k = 0; k <= last; k += stride) {
        path.push(found[k] ? centre(k * size, marks) : null);
      }
      function trace(pen, from, list) {
        pen.beginPath();
        for (let k = 0; k < size; k += per) {
          const u = list[from + k], v = list[from + k + 1];
          if (per === 2) {
            if (k % 8 === 0) { if (k) { pen.closePath(); } pen.moveTo(u, v); }
            else { pen.lineTo(u, v); }
            continue;
          }
          // Semi-axes are twice the roots of the moments' eigenvalues.
          const [n20, n11, n02] = [list[from + k + 2], list[from + k + 3], list[from + k + 4]];
          const mean = (n20 + n02) / 2, off = Math.hypot((n20 - n02) / 2, n11);
          const long = 2 * Math.sqrt(Math.max(mean + off, 0));
          const short = 2 * Math.sqrt(Math.max(mean - off, 0));
          const angle = Math.atan2(2 * n11, n20 - n02) / 2;
          pen.moveTo(u + long * Math.cos(angle), v + long * Math.sin(angle));
          pen.ellipse(u, v, long, short, angle, 0, 2 * Math.PI);
        }
        if (per === 2) { pen.closePath(); }
      }
      return function () {
        const [pen, width] = onCanvas(canvas);
        const scale = width / camera.width, one = 1 / scale;
        pen.scale(scale, scale);
        pen.translate(0.5, 0.5);  // pixels count from the middle of the first one
        let image = null;
        for (const [when, some] of images) { if (when <= time[frame] + 1e-9) { image = some; } }
        const pictured = image && image.complete && image.naturalWidth > 0;
        if (pictured) { pen.drawImage(image, -0.5, -0.5, camera.width, camera.height); }
        const halo = pictured ? "rgba(255, 255, 255, 0.7)" : null;
        function stroke(paint, wide, dash) {
          pen.setLineDash([]);
          if (halo) { pen.strokeStyle = halo; pen.lineWidth = (wide + 2) * one; pen.stroke(); }
          pen.strokeStyle = paint;
          pen.lineWidth = wide * one;
          pen.setLineDash(dash.map((d) => d * one));
          pen.stroke();
          pen.setLineDash([]);
        }
        let wanted = null;
        for (const [when, some] of camera.desired) {
          if (when <= time[frame] + 1e-9) { wanted = some; }
        }
        const [aim, seen] = [data.roles.desired, data.roles.target];
        const paintOf = (look) => (pictured ? look.light : color(look));
        if (wanted) { trace(pen, 0, wanted); stroke(paintOf(aim), 2.5, aim.dash); }
        if (!pictured) {
          pen.beginPath();
          let down = false;
          path.forEach((point, k) => {
            if (k * stride > frame) { return; }
            if (!point) { down = false; return; }
            if (down) { pen.lineTo(...point); } else { pen.moveTo(...point); }
            down = true;
          });
          stroke(style("--cdpr-faint"), 1.2, []);
        }
        if (found[frame]) {
          trace(pen, frame * size, marks);
          stroke(paintOf(seen), 2, []);
          pen.fillStyle = paintOf(seen);
          pen.beginPath();  // the first mark, which tells how it is turned
          pen.arc(marks[frame * size], marks[frame * size + 1], 4 * one, 0, 7);
          pen.fill();
        }
        pen.font = 13 * one + "px sans-serif";
        pen.textBaseline = "top";
        pen.fillStyle = style("--cdpr-ground");
        pen.fillRect(-0.5, -0.5, camera.width, 24 * one);
        let left = 8 * one;
        const words = found[frame] ? [["— target", seen]] : [["target not found", null]];
        words.push([wanted ? "- - desired" : "desired: out of view", aim]);
        for (const [says, look] of words) {
          pen.fillStyle = look ? color(look) : style("--cdpr-words");
          pen.fillText(says, left, 5 * one);
          left += pen.measureText(says).width + 14 * one;
        }
        canvas.dataset.found = found[frame];
      };
    }
  }
})();

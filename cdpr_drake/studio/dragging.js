// Exit and anchor points that are dragged in the scene, parallel to the screen. The scene comes from
// the same address as the page, so the page may look at what Meshcat draws: it finds the point under
// the pointer, moves it in the plane through it that faces the camera, and tells where in W it is.
(() => {
  if (window.studioDragging) return;
  window.studioDragging = true;
  const NEAR = 14, SAME = 2, PERIOD = 50, SLOW = 40, COARSE = 0.4, FORGIVEN = 0.02, BURST = 8;
  const times = (M, v) => [0, 1, 2, 3].map(
    (i) => M[i] * v[0] + M[i + 4] * v[1] + M[i + 8] * v[2] + M[i + 12] * v[3]);
  const frame = () => document.getElementById('scene');
  let held = null, last = 0, waiting = 0;

  function points(viewer) {
    const found = [];
    for (const kind of ['exit', 'anchor']) {
      const group = viewer.scene_tree.find(['drake', 'studio', kind]);
      for (const [name, child] of Object.entries(group.children)) {
        const E = child.object.matrixWorld.elements;
        if (child.children['<object>']) found.push({kind, number: Number(name),
          place: [E[12], E[13], E[14], 1], node: child.object});
      }
    }
    return found;
  }
  function onScreen(viewer, place) {
    const camera = viewer.camera, canvas = viewer.renderer.domElement;
    const c = times(camera.projectionMatrix.elements,
                    times(camera.matrixWorldInverse.elements, place));
    return {x: (c[0] / c[3] + 1) / 2 * canvas.clientWidth,
            y: (1 - c[1] / c[3]) / 2 * canvas.clientHeight, depth: c[2] / c[3]};
  }
  function inSpace(viewer, x, y, depth) {
    const camera = viewer.camera, canvas = viewer.renderer.domElement;
    const ndc = [2 * x / canvas.clientWidth - 1, 1 - 2 * y / canvas.clientHeight, depth, 1];
    const v = times(camera.projectionMatrixInverse.elements, ndc).map((a, _, all) => a / all[3]);
    return times(camera.matrixWorld.elements, v);
  }
  // Meshcat turns the world, whose z is up, to that of its library, whose y is up.
  const inWorld = (p) => [p[0], -p[2], p[1]];
  function tell(x, y, done) {
    clearTimeout(waiting);
    last = performance.now();
    const p = inSpace(frame().contentWindow.viewer, x + held.dx, y + held.dy, held.depth);
    emitEvent('studio_point', {kind: held.kind, number: held.number, done, at: inWorld(p)});
  }
  // Not each step of the pointer, but always the last one, at which the hand may rest.
  function tellSoon(x, y) {
    clearTimeout(waiting);
    const left = PERIOD - (performance.now() - last);
    if (left <= 0) tell(x, y, false);
    else waiting = setTimeout(() => { if (held) tell(x, y, false); }, left);
  }
  // Where pictures take longer than SLOW, as without a graphics card, the scene is drawn with fewer
  // pixels as long as a point is held. Most of what a screen shows is no new picture: FORGIVEN.
  function resolve(viewer, share) {
    viewer.renderer.setPixelRatio(window.devicePixelRatio * share);
    viewer.set_3d_pane_size();
    viewer.set_dirty();
  }
  // What moves one point are some tens of messages: one picture for all of them, not one between.
  function drawInBursts(viewer) {
    let soon = 0;
    viewer.set_dirty = () => {
      clearTimeout(soon);
      soon = setTimeout(() => { viewer.needs_render = true; }, BURST);
    };
  }
  function watchPictures(viewer) {
    let before = null, late = 0, isCoarse = false;
    drawInBursts(viewer);
    function picture(now) {
      if (!held) {
        delete viewer.set_dirty;
        viewer.set_dirty();
        if (isCoarse) resolve(viewer, 1.0);
        return;
      }
      late = before !== null && now - before > SLOW ? late + 1 : Math.max(0, late - FORGIVEN);
      before = now;
      if (late > 2 && !isCoarse) { isCoarse = true; resolve(viewer, COARSE); }
      requestAnimationFrame(picture);
    }
    requestAnimationFrame(picture);
  }
  function listen() {
    const w = frame() && frame().contentWindow;
    if (!w || !w.viewer || !w.viewer.renderer) { setTimeout(listen, 300); return; }
    const viewer = w.viewer, canvas = viewer.renderer.domElement;
    if (canvas.studioListens) return;
    canvas.studioListens = true;
    // The point that is nearest to the pointer; of points at one place there, that in front.
    const under = (event) => {
      let best = null;
      for (const point of points(viewer)) {
        const s = onScreen(viewer, point.place);
        const dx = s.x - event.offsetX, dy = s.y - event.offsetY, off = Math.hypot(dx, dy);
        if (off >= NEAR || s.depth >= 1) continue;
        const apart = best ? Math.hypot(dx - best.dx, dy - best.dy) : NEAR;
        if (!best || (apart < SAME ? s.depth < best.depth : off < best.off))
          best = {...point, depth: s.depth, off, dx, dy};
      }
      return best;
    };
    canvas.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      held = under(event);
      if (!held) return;
      event.stopImmediatePropagation();
      canvas.setPointerCapture(event.pointerId);
      watchPictures(viewer);
    }, true);
    canvas.addEventListener('pointermove', (event) => {
      if (!held) { canvas.style.cursor = under(event) ? 'grab' : ''; return; }
      event.stopImmediatePropagation();
      tellSoon(event.offsetX, event.offsetY);
    }, true);
    const end = (event) => {
      if (!held) return;
      event.stopImmediatePropagation();
      tell(event.offsetX, event.offsetY, true);
      held = null;
    };
    canvas.addEventListener('pointerup', end, true);
    canvas.addEventListener('pointercancel', end, true);
  }
  frame().addEventListener('load', listen);
  listen();
})();

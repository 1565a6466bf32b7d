// A narrow scene shows as much of the robot across as a wide one.
new ResizeObserver(([pane]) => {
  const {width, height} = pane.contentRect;
  viewer.camera.zoom = Math.min(1, width / Math.max(height, 1) / 1.25);
  viewer.camera.updateProjectionMatrix();
  viewer.set_dirty();
}).observe(document.getElementById('meshcat-pane'));

"""The replay page of a mechanism in a real browser: bodies, cables, eyelets and names move."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.analyses.visualization.mechanism_replay import (
    route_points,
    write_mechanism_replay,
)
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.models.mechanism_loader import load_mechanism
from tests.analyses.visualization.test_replay_in_browser import opened, scrub, shown_time
from tests.chromium import cleared, complaints

NEAR = 5e-4
"""The scene interpolates between frames, which are 1 ms early at most, and lets rods rest that move
by less than a quarter of their radius, 0.4 mm here [m]."""

PLACES = """
viewer.scene.updateMatrixWorld(true);
const inverse = viewer.scene.matrixWorld.clone().invert(), found = {points: {}, rods: {}};
const child = (node, name) => node.children.find((one) => one.name === name);
const place = (node) => inverse.clone().multiply(node.matrixWorld).elements.slice(12, 15);
let root = null;
viewer.scene.traverse((node) => { if (child(node, "points") && child(node, "cables")) {
  root = node; } });
for (const cable of child(root, "points").children.filter((one) => one.name.startsWith("C"))) {
  found.points[cable.name] = cable.children.filter((one) => /^[0-9]+$/.test(one.name))
    .sort((a, b) => a.name - b.name).map(place);
  found.rods[cable.name] = [];
  child(child(root, "cables"), cable.name).traverse((node) => {
    let seen = node.name === "rod";
    for (let up = node; up; up = up.parent) { seen = seen && up.visible; }
    if (seen) { found.rods[cable.name].push([Number(node.parent.name), place(node.parent)]); }
  });
}
return found;
"""


@pytest.fixture(scope="module")
def browser(started_browser):
    with cleared(started_browser) as page:
        yield page


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """An arm that bends for two seconds, one cable slack in the second one."""
    mechanism = load_mechanism("cable_arm")
    times = np.arange(51) * 0.04
    # A cable that changes its colour at a frame may be shown as it was until just after that.
    tensions = np.tile([10.0, 20.0, 30.0, 40.0], (51, 1))
    tensions[25:, 1] = 0.0
    positions = np.column_stack([0.3 * np.sin(times), 0.8 * np.sin(2.0 * times)])
    log = {"time": times, "positions": positions, "tensions": tensions}
    path = tmp_path_factory.mktemp("page") / "replay.html"
    write_mechanism_replay(path, mechanism, log, limits=(2.0, 300.0), title="an arm")
    plant = MultibodyPlant(0.0)
    added = add_mechanism(plant, mechanism)
    plant.Finalize()
    return path, log, plant, added.routes()


def test_cables_run_where_their_points_are(browser, recorded):
    path, log, plant, routes = recorded
    context = plant.CreateDefaultContext()
    opened(browser, path, "#t=0")
    for wanted in (0.0, 0.7, 1.6):
        scrub(browser, wanted)
        row = int(np.argmin(np.abs(log["time"] - wanted)))
        assert shown_time(browser) == pytest.approx(log["time"][row], abs=0.005)
        plant.SetPositions(context, log["positions"][row])
        points, found = route_points(plant, routes, context), browser.execute_script(PLACES)
        for i, name in enumerate(routes.names):
            own = points[:, routes.first[i] : routes.first[i + 1]].T
            np.testing.assert_allclose(found["points"][name], own, atol=NEAR)
            rods = [place for _, place in sorted(found["rods"][name])]
            np.testing.assert_allclose(rods, (own[1:] + own[:-1]) / 2.0, atol=NEAR)
    slack = browser.find_elements("css selector", ".cdpr-value.cdpr-slack")
    assert [cell.text.split()[:2] for cell in slack] == [["C2", "slack"]]
    assert complaints(browser) == []


def test_all_of_it_is_in_the_window(browser, recorded):
    """Also what no cable runs to: the end of the lower link."""
    path, log, plant, _ = recorded
    opened(browser, path, "#t=0")
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, log["positions"][0])
    lower = plant.GetBodyByName("lower")
    tip = plant.EvalBodyPoseInWorld(context, lower).multiply([0.0, 0.0, 0.35])
    across, up = browser.execute_script(
        "const v = viewer.camera.position.clone().set(...arguments[0])"
        ".applyMatrix4(viewer.scene.matrixWorld).project(viewer.camera); return [v.x, v.y]",
        tip.tolist(),
    )
    assert abs(across) < 1.0
    assert abs(up) < 1.0

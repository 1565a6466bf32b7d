"""The workspace panel in a real browser: what it computes is what the command computes."""

import json

import pytest

from cdpr_drake.cli.app import main
from cdpr_drake.studio.workbench.session import USUAL_ROBOT
from tests.chromium import cleared, complaints, wait_for
from tests.studio.test_browser import press, type_into

GRID = "5,5,5"


def test_a_static_workspace_has_the_volume_of_the_command(
    tmp_path, capsys, started_browser, studio
):
    with pytest.raises(SystemExit):
        main(["workspace", USUAL_ROBOT, "--grid", GRID, "--out", str(tmp_path / "own"), "--json"])
    told = json.loads(capsys.readouterr().out)["workspaces"]["static"]
    with cleared(started_browser) as page:
        page.get(studio[1])
        press(page, "Workspace")
        type_into(page, "grid", GRID)
        press(page, "Start")
        rows = "[...document.querySelectorAll('table[aria-label=Workspaces] tbody tr')]"
        wait_for(page, f"{rows}.length === 1")
        shown = page.execute_script(f"return {rows}[0].innerText.split(/\\s*[\\t\\n]\\s*/)")
        assert f"{told['corners_m3']:.4g} m^3" in shown
        assert f"{100.0 * told['corners_share']:.2f} %" in shown
        page.switch_to.frame("scene")
        solid = "viewer.scene_tree.find(['drake', 'workspaces', 'static', '<object>']).object"
        wait_for(page, f"{solid}.isMesh && {solid}.material.depthWrite === false")
        page.switch_to.default_content()
        assert complaints(page) == []

"""The panels for workspaces and studies, by NiceGUI's simulated user."""

import json
import shutil

import pytest

from cdpr_drake.studio.jobs import JobState
from cdpr_drake.studio.workspace import _views
from tests.studio.pages import field, open_panel, problems, shown, until

ROBOT = "acrobot_small"


@pytest.fixture(scope="module")
def work(tmp_path_factory, computed):
    """With a workspace, and a study whose words are not harmless."""
    folder = tmp_path_factory.mktemp("work")
    shutil.copytree(computed, folder / "workspaces" / "small")
    study = folder / "studies" / "tension-methods"
    study.mkdir(parents=True)
    statement = {"words": "<b>says</b>", "printed": "1", "found": "2", "verdict": "confirmed"}
    (study / "results.json").write_text(json.dumps({"study": "x", "statements": [statement]}))
    (study / "figure.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    return folder


async def test_results_of_the_folder_are_layers_with_the_volumes_of_the_command(
    user, bench, computed
):
    told = json.loads((computed / "results.json").read_text())["workspaces"]
    open_panel(user, "workspace")
    view = _views[bench]
    await until(lambda: view.regions is not None)
    assert field(user, "workspaces-results").value == "small"
    for name, numbers in told.items():
        assert field(user, f"volume-{name}").text == f"{numbers['corners_m3']:.4g} m^3"
    assert view.visible == {"all"}
    field(user, "layer-static").value = True
    assert view.visible == {"all", "static"}
    field(user, "plane-of").value = "capacity-margin"
    field(user, "plane-index").value = 3
    assert (view.plane.along, view.plane.index) == (2, 3)
    place = view.regions.axes[2][3]
    assert f"z = {place:.4g} m" in field(user, "plane-legend").content
    bench.calculator.submit(lambda: None).result(60.0)
    has = bench.calculator.submit(
        lambda: [bench.scene().meshcat.HasPath(f"workspaces/{name}")
                 for name in ("all", "static", "plane")]
    ).result(60.0)  # fmt: skip
    assert has == [True, True, True]
    assert problems(user) == []


async def test_a_robot_that_is_not_saved_is_not_asked_about(user, bench):
    open_panel(user, "workspace")
    await until(lambda: shown(user, "workspace-grid"))
    bench.robot.change(bench.robot.text + "\n# changed\n")
    user.find(marker="start-workspace").click()
    await until(lambda: problems(user))
    assert "save it" in problems(user)[-1]
    assert bench.jobs.jobs == []


async def test_wrong_values_are_said_at_their_fields_by_form_and_by_command(user, bench):
    open_panel(user, "workspace")
    field(user, "workspace-force").value = "much"
    user.find(marker="start-workspace").click()
    await until(lambda: field(user, "workspace-force").error)
    assert "accepted: a number" in field(user, "workspace-force").error
    assert bench.jobs.jobs == []
    field(user, "workspace-force").value = ""
    field(user, "workspace-grid").value = "five"
    user.find(marker="start-workspace").click()
    await until(lambda: bench.jobs.jobs)
    (job,) = bench.jobs.jobs
    await until(lambda: field(user, "workspace-grid").error)
    assert job.state == JobState.FAILED
    assert "--grid" in field(user, "workspace-grid").error
    assert field(user, "workspace-force").error is None


async def test_finished_studies_are_a_gallery_with_verdicts_and_figures(user):
    open_panel(user, "studies")
    await until(lambda: shown(user, "card-tension-methods"))
    await until(lambda: shown(user, "statements"))
    words = field(user, "statements").content
    assert "confirmed" in words
    assert "&lt;b&gt;says" in words  # words of a file are never a part of the page
    assert field(user, "figure").value == "figure.svg"

"""The panels for workspaces and studies, by NiceGUI's simulated user."""

import asyncio
import json
import shutil

import pytest

from cdpr_drake.studio.panels.workspace import _views
from cdpr_drake.studio.workbench.job import JobState
from tests.studio.pages import field, opened_page, problems, until


def there(user, marker):
    """Whether there is something with a mark; `find` raises where there is nothing."""
    try:
        return bool(user.find(marker=marker).elements)
    except AssertionError:
        return False


def open_panel(user, name):
    (tabs,) = {element.parent_slot.parent for element in user.find(marker=f"tab-{name}").elements}
    tabs.value = name


def test_results_of_the_folder_are_layers_with_the_volumes_of_the_command(tmp_path, computed):
    shutil.copytree(computed, tmp_path / "workspaces" / "small")
    told = json.loads((computed / "results.json").read_text())["workspaces"]

    async def look():
        async with opened_page(tmp_path, "acrobot_small") as (user, bench, _):
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

    asyncio.run(look())


def test_wrong_values_are_said_at_their_fields_by_form_and_by_command(tmp_path):
    async def look():
        async with opened_page(tmp_path, "acrobot_small") as (user, bench, _):
            open_panel(user, "workspace")
            await until(lambda: there(user, "workspace-grid"))
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

    asyncio.run(look())


def test_a_robot_that_is_not_saved_is_not_asked_about(tmp_path):
    async def look():
        async with opened_page(tmp_path, "acrobot_small") as (user, bench, _):
            open_panel(user, "workspace")
            bench.robot.change(bench.robot.text + "\n# changed\n")
            user.find(marker="start-workspace").click()
            await until(lambda: problems(user))
            assert "save it" in problems(user)[-1]
            assert bench.jobs.jobs == []

    asyncio.run(look())


@pytest.fixture
def finished_study(tmp_path):
    folder = tmp_path / "studies" / "tension-methods"
    folder.mkdir(parents=True)
    statement = {"words": "<b>says</b>", "printed": "1", "found": "2", "verdict": "confirmed"}
    (folder / "results.json").write_text(json.dumps({"study": "x", "statements": [statement]}))
    (folder / "figure.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    return tmp_path


def test_finished_studies_are_a_gallery_with_verdicts_and_figures(finished_study):
    async def look():
        async with opened_page(finished_study, "acrobot_small") as (user, _, _):
            open_panel(user, "studies")
            await until(lambda: there(user, "card-tension-methods"))
            await until(lambda: there(user, "statements"))
            words = field(user, "statements").content
            assert "confirmed" in words
            assert "&lt;b&gt;says" in words  # words of a file are never a part of the page
            assert field(user, "figure").value == "figure.svg"

    asyncio.run(look())

"""The panels of verbs, workspaces, studies and all commands, by NiceGUI's simulated user."""

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
    answer = json.loads((computed / "results.json").read_text())["workspaces"]
    open_panel(user, "workspace")
    view = _views[bench]
    await until(lambda: view.regions is not None)
    assert field(user, "workspaces-results").value == "small"
    for name, numbers in answer.items():
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
    user.find(marker="start-workspaces").click()
    await until(lambda: problems(user))
    assert "save it" in problems(user)[-1]
    assert bench.jobs.jobs == []


async def test_wrong_values_are_said_at_their_fields_by_form_and_by_command(user, bench):
    open_panel(user, "workspace")
    await until(lambda: shown(user, "workspace-force"))
    for key, value in (("force", "much"), ("grid", "five")):
        field(user, f"workspace-{key}").value = value
        user.find(marker="start-workspaces").click()
        await until(lambda key=key: field(user, f"workspace-{key}").error)
        assert f"--{key}: found '{value}'" in field(user, f"workspace-{key}").error
        field(user, f"workspace-{key}").value = ""
    assert bench.jobs.jobs == []
    field(user, "workspace-force").value = "-1"  # which the verb refuses, not the parser
    user.find(marker="start-workspaces").click()
    await until(lambda: bench.jobs.jobs)
    (job,) = bench.jobs.jobs
    await until(lambda: field(user, "workspace-force").error)
    assert job.state == JobState.FAILED
    assert field(user, "workspace-grid").error is None


async def start(user, bench, name, /, **values):
    """The job of a verb that is started in the panel of all commands."""
    open_panel(user, "commands")
    field(user, "verb-commands").value = name
    for key, value in values.items():
        await until(lambda key=key: shown(user, f"{name}-{key}"))
        field(user, f"{name}-{key}").value = value
    jobs = len(bench.jobs.jobs)
    user.find(marker="start-commands").click()
    await until(lambda: len(bench.jobs.jobs) > jobs)
    return bench.jobs.jobs[-1]


async def test_a_command_without_a_folder_answers_with_its_json(user, bench, work):
    job = await start(user, bench, "tension", method="infinity_norm")
    await until(lambda: bench.results.subject("answer") is not None)
    answer = json.loads((work / "commands" / f"{ROBOT}-tension" / "results.json").read_text())
    assert answer == job.result()
    assert len(answer["tensions_n"]) == 8
    assert job.arguments == ("tension", "--json", f"--robot={ROBOT}", "--method=infinity_norm")
    assert bench.results.subject("answer").digest == bench.subject.digest
    await until(lambda: shown(user, "table-Numbers"))


async def test_a_command_that_writes_files_shows_them(user, bench, work):
    await start(user, bench, "new", kind="controller", name="mine")
    await until(lambda: field(user, "commands-results").value == "new")
    await until(lambda: (work / "commands" / "new" / "results.json").is_file())
    assert (work / "commands" / "new" / "mine.py").is_file()


async def test_finished_studies_are_a_gallery_with_verdicts_and_figures(user):
    open_panel(user, "studies")
    await until(lambda: shown(user, "card-tension-methods"))
    await until(lambda: shown(user, "statements"))
    words = field(user, "statements").content
    assert "confirmed" in words
    assert "&lt;b&gt;says" in words  # words of a file are never a part of the page
    assert field(user, "figure").value == "figure.svg"

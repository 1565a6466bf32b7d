"""A scenario's fields, what changes of them become, and where is said what is wrong."""

import pytest

from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.studio.workbench.scenario_draft import COMMON, ScenarioDraft
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import robot_scenario_names, scenario_file


@pytest.mark.parametrize("name", ["acrobot_pbvs", "planar_computed_torque", "caroca_world"])
def test_every_field_given_back_is_the_same_scenario(tmp_path, name):
    draft = ScenarioDraft(name, tmp_path)
    fields = list(draft.form.all_fields())
    assert any(field.key in COMMON for field in fields)
    assert all(field.rule.doc for field in fields)
    for field in fields:
        draft.changes[field.key] = field.text
    before, after = load_scenario(name), draft.check()
    assert repr(after) == repr(before)


def test_changes_are_settings_and_the_old_text_is_none(tmp_path):
    draft = ScenarioDraft("acrobot_pbvs", tmp_path)
    draft.change("duration", "2.5")
    draft.change("integration.max_step", "")  # which may be null
    draft.change("robot", "acrobot_large")
    draft.change("robot", "acrobot_small")
    assert draft.settings() == ("duration=2.5", "integration.max_step=null")
    assert draft.check().duration == 2.5
    with pytest.raises(ScenarioError, match="there is no such field"):
        draft.change("nothing.here", "1")


@pytest.mark.parametrize(
    ("key", "text", "words"),
    [
        ("duration", "-1", "found -1; accepted: a number > 0 [s]"),
        ("duration", "a: b: c", "which is not YAML"),
        ("controller.lambda_0", "fast", "found fast; accepted: a number"),
        (
            "initial_pose.position",
            "[1, 2]",
            "found [1, 2]; accepted: 3 numbers >= -10000 and <= 10000 [m]",
        ),
        ("camera.kind", "painted", "found painted; accepted: one of"),
    ],
)
def test_what_is_wrong_is_said_at_its_field(tmp_path, key, text, words):
    draft = ScenarioDraft("acrobot_pbvs", tmp_path)
    draft.change(key, text)
    with pytest.raises(ScenarioError) as caught:
        draft.check()
    by_key, rest = draft.problems(caught.value)
    assert list(by_key) == [key]
    assert words in by_key[key]
    assert rest == []


def test_no_file_outside_of_the_folder_is_read(tmp_path):
    draft = ScenarioDraft("acrobot_pbvs", tmp_path)
    for key, text in (
        ("robot", "/etc/passwd"),
        ("robot", "../../etc/robot.yaml"),
        ("perturbations.believed_robot", "/etc/hostname.yaml"),
    ):
        if draft.field(key) is None:
            continue
        draft.changes = {key: text}
        with pytest.raises(CdprError, match="accepted: a file in the working folder"):
            draft.check()
    outside = tmp_path / "outside.yaml"
    outside.write_text(scenario_file("acrobot_pbvs").read_text())
    (tmp_path / "inside").mkdir()
    robot = tmp_path / "robot.yaml"
    robot.write_text("name: x\n")
    text = outside.read_text().replace("acrobot_small", str(robot))
    (tmp_path / "inside" / "acrobot_pbvs.yaml").write_text(text)
    with pytest.raises(CdprError):
        ScenarioDraft(str(tmp_path / "inside" / "acrobot_pbvs.yaml"), tmp_path / "inside")


def test_all_scenarios_of_the_package_can_be_worked_on(tmp_path):
    for name in robot_scenario_names()[::6]:
        assert ScenarioDraft(name, tmp_path).settings() == ()

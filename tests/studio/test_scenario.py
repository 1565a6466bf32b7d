"""A scenario that is changed: its form, what is run of it, and what is refused."""

from functools import partial

import pytest

from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.models.robot_loader import robot_names, robot_text
from cdpr_drake.schema.declarations import settings_of
from cdpr_drake.schema.typed_yaml import plain_value
from cdpr_drake.studio.document import Document
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.robot_files import RobotFiles
from cdpr_drake.studio.scenario import COMMON, ScenarioDraft, ScenarioForm
from cdpr_drake.studio.settings_form import SettingsForm, _with_copy, field_words, typed_value
from cdpr_drake.studio.yaml_edit import with_value
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import robot_scenario_names, scenario_file
from tests.studio.pages import field, problems, shown, simulated, type_into, until

SCENARIOS = robot_scenario_names()[::12]


def put(draft, key, value):
    place = tuple(int(part) if part.isdecimal() else part for part in key.split("."))
    draft.document.change(with_value(draft.document.text, place, value))


@pytest.fixture
def draft(tmp_path):
    return ScenarioDraft("acrobot_pbvs", tmp_path)


@pytest.fixture
def documents(tmp_path):
    files = RobotFiles(WorkingFolder(tmp_path))
    opened = [files.open(name) for name in robot_names()[::9]]
    robots = [Document(robot.text, robot.path, files.read) for robot in opened]
    return [*robots, *(ScenarioDraft(name, tmp_path).document for name in SCENARIOS)]


def test_changes_are_settings_and_the_old_value_is_none(draft):
    assert draft.settings() == ()
    put(draft, "duration", 2.5)
    put(draft, "integration.max_step", None)
    put(
        draft,
        "disturbances",
        {"pushes": [{"kind": "step", "start": 1.0, "end": 1.1, "force": [1.0, 0.0, 0.0]}]},
    )
    put(draft, "camera.kind", "projected")
    changed = draft.settings()
    assert changed[0] == "duration=2.5"
    assert load_scenario("acrobot_pbvs", changed).disturbances.pushes[0].force.tolist() == [1, 0, 0]
    assert repr(load_scenario("acrobot_pbvs", changed)) == repr(draft.document.value)
    for _ in range(4):
        draft.document.undo()
    assert draft.settings() == ()
    draft.robot = "acrobot_large"
    assert draft.settings() == ("robot=acrobot_large",)
    assert draft.check().robot == "acrobot_large"


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("duration", -1, "duration: found -1; accepted: a number > 0 [s]"),
        ("controller.lambda_0", "fast", "found fast; accepted: a number"),
        ("initial_pose.position", [1, 2], "found [1, 2]; accepted: 3 numbers"),
        ("camera.kind", "painted", "found painted; accepted: one of"),
        ("robot", "planar", "robot: found planar; accepted: that of the file"),
        ("robot", "/etc/passwd", "accepted: that of the file"),
        ("kind", "tension_control", "kind: found tension_control; accepted: that of the file"),
        ("perturbations.believed_robot", "/etc/hostname.yaml", "a file in the working folder"),
        ("perturbations.believed_robot", "../../etc/robot.yaml", "a file in the working folder"),
    ],
)
def test_what_is_wrong_is_said_and_changes_nothing(draft, tmp_path, key, value, words):
    with pytest.raises(ScenarioError) as refused:
        put(draft, key, value)
    assert words in "\n".join(draft.document.words(refused.value))
    assert str(tmp_path) not in "\n".join(draft.document.words(refused.value))
    assert not draft.document.can_undo


def test_no_scenario_with_a_file_outside_of_the_folder_is_opened(tmp_path):
    (tmp_path / "robot.yaml").write_text(robot_text("acrobot_small"))
    (tmp_path / "inside").mkdir()
    text = scenario_file("acrobot_pbvs").read_text()
    file = tmp_path / "inside" / "acrobot_pbvs.yaml"
    file.write_text(text.replace("robot: acrobot_small", f"robot: {tmp_path / 'robot.yaml'}"))
    assert ScenarioDraft(str(file), tmp_path).own_robot == str(tmp_path / "robot.yaml")
    with pytest.raises(CdprError, match="accepted: a file in the working folder"):
        ScenarioDraft(str(file), tmp_path / "inside")


def test_sections_are_added_so_that_a_run_can_be_disturbed_by_hand(draft):
    taken = draft.by_hand()
    assert "failures={events: []}" in taken
    put(draft, "failures", {"events": []})
    assert draft.by_hand() == tuple(item for item in taken if not item.startswith("failures"))


def places(settings, at=()):
    """Places of all fields of settings, with their rules."""
    for name, rule in settings_of(type(settings)).items():
        value = getattr(settings, name)
        if rule.kind == "sections":
            for k, item in enumerate(value):
                yield from places(item, (*at, name, k))
        elif rule.section and value is not None:
            yield from places(value, (*at, name))
        elif not rule.section:
            yield (*at, name), rule, value


async def test_every_field_is_shown_and_means_what_it_was(documents):
    forms = []
    async with simulated(lambda: forms.extend(map(SettingsForm, documents))):
        for form, document in zip(forms, documents, strict=True):
            fields = list(places(document.value))
            items = {
                at[:k] for at, *_ in fields for k in range(len(at)) if isinstance(at[k - 1], int)
            }
            with form._box:  # as the dialog behind "More" has them
                for item in items:
                    form._section(item)
            cells = {cell.place for cell in form._cells}
            for place, rule, value in fields:
                assert place in cells or (*place, 2) in cells
                assert typed_value(rule, field_words(rule, value)) == plain_value(value)


async def test_edits_that_need_each_other_are_taken_together(documents):
    robot, forms = documents[0], []
    start = robot.value.tension_bounds
    async with simulated(lambda: forms.append(SettingsForm(robot, mark="form"))) as user:
        type_into(user, "form-tension_bounds-lower", f"{start.upper + 10:g}")
        await until(lambda: any("accepted: lower < upper" in words for words in problems(user)))
        type_into(user, "form-platform-mass", "1.5")
        await until(lambda: robot.value.platform.mass == 1.5)
        assert robot.value.tension_bounds.lower == start.lower
        assert field(user, "form-tension_bounds-lower").value == f"{start.upper + 10:g}"
        type_into(user, "form-tension_bounds-upper", str(start.upper + 20))
        await until(lambda: robot.value.tension_bounds.lower == start.upper + 10)
        assert problems(user) == []
        cables = len(robot.value.cables)
        assert await forms[0].change(partial(_with_copy, ("cables", 0))) == ""
        assert len(robot.value.cables) == cables + 1
        await until(lambda: shown(user, f"form-cables-{cables}-name"))


async def test_a_run_waits_for_what_is_not_accepted_yet(draft):
    forms = []
    async with simulated(lambda: forms.append(ScenarioForm(draft))) as user:
        assert all(shown(user, f"field-{key.replace('.', '-')}") for key in COMMON[:6])
        type_into(user, "field-duration", "-3")
        await until(
            lambda: any("found -3; accepted: a number > 0 [s]" in w for w in problems(user))
        )
        assert not await forms[0].check()
        assert field(user, "scenario-problem").text == "not accepted yet: duration"
        type_into(user, "field-seed", "7")
        await until(lambda: draft.settings() == ("seed=7",))
        type_into(user, "field-duration", "2.50")
        await until(lambda: draft.settings() == ("duration=2.5", "seed=7"))
        assert field(user, "field-duration").value == "2.5"
        assert await forms[0].check()

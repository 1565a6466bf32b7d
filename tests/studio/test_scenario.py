"""A scenario that is changed: its form, what is run of it, and what is refused."""

import pytest

from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.models.robot_loader import parse_robot, robot_file, robot_names, robot_text
from cdpr_drake.schema.declarations import settings_of
from cdpr_drake.schema.typed_yaml import plain_value
from cdpr_drake.studio.document import Document
from cdpr_drake.studio.scenario import COMMON, ScenarioDraft, ScenarioForm
from cdpr_drake.studio.settings_form import SettingsForm, field_words, typed_value
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import robot_scenario_names, scenario_file
from tests.studio.pages import field, problems, put, shown, simulated, type_into, until


@pytest.fixture
def draft(tmp_path):
    return ScenarioDraft("acrobot_pbvs", tmp_path)


def test_changes_are_settings_and_the_old_value_is_none(draft):
    put(draft.document, ("duration",), 2.5)
    put(draft.document, ("integration", "max_step"), None)
    push = {"kind": "step", "start": 1.0, "end": 1.1, "force": [1.0, 0.0, 0.0]}
    put(draft.document, ("disturbances",), {"pushes": [push]})
    put(draft.document, ("camera", "kind"), "projected")
    changed = draft.settings()
    assert changed[0] == "duration=2.5"
    assert draft.document.value.disturbances.pushes[0].force.tolist() == [1, 0, 0]
    assert repr(load_scenario("acrobot_pbvs", changed)) == repr(draft.document.value)
    while draft.document.can_undo:
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
        ("perturbations.believed_robot", "../robot.yaml", "a file in the working folder"),
    ],
)
def test_what_is_wrong_is_said_and_changes_nothing(draft, tmp_path, key, value, words):
    with pytest.raises(ScenarioError) as refused:
        put(draft.document, tuple(key.split(".")), value)
    said = "\n".join(draft.document.words(refused.value))
    assert words in said
    assert str(tmp_path) not in said
    assert not draft.document.can_undo


def test_no_scenario_with_a_file_outside_of_the_folder_is_opened(tmp_path):
    robot, file = tmp_path / "robot.yaml", tmp_path / "inside" / "acrobot_pbvs.yaml"
    robot.write_text(robot_text("acrobot_small"))
    file.parent.mkdir()
    text = scenario_file("acrobot_pbvs").read_text()
    file.write_text(text.replace("robot: acrobot_small", f"robot: {robot}"))
    assert ScenarioDraft(str(file), tmp_path).own_robot == str(robot)
    with pytest.raises(CdprError, match="accepted: a file in the working folder"):
        ScenarioDraft(str(file), file.parent)


def test_sections_are_added_so_that_a_run_can_be_disturbed_by_hand(draft):
    added = draft.by_hand()
    assert "failures={events: []}" in added
    put(draft.document, ("failures",), {"events": []})
    assert {*draft.by_hand()} == {*added} - {"failures={events: []}"}


def places(settings, at=()):
    """Places of all fields of settings, with their rules and values."""
    for name, rule in settings_of(type(settings)).items():
        value = getattr(settings, name)
        if rule.kind == "sections":
            for k, item in enumerate(value):
                yield from places(item, (*at, name, k))
        elif not rule.section:
            yield (*at, name), rule, value
        elif value is not None:
            yield from places(value, (*at, name))


async def test_every_field_is_shown_and_means_what_it_was(tmp_path):
    robots, scenarios, forms = robot_names()[::9], robot_scenario_names()[::12], []
    documents = [Document(robot_text(name), robot_file(name), parse_robot) for name in robots]
    documents += [ScenarioDraft(name, tmp_path).document for name in scenarios]
    async with simulated(lambda: forms.extend(map(SettingsForm, documents))):
        for form, document in zip(forms, documents, strict=True):
            fields = list(places(document.value))
            above = {at[: k + 1] for at, *_ in fields for k in range(len(at))}
            with form._box:  # as the dialog behind "More" has them
                for place in above:
                    if isinstance(place[-1], int):
                        form._section(place)
            cells = {cell.place for cell in form._cells}
            for place, rule, value in fields:
                assert cells.intersection((place, (*place, 2)))
                assert typed_value(rule, field_words(rule, value)) == plain_value(value)


async def test_a_run_waits_for_what_is_not_accepted_yet(draft):
    forms = []
    async with simulated(lambda: forms.append(ScenarioForm(draft))) as user:
        assert all(shown(user, f"field-{key.replace('.', '-')}") for key in COMMON[:6])
        type_into(user, "field-duration", "-3")
        await until(lambda: problems(user))
        assert not await forms[0].check()
        assert field(user, "scenario-problem").text == "not accepted yet: duration"
        type_into(user, "field-seed", "7")
        await until(lambda: draft.settings() == ("seed=7",))
        type_into(user, "field-duration", "2.50")
        await until(lambda: draft.settings() == ("duration=2.5", "seed=7"))
        assert field(user, "field-duration").value == "2.5"
        assert await forms[0].check()

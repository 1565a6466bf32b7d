"""Texts in which one value changes and all else stays, and a scenario that is changed so.

Its form, what is run of it, and what is refused.
"""

import pytest
import yaml

from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.models.robot_loader import parse_robot, robot_file, robot_names, robot_text
from cdpr_drake.schema.declarations import settings_of
from cdpr_drake.schema.typed_yaml import plain_value
from cdpr_drake.studio.document import Document
from cdpr_drake.studio.scenario import COMMON, ScenarioDraft, ScenarioForm
from cdpr_drake.studio.settings_form import SettingsForm, field_words, typed_value
from cdpr_drake.studio.yaml_edit import flow, with_item, with_value, without_item
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import robot_scenario_names, scenario_file
from tests.studio.pages import do, field, put, shown, simulated, until

TEXT = """\
# a robot
name: toy  # its name
platform:
  mass: 3.5
  size: [0.1, 0.2, 0.3]
frame: {lower: [0, 0, 0], beam: 0.04}
home:
  position:
    - 0.0
    - 1.0
cables:
  - {name: C1, exit_point: [1.0, 2.0, 3.0]}
  - name: C2  # the second
    exit_point: [4.0, 5.0, 6.0]
assumptions: >-
  Many words
  on two lines.
# the end
"""


@pytest.mark.parametrize(
    ("path", "value", "line"),
    [
        (("platform", "mass"), 4.25, "  mass: 4.25"),
        (("platform", "size", 1), 1e-6, "  size: [0.1, 1.0e-06, 0.3]"),
        (("frame", "beam"), None, "frame: {lower: [0, 0, 0], beam: null}"),
        (("frame", "upper"), [1.0, 1.0, 1.0], "[0, 0, 0], beam: 0.04, upper: [1.0, 1.0, 1.0]}"),
        (("cables", 0, "exit_point"), [7.0, 8.0, 9.0], "{name: C1, exit_point: [7.0, 8.0, 9.0]}"),
        (("cables", 1, "winch"), "W1", "    winch: W1"),
        (("home", "position"), [2.0, 3.0], "  position: [2.0, 3.0]"),
        (("assumptions",), "None: at all", 'assumptions: "None: at all"'),
        (("name",), "other", "name: other  # its name"),
        (("platform", "box"), 0.1, "\n  mass: 3.5\n  box: 0.1\n  size: [0.1,"),
        (("winch", "loops", "bandwidth"), 3.0, "winch: {loops: {bandwidth: 3.0}}"),
    ],
)
def test_a_value_changes_where_it_stands(path, value, line):
    new = with_value(TEXT, path, value, ("mass", "box", "size"))  # the order of the schema
    assert line in new
    meant = place = yaml.safe_load(TEXT)
    for key in path[:-1]:
        place = place.setdefault(key, {}) if isinstance(place, dict) else place[key]
    place[path[-1]] = value
    assert yaml.safe_load(new) == meant
    assert all(words in new for words in ("# a robot", "# its name", "# the second", "# the end"))


def test_items_come_and_go():
    more = with_item(TEXT, ("cables",), {"name": "C3", "exit_point": [1.5, 2.0, 3.0]})
    assert "\n  - {name: C3, exit_point: [1.5, 2.0, 3.0]}\nassumptions" in more
    assert without_item(more, ("cables", 2)) == TEXT
    (cable,) = yaml.safe_load(without_item(TEXT, ("cables", 0)))["cables"]
    assert cable["name"] == "C2"
    new = with_item(TEXT, ("cameras",), {"name": "one"})
    assert yaml.safe_load(new)["cameras"] == [{"name": "one"}]


def test_what_cannot_be_edited_in_place_is_written_anew():
    new = with_value("a: &x {b: 1}\nc: *x\n", ("c", "b"), 2)
    assert yaml.safe_load(new) == {"a": {"b": 2}, "c": {"b": 2}}


@pytest.mark.parametrize("name", robot_names())
def test_every_robot_of_the_package_keeps_its_text(name):
    text = robot_text(name)
    new = with_value(text, ("platform", "mass"), 1.25)
    data = yaml.safe_load(text)
    data["platform"]["mass"] = 1.25
    assert yaml.safe_load(new) == data
    assert sum(a != b for a, b in zip(text.splitlines(), new.splitlines(), strict=True)) <= 1


@pytest.mark.parametrize(
    "value", [0.1, -1e300, 1e-7, 3, True, None, "yes", "1.0", "a: b", "ü", "", "x#y", "'", "é\n"]
)
def test_values_in_one_line_mean_what_they_were(value):
    assert yaml.safe_load(flow(value)) == value
    assert "\n" not in flow(value)


@pytest.fixture
def draft(tmp_path):
    return ScenarioDraft("acrobot_pbvs", tmp_path)


def test_changes_are_settings_and_the_old_value_is_none(draft):
    put(draft.document, ("duration",), 2.5)
    put(draft.document, ("integration", "max_step"), None)
    push = {"kind": "step", "start": 1.0, "end": 1.1, "force": [1.0, 0.0, 0.0]}
    put(draft.document, ("disturbances",), {"pushes": [push]})
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
        ("initial_pose.position", [1, 2], "found [1, 2]; accepted: 3 numbers"),
        ("robot", "planar", "robot: found planar; accepted: that of the file"),
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
        await do(user, "field-duration=-3", "field-seed=7")
        await until(lambda: draft.settings() == ("seed=7",))
        assert not await forms[0].check()
        assert field(user, "scenario-problem").text == "not accepted yet: duration"
        await do(user, "field-duration=2.50")
        await until(lambda: draft.settings() == ("duration=2.5", "seed=7"))
        assert field(user, "field-duration").value == "2.5"
        assert await forms[0].check()

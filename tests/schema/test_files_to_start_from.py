"""JSON schemas and commented files say what the loaders accept."""

from __future__ import annotations

import json
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO

import jsonschema
import pytest
import yaml

from cdpr_drake import models
from cdpr_drake.cli.app import main
from cdpr_drake.errors import RobotFileError
from cdpr_drake.systems import scenarios


def cdpr(*arguments):
    """The command's output and exit code, in this process."""
    printed = StringIO()
    with redirect_stdout(printed), redirect_stderr(printed), pytest.raises(SystemExit) as end:
        main(list(map(str, arguments)))
    return printed.getvalue(), end.value.code


@pytest.fixture(scope="module")
def validators():
    """Of robots and scenarios. `jsonschema.validate` would check the schema itself each time, which
    takes longer than all files."""
    made = {}
    for kind in ("robot", "scenario"):
        schema = json.loads(cdpr("schema", kind)[0])
        dialect = jsonschema.validators.validator_for(schema)
        assert dialect is jsonschema.Draft202012Validator
        dialect.check_schema(schema)
        made[kind] = dialect(schema)
    return made


def content_of(path):
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def as_numbers(value):
    """YAML 1.1 reads 1e9 as a text; editors with YAML 1.2, and our loader, as a number."""
    if isinstance(value, dict):
        return {str(key): as_numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [as_numbers(item) for item in value]
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value


@pytest.mark.parametrize("kind", ["robot", "scenario"])
def test_every_file_that_ships_is_accepted(kind, validators):
    paths = (
        [models.robot_file(name) for name in models.robot_names()]
        if kind == "robot"
        else [scenarios.scenario_file(name) for name in scenarios.scenario_names()]
    )
    for path in paths:
        validators[kind].validate(as_numbers(content_of(path)))


@pytest.mark.parametrize(
    ("keys", "value"),
    [
        (("platform", "mass"), 0.0),
        (("platform", "size"), [1.0, 2.0]),
        (("motion",), "9R"),
        (("unknown",), 1.0),
        (("cables",), {}),
        (("winch", "friction"), {"coulomb": 1.0}),
    ],
)
def test_what_the_loader_refuses_is_refused(keys, value, validators, tmp_path):
    place = wrong = as_numbers(content_of(models.robot_file("acrobot_large")))
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    with pytest.raises(jsonschema.ValidationError):
        validators["robot"].validate(wrong)
    path = tmp_path / "wrong.yaml"
    path.write_text(yaml.safe_dump(wrong))
    with pytest.raises(RobotFileError):
        models.load_robot(str(path))


@pytest.mark.parametrize("source", ["acrobot_large", "planar"])
def test_a_new_robot_is_the_one_it_began_as(source, tmp_path):
    output, code = cdpr("new", "robot", "mine", "--from", source, "--out", tmp_path)
    assert code == 0, output
    text = (tmp_path / "mine.yaml").read_text()
    assert "# Mass. A number > 0 and <= 1e+07 [kg]." in text
    mine, theirs = content_of(tmp_path / "mine.yaml"), content_of(models.robot_file(source))
    assert as_numbers(mine) == as_numbers({**theirs, "name": "mine"})
    _, code = cdpr("new", "robot", "mine", "--out", tmp_path)
    assert code != 0
    assert (tmp_path / "mine.yaml").read_text() == text


def test_a_new_scenario_runs_with_any_key_uncommented(tmp_path):
    output, code = cdpr("new", "scenario", "mine", "--out", tmp_path)
    assert code == 0, output
    text = (tmp_path / "mine.yaml").read_text()
    assert "# seed: 0" in text
    (tmp_path / "mine.yaml").write_text(text.replace("# seed: 0", "seed: 7"))
    output, code = cdpr("check", tmp_path / "mine.yaml", "--json")
    assert code == 0, output
    assert json.loads(output)[0]["kind"] == "scenario"


def test_check_says_all_that_is_wrong(tmp_path):
    path = tmp_path / "robot.yaml"
    text = models.robot_file("acrobot_large").read_text()
    path.write_text(text.replace("mass: 3.5", "mass: -1").replace("motion: 3R3T", "motion: 7T"))
    output, code = cdpr("check", path)
    assert code == 2
    assert "platform.mass" in output
    assert "motion" in output
    missing, code = cdpr("check", tmp_path / "nothing.yaml")
    assert code == 2
    assert "there is no such file" in missing

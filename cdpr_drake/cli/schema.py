"""`cdpr schema`: JSON schemas of the files that users write, for editors."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

from cdpr_drake.cli.completion import words_among
from cdpr_drake.errors import CdprError, accepted_names
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.json_schemas import json_schema
from cdpr_drake.systems.diagrams.load import SCENARIO_SCHEMAS

ROBOT, MECHANISM, SCENARIO = "robot", "mechanism", "scenario"
FILES = (ROBOT, MECHANISM, SCENARIO)


def file_schema(kind: str) -> dict[str, Any]:
    """The JSON schema of files of a kind; of scenarios, that of the file's `kind`.

    Raises:
        CdprError: There is no such kind of file.
    """
    if kind == ROBOT:
        return json_schema(Robot, "robot of cdpr_drake")
    if kind == MECHANISM:
        return json_schema(Mechanism, "mechanism of cdpr_drake")
    if kind != SCENARIO:
        raise CdprError(f"kind of file: found {kind}; {accepted_names(kind, FILES)}")
    kinds = {
        name: json_schema(schema, f"scenario of cdpr_drake, {name}")
        for name, (schema, _) in SCENARIO_SCHEMAS.items()
    }
    dialect = next(iter(kinds.values()))["$schema"]
    first, *others = kinds
    schema = {key: value for key, value in kinds[first].items() if key != "$schema"}
    for name in others:
        other = {key: value for key, value in kinds[name].items() if key != "$schema"}
        asked = {"properties": {"kind": {"const": name}}, "required": ["kind"]}
        schema = {"if": asked, "then": other, "else": schema}
    return {"$schema": dialect, "title": "scenario of cdpr_drake", **schema}


def schema(
    kind: Annotated[
        str, typer.Argument(help="robot, mechanism or scenario.", autocompletion=words_among(FILES))
    ],
) -> None:
    """Prints the JSON schema of robot, mechanism or scenario files, for editors."""
    print(json.dumps(file_schema(kind), indent=2))

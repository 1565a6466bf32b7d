"""`cdpr scenarios`: lists the scenarios that come with the package."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import scenario_names
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


def scenario_facts(scenario: Any) -> dict[str, Any]:
    """What a list of scenarios of any kind shows; SI units, null where a kind has none."""
    servo = scenario if isinstance(scenario, Scenario) else None
    return {
        "name": scenario.name,
        "title": scenario.title,
        "kind": scenario.kind,
        "robot": getattr(scenario, "robot", None),
        "mechanism": getattr(scenario, "mechanism", None),
        "scheme": servo.controller.scheme if servo else None,
        "target": servo.target.kind if servo else None,
        "camera": scenario.camera.kind if hasattr(scenario, "camera") else None,
        "duration_s": scenario.duration,
        "expected": None if scenario.expected is None else asdict(scenario.expected),
        "source": scenario.source,
    }


def _end(facts: dict[str, Any]) -> str:
    """The outcome that the file expects."""
    return "" if facts["expected"] is None else facts["expected"]["outcome"].replace("_", " ")


def scenarios(as_json: AsJson = False) -> None:
    """Lists the scenarios that come with the package."""
    with working(message_console(), "Reading scenarios"):
        facts = [scenario_facts(load_scenario(name)) for name in scenario_names()]
    if as_json:
        print_json(facts)
        return
    table = Table(title="Scenarios", box=SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    for heading in ("name", "robot", "duration", "ends"):
        table.add_column(heading, no_wrap=True)
    table.add_column("what it shows")
    for f in facts:
        table.add_row(
            f["name"], f["robot"] or f["mechanism"], f"{f['duration_s']:g} s", _end(f), f["title"]
        )
    wide_console().print(table)

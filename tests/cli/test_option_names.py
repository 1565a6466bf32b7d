"""Refusals name arguments in Python and options in commands."""

import pytest

from cdpr_drake.analyses.fits.calibration import calibrate
from cdpr_drake.analyses.fits.campaign import calibrate_campaign
from cdpr_drake.analyses.frame.follow import NOBODY
from cdpr_drake.analyses.runs.simulate import simulate
from cdpr_drake.analyses.runs.steering import steered
from cdpr_drake.analyses.studies.study import run_study
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.analyses.workspaces.workspace import compute_workspace
from cdpr_drake.cli.call import parsed
from cdpr_drake.cli.option_names import COMMAND_WORDS, with_options
from cdpr_drake.errors import CdprError
from cdpr_drake.sections.remote.server_socket import ServerSocket
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.cli.commands import run

SCENARIO, TORQUES = "acrobot_pbvs", "acrobot_computed_torque"
NOWHERE = "192.0.2.1"
"""An address that no machine has."""


@pytest.mark.parametrize(
    ("call", "arguments", "python", "command"),
    [
        (lambda: simulate(SCENARIO, ["seed=x"]), ["simulate", SCENARIO, "--set", "seed=x"],
         "overrides seed: found x", "--set seed: found x"),
        (lambda: simulate(SCENARIO, ["seed=x", "a=1"]),
         ["simulate", SCENARIO, "--set", "seed=x", "--set", "a=1"],
         "overrides a: there is no key", "--set a: there is no key"),
        (lambda: run_study("case-9", workers="tcp://127.0.0.1:1"),
         ["study", "case-9", "--workers", "tcp://127.0.0.1:1"],
         "workers: tcp://127.0.0.1:1 does not answer",
         "--workers: tcp://127.0.0.1:1 does not answer"),
        (lambda: compute_workspace("planar", grid=(2, 2, 1), workers="tcp://127.0.0.1:1"),
         ["workspace", "planar", "--grid", "2,2,1", "--workers", "tcp://127.0.0.1:1"],
         "workers: tcp://127.0.0.1:1 does not answer", "--workers: tcp://127.0.0.1:1 does not"),
        (lambda: open_meshcat(port=1), ["view", "planar", "--port", "1"],
         "port: found 1;", "--port: found 1;"),
        (lambda: open_meshcat(NOWHERE),
         ["simulate", SCENARIO, "--meshcat", "--set", "camera.kind=projected", "--host", NOWHERE],
         f"host: found '{NOWHERE}'", f"--host: found '{NOWHERE}'"),
        (lambda: ServerSocket(NOWHERE, 0, lambda: False),
         ["serve", TORQUES, "--host", NOWHERE, "--port", "0"],
         f"host, port: found {NOWHERE}:0", f"--host, --port: found {NOWHERE}:0"),
        (lambda: steered(NOBODY, load_scenario(SCENARIO), -5),
         ["simulate", SCENARIO, "--set", "camera.kind=projected", "--steered-by", "-5"],
         "steered_by: found -5", "--steered-by: found -5"),
        (lambda: simulate(SCENARIO, log_formats=["xls"]),
         ["simulate", SCENARIO, "--log-format", "xls"],
         "log_formats: found 'xls'", "--log-format: found 'xls'"),
        (lambda: calibrate("planar", "log.csv", tags="tags.csv", tag_size=0.1),
         ["calibrate", "planar", "log.csv", "--tags", "tags.csv", "--tag-size", "0.1"],
         "tag_size: found beside tags", "--tag-size: found beside tags"),
        (lambda: calibrate_campaign(SCENARIO, poses=6, poses_from="x.csv"),
         ["calibrate-campaign", SCENARIO, "--poses", "6", "--poses-from", "x.csv"],
         "poses: found beside poses_from", "--poses: found beside --poses-from"),
    ],
)  # fmt: skip
def test_python_reads_arguments_and_the_command_options(
    call, arguments, python, command, here, monkeypatch, capsys
):
    monkeypatch.setattr("cdpr_drake.analyses.frame.cluster.SCHEDULER_TIMEOUT", 0.3)
    with pytest.raises(CdprError) as refused:
        call()
    assert python in str(refused.value)
    assert "--" not in str(refused.value)
    code, _, said = run(capsys, *arguments)
    assert (code, command in said) == (2, True)
    assert python not in said.replace(command, "")


OPTIONS = {
    "lengths": "--lengths", "position": "--position", "model": "--cable-model",
    "tag_size": "--tag-size",
}  # fmt: skip


@pytest.mark.parametrize(
    ("message", "translated"),
    [
        ("lengths: found 3", "--lengths: found 3"),
        ("lengths, position: found both", "--lengths, --position: found both"),
        ("model: found model in it", "--cable-model: found --cable-model in it"),
        ("one\nlengths: found 3", "one\n--lengths: found 3"),
        ("tags: found none; accepted: tag_size, or rows",
         "tags: found none; accepted: --tag-size, or rows"),
        ("log.csv: model: found 0; a model", "log.csv: --cable-model: found 0; a model"),
        ("tags: none (tag_size)", "tags: none (--tag-size)"),
        # Words of the sentence, and parts of names and paths, stay.
        ("cable lengths: found none", "cable lengths: found none"),
        ("logs/tag_size.csv: not there", "logs/tag_size.csv: not there"),
        ("a/tag_size: not there", "a/tag_size: not there"),
        ("my tag_sizes: found 3", "my tag_sizes: found 3"),
        ("lengths.csv: not there", "lengths.csv: not there"),
    ],
)  # fmt: skip
def test_options_stand_where_arguments_are_named(message, translated):
    assert with_options(message, OPTIONS) == translated
    assert with_options(translated, OPTIONS) == translated


def test_functions_become_commands():
    assert with_options("or use camera.kind=projected", COMMAND_WORDS) == (
        "or use --camera projected"
    )


def test_commands_stand_in_the_place_of_functions():
    options = parsed(["simulate", "acrobot_pbvs"]).options
    said = with_options("plot: found 'a'; accepted: tensions", options)
    assert said == "--plot: found 'a'; accepted: tensions"

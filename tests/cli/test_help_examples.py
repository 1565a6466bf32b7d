"""Every example of every command's help is accepted by the command.

Each is called in a folder that has the files which it names. Long work is cut off where it begins,
when all that was asked is read and accepted; short work is done.
"""

import shlex
from pathlib import Path

import numpy as np
import pytest
import yaml

import cdpr_drake as cdpr
from cdpr_drake.cli.app import main
from cdpr_drake.cli.commands import COMMANDS, FIRST_STEPS
from tests.analyses.logs.recorders import hangprinter_script, motive
from tests.cli.commands import ended
from tests.messages import printed
from tests.newcomer import OWN_ROBOT

EXAMPLES = sorted({line for command in COMMANDS.values() for line in command.examples})
EXAMPLES += sorted({*FIRST_STEPS} - set(EXAMPLES))

LONG_WORK = {
    "simulate": [
        "cdpr_drake.analyses.runs.run.Run.simulate",
        "cdpr_drake.analyses.runs.seeds.finished_jobs",
    ],
    "finish": ["cdpr_drake.analyses.runs.simulate.read_marker"],
    "serve": ["cdpr_drake.sections.remote.serve.Driver.wait"],
    "reactions": ["cdpr_drake.analyses.runs.run.Run.simulate"],
    "view": ["cdpr_drake.analyses.view.open_meshcat"],
    "studio": ["cdpr_drake.studio.server.serve"],
    "workspace": ["cdpr_drake.analyses.workspaces.workspace.finished_jobs"],
    "stability": ["cdpr_drake.analyses.workspaces.stability.finished_jobs"],
    "plan": [
        "cdpr_drake.analyses.planning.path_plan.plan_along_path",
        "cdpr_drake.analyses.planning.free_plan.solve_free_motion",
        "cdpr_drake.proofs.proven_plan.ProvenSets.find",
    ],
    "reconfigure": ["cdpr_drake.analyses.design.reconfiguration.results_folder"],
    "design": ["cdpr_drake.analyses.design.optimization.search_design"],
    "calibrate": ["cdpr_drake.analyses.fits.calibration.fit_robot"],
    "calibrate-campaign": ["cdpr_drake.analyses.fits.campaign.kept_fit"],
    "calibrate-camera": ["cdpr_drake.analyses.fits.camera.find_boards"],
    "identify-swings": ["cdpr_drake.analyses.fits.swings.swing_log"],
    "identify": ["cdpr_drake.analyses.fits.identification.fit_dynamics"],
    "identify-campaign": ["cdpr_drake.analyses.fits.identify_campaign.simulate_campaign"],
    "scenarios": ["cdpr_drake.systems.diagrams.load.load_scenario"],
    "study": ["cdpr_drake.analyses.studies.study.finished_jobs"],
    "reproduce": ["cdpr_drake.analyses.studies.study.finished_jobs"],
    "doctor": [
        "cdpr_drake.analyses.installation.check_rendering",
        "cdpr_drake.analyses.installation.finished_jobs",
    ],
}
"""Where the long work of a command begins: all its arguments are read and accepted there."""


class Accepted(BaseException):
    """Long work begins; no error, so that nothing takes it for one."""


def begin(*_, **__):
    raise Accepted


def lengths_log(robot):
    """A log of cable lengths on a small circle round the home pose."""
    home = robot.home.transform().translation()
    times, rows = np.linspace(0.0, 2.0, 21), []
    free = robot.motion_type().basis(np.eye(3))[3:].any(axis=1)
    for t in times:
        shift = 0.05 * free * [np.sin(3.0 * t), np.cos(3.0 * t), np.sin(2.0 * t)]
        pose = np.concatenate([home + shift, robot.home.angles_deg])
        lengths = cdpr.solve_inverse_kinematics(robot, pose).lengths
        rows.append([t, *lengths, *pose[:3]])
    names = [f"{cable.name}_length_m" for cable in robot.cables]
    lines = [",".join(["time_s", *names, "x_m", "y_m", "z_m"])]
    return "\n".join(lines + [",".join(f"{x:.9g}" for x in row) for row in rows]) + "\n"


def named_robot(words, folder):
    """The robot of a command that takes a log: its option --robot, or its first argument."""
    name = words[words.index("--robot") + 1] if "--robot" in words else words[2]
    return cdpr.load_robot(folder / name if name.endswith(".yaml") else name)


def prepare(words, folder):
    """Writes the files that a command names."""
    for name in {"mine.yaml", "robot.yaml"} & {*words}:
        (folder / name).write_text(OWN_ROBOT.read_text())
    for word in words[2:]:
        path = folder / word
        if word.endswith(".csv") and words[1] in (
            "calibrate",
            "identify",
            "identify-swings",
            "replay",
        ):
            path.write_text(lengths_log(named_robot(words, folder)))
    files = {
        "series.txt": hangprinter_script,
        "take.csv": lambda: motive(count=40, units="Meters"),
        "poses.csv": lambda: "0,0,1\n0.2,0,1.2\n",
        "robot.urdf": lambda: next(iter(cdpr.export_robot("acrobot_small", "urdf").values())),
        "rails.yaml": lambda: rails(cdpr.load_robot(words[2])),
    }
    for name, text in files.items():
        if name in words:
            (folder / name).write_text(text())
    if "scenario.yaml" in words:
        ended("new", "scenario", "scenario", "--robot", "robot.yaml")
    if "IPAnema_1_bodies.xml" in words:
        for name, text in cdpr.export_robot("ipanema_1", "caspr").items():
            (folder / name.replace("ipanema_1", "IPAnema_1")).write_text(text)
    if any(word.startswith("images/") for word in words):
        (folder / "images").mkdir()
        (folder / "images" / "1.png").touch()


def rails(robot):
    """A rail for the first cable."""
    cable = robot.cables[0]
    rail = {
        "cables": [cable.name], "axis": [0.0, 0.0, 1.0], "lower": -0.1, "upper": 0.1,
    }  # fmt: skip
    return yaml.safe_dump({"rails": [rail]})


@pytest.mark.parametrize("line", EXAMPLES)
def test_an_example_is_accepted(line, capsys, here, monkeypatch):
    program, command, *arguments = words = shlex.split(line)
    assert program == "cdpr"
    prepare(words, here)
    arguments = [
        str(path)
        for word in arguments
        for path in (sorted(Path().glob(word)) if "*" in word else [word])
    ]
    for target in LONG_WORK.get(command, ()):
        monkeypatch.setattr(target, begin)
    with pytest.raises((SystemExit, Accepted)) as end:
        main([command, *arguments])
    found = getattr(end.value, "code", "accepted")
    assert found == ("accepted" if command in LONG_WORK else 0), printed(capsys).err

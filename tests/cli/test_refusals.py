"""What commands refuse: in one line that names what was found, and nothing is written."""

import shlex
from pathlib import Path

import numpy as np
import pytest
import yaml

from cdpr_drake.cli import app
from cdpr_drake.errors import CdprError, accepted_names
from cdpr_drake.models.robot_loader import robot_text
from cdpr_drake.systems.scenarios.files import scenario_file
from tests.analyses.fits.logs import MOTION_NOISE, write_motion
from tests.cli.commands import refuse, run
from tests.identification import logs as motions

SERIES = Path(__file__).parents[1] / "analyses/fits/hangprinter4/samples.csv"

FILES = {
    "file": "", "full/old": "", "mine/thesis.tex": "x", "mine.yaml": "years of work",
    "list.json": "[1]", "number.json": "3",
    "bad.yaml": "name: x\nrobot: [1,\n",
    "zero.yaml": "box: [0, 0, 0, 0, 0, 0]\n", "inf.yaml": "box: [0, 0, 0, .inf, 0, 0]\n",
    "none.yaml": "vertices: []\n", "verts.yaml": "verts: []\n",
    "spheres.yaml": "spheres: [{position: [0, 0, 0], radius: 0}]\n",
    "log.csv": "time_s,C1_length_m\n0,1\n0.1,1.1\n0.2,1.2\n", "empty.csv": "",
    "pulled.csv": "time_s,C1_tension_n\n0,1\n1,2\n",
    "posed.csv": "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n",
    "timeless.csv": "C1_tension_n\n1\n",
    "long.csv": "time_s,C1_length_m,x_m\n0,1," + "9" * 200_000 + "\n",
    "series.csv": SERIES.read_text(),
}  # fmt: skip
"""What lies in the folder, besides hung.yaml and empty folders."""

FOLDERS = ("empty", "acrobot_pbvs", "old")

QUICK = "--camera projected --duration 0.3"

REFUSED = {
    "": [
        ("fly", "command: found 'fly'; accepted: simulate, finish"),
        ("view planar --html no/such/page.html", "no folder"),
        *((f"view acrobot_small --html {name}",
           f"--html: found {name}; accepted: a file that ends in .html")
          for name in ("mine.yaml", "new.txt", "new")),
        ("view planar --host 'no such host'", "--host"),
        ("view planar --html a --port 7000", "without --html"),
        ("examples --out new", "without an example; accepted: with a name, or all"),
        ("calibrate planar long.csv", "long.csv"),
        ("plan acrobot_large --path long.csv", "long.csv"),
        ("import long.csv", "long.csv"),
    ],
    "simulate": [
        ("nobody", "cdpr: scenario 'nobody' is unknown"),
        ("acrobot_large", "cdpr: scenario 'acrobot_large' is unknown; it is a robot, which cdpr"),
        ("nothing.yaml", "nothing.yaml", "no such scenario file"),
        ("hung.yaml", "found a robot; use a command that takes one, such as cdpr tension"),
        ("bad.yaml", "bad.yaml:3: does not parse as YAML"),
        ("./acrobot_pbvs", "without scenario.yaml"),
        ("--set robot=foo", "robot 'foo' is unknown", "acrobot_small"),
        ("--set foo.bar=1", "--set foo.bar", "no key foo"),
        ("--set controller.lambda_0", "accepted: key=value"),
        ("--set controller.lambda_0=-1", "found -1", "> 0"),
        ("--set controller.lambda_infinity=9", "lambda_infinity", "at most lambda_0"),
        ("--set initial_pose.position=[0,0,9]", "(0, 0, 9)", "outside the frame"),
        ("--set perturbations.believed_robot=planar", "believed_robot: found 4 cables"),
        ("--set camera.mount=nose", "camera.mount", "onboard"),
        ("acrobot_pbvs --camera projected --set 'target.pose.position=[-0.5, 0.5, 0]' --out run",
         "its middle would be at (2937, 3134) px"),
        ("--duration -1", "duration", "> 0"),
        ("--seed 1.5", "--seed"),
        ("--out file", "found a file"),
        ("--out full", "holds files that cdpr did not write", "name another folder"),
        ("--out file/below", "cannot be written"),
        (f"{QUICK} --port 7000", "--port: found alone; accepted: with --meshcat"),
        ("acrobot_computed_torque --camera projected", "--camera: found with acrobot_computed"),
        ("acrobot_computed_torque --set perturbations.believed_robot=acrobot_large --set "
         "predictive.steps=5", "believed_robot: found beside predictive"),
        ("--seeds 0:2 --seed 3", "--seed: found with --seeds; accepted: without"),
        ("--seeds 0:2 --video", "--video: found with --seeds; accepted: without"),
        ("--workers 2", "--workers: found without --seeds; accepted: with"),
        ("acrobot_computed_torque --seeds 0:2", "--seeds: found with a tension_control"),
        ("--seeds 0:2 --set initial_pose.position=[0,0,1.1]", "cannot hold"),
        (f"{QUICK} --seeds 1 --workers 1 --out . --set integration.engine=plant",
         "found the working folder, one above it"),
    ],
    "finish": [
        ("empty", "found no log of an interrupted run"),
        ("no/such/folder", "found no log of an interrupted run"),
    ],
    "serve": [
        ("acrobot_computed_torque --place servo", "distributor, controller, trajectory"),
        ("acrobot_pbvs --place controller", "servo, twist"),
        ("acrobot_computed_torque --timeout 0", "remote.timeout"),
        ("acrobot_computed_torque --host no.such.invalid", "--host, --port"),
        ("acrobot_open_loop", "open_loop: found a section with remote"),
        ("acrobot_torque_servo --place servo", "winches.mode torque; accepted: twist"),
    ],
    "new": [
        ("robot mine --robot caroca", "accepted: with scenario, alone"),
        ("controller mine --robot caroca", "accepted: with scenario, alone"),
        ("scenario mine --robot caroca --from acrobot_pbvs", "accepted: with scenario, alone"),
        ("scenario mine --robot acrobot_smal", "did you mean acrobot_small"),
        ("controler x",
         "KIND: found 'controler'; did you mean controller? accepted: robot, scenario"),
        ("controller My-Law", "name: found 'My-Law'; accepted: the name of a Python module"),
        ("controller numpy", "name: found 'numpy', an installed module"),
        ("estimator class", "name: found 'class'; accepted: the name of a Python module"),
        ("estimator x --from planar", "--from: found planar with estimator"),
        ("controller law --out file --overwrite", "cdpr: file: found a file; accepted: a folder"),
    ],
    "robots": [
        ("--motion 9R", "--motion: found '9R'; accepted: ", "3R3T"),
        ("--cables -", "--cables: found '-'; accepted: such as 8"),
        ("--cables 99", "found no robot with all of these"),
        ("--gallery page.txt", "--gallery: found page.txt; accepted: ", ".html"),
        ("--gallery no/such/page.html", "found no folder"),
        ("--mechanisms --cables 8", "--mechanisms: found with other choices"),
    ],
    "tension": [
        ("cable_arm --mass 3 --pose 0,0,1", "--pose, --mass: found with a mechanism"),
        ("planar --joint a=1 --pose 0,0,0", "--joint: found with a robot"),
        ("acrobot_large --pose 0,0,9", "outside the frame"),
        ("acrobot_large --wrench 1,2", "--wrench: found '1,2'"),
        ("acrobot_large --wrench 0,0,0,1,0,0 --force 1,0,0", "--wrench, --force: found both"),
        ("acrobot_large --limits 5,2", "lower <= upper"),
        ("acrobot_large --mass=-1", "--mass: found -1"),
        ("acrobot_large --plot no/such/x.png", "cannot be written"),
        ("planar --plot polygon=x.png", "found 'polygon'; accepted: tensions, wrenches"),
        ("nowhere.yaml", "nowhere.yaml"),
        ("mine", "did you mean mine.yaml?"),
    ],
    "static": [
        ("cable_arm --pose 0,0,0", "--pose: found with a mechanism"),
        ("cable_arm --lengths 1,1,1,1 --prestress 5", "--prestress: found with --lengths"),
        ("cable_arm --joint=[] --joint=elbow=1", "--joint: found '[]'; accepted: name=value"),
        ("cable_arm --joint==1", "--joint: found '=1'; accepted: name=value"),
        ("planar --held none --yields pose", "--yields, --held: found with a robot with one"),
        ("acrobot_large --lengths 1,1,1,1,1,1,1,-1", "--lengths: found -1; accepted: > 0"),
        ("acrobot_large --pose 0.5,0,0.5", "no tensions within 0..60 N"),
        ("acrobot_large --lengths .2,.2,.2,.2,.2,.2,.2,.2", "is stretched by 5"),
        ("planar --lengths .6,.6,.6,.6", "no pose in the frame has them"),
        ("planar --lengths .713,.713,.713,.713 --cable-model inextensible", "mm longer"),
        ("cable_arm --joint knee=1", "found knee; accepted: one of cable_arm::elbow"),
        ("cable_arm --prestress 1,2", "--prestress: found [1. 2.]"),
        ("cable_arm --held knee", "joint: found knee"),
    ],
    "equilibria hung.yaml": [
        ("--lengths 0.5,0.5", "no pose has them: cables 1 and 2 together are"),
        ("--lengths 3.8,-1", "--lengths: found -1"),
        ("", "found neither"),
        ("--lengths 3,3 --position 0,0,1", "found both"),
        ("--lengths 3,3 --taut C1", "--taut: found without --position"),
        ("--position 0,0,1 --taut C1,C9", "--taut: found 'C9'"),
        ("--position 0,0,1", "accepted: 3 different ones"),
        ("--lengths 3,3 --seed -1", "--seed: found -1"),
        ("--position 0,0,1 --cable-model elastic", "--position: found with elastic cables"),
    ],
    "equilibria planar": [("--lengths 1,1,1,1", "no weight along the motions")],
    "workspace planar --grid 9,9,1 --workers 1": [
        ("--kind dynamic", "dynamic", "--acceleration"),
        ("--kind target-visible", "target-visible", "--scenario"),
        ("--force 1 --wrench-set no.yaml", "--wrench-set", "--force"),
        ("--wrench-set no.yaml", "no.yaml", "no such file"),
        ("--kind wrench-feasible --wrench-set zero.yaml", "zero.yaml", "no wrench but zero"),
        ("--kind wrench-feasible --wrench-set inf.yaml", "inf.yaml", "box"),
        ("--kind wrench-feasible --wrench-set none.yaml", "none.yaml", "vertices"),
        ("--kind wrench-feasible --wrench-set verts.yaml", "verts.yaml", "verts"),
        ("--obstacles no.yaml", "no.yaml", "no such file"),
        ("--kind static,collision-free --certify --obstacles spheres.yaml", "spheres[0].radius"),
        ("--acceleration -1", "--acceleration"),
        ("--measure payload", "payload", "planar"),
        ("--mesh a.stl", "--mesh", "--hull"),
        ("--certify --method closed_form", "--certify", "--method closed_form"),
        ("--box 0:1,0:1", "--box", "lower:upper"),
        ("--box 0:1,0:1,0:inf", "--box", "inf"),
        ("--box -1e308:1e308,0:1,0:1", "--box", "1e+06"),
        ("--unbounded", "--unbounded", "--hull"),
        ("--unbounded --hull 0,0,0.3 --box 0:1,0:1,0:1", "--unbounded", "--box"),
        ("--method barycenter", "barycenter", "redundancy"),
        ("--method dykstra --kind wrench-closure", "--method dykstra", "static"),
        ("--refine 0,0,0", "--refine", "--certify"),
        ("--certify --refine 0,0", "--refine", "x,y,z"),
        ("--certify --refine 0,0,0 --refine-boxes 0", "--refine-boxes", "0"),
        ("--certify --refine 0,0,0 --refine-reach -1", "--refine-reach", "-1"),
        ("--boxes-mesh a.vtu", "--boxes-mesh", "--certify"),
        ("--certify --boxes-mesh a.stl", "a.stl", "vtu"),
        ("--orientation 0,0,0:10:0", "psi", "step"),
        ("--orientation 0,0", "--orientation"),
        ("--orientation 0,0,0:360:0.001", "--orientation", "10000"),
    ],
    "workspace planar": [
        ("--box 5:6,0:1,0:1 --grid 3,3,1", "grid", "frame of planar"),
    ],
    "workspace acrobot_large": [("--grid 3,3,3 --hull 0,0,1.19", "such as (")],
    "stability": [
        ("planar --scheme ibvs", "ibvs", "planar", "pbvs, pbvs-line"),
        ("nobody", "robot 'nobody' is unknown"),
        ("planar --grid 5,5", "--grid", "'5,5'", "lower:upper:step"),
        ("planar --grid 5,5,0:1:0.1", "z from 0 to 1"),
        ("planar --grid 5,5,4", "--grid", "found 4 points along z", "z = 0.3"),
        ("acrobot_small --grid 1e12,1e12,1e12", "--grid: found 1e+36 poses", "1e+07"),
        ("acrobot_small --grid 0:1:1e-9,3,3", "--grid: found 9e+09 poses"),
        ("acrobot_small --grid 0:1:1e-320,3,3", "--grid: found inf poses"),
        ("acrobot_small --grid 5:6:0.5,3,3",
         "grid", "x from 5 to 6", "(-0.6, -0.6, 0) to (0.6, 0.6, 1.2)"),
        ("README.md", "'README.md'", "has to end in .yaml"),
        ("planar --searches -1", "searches", "found -1", "at least 1"),
        ("planar --pieces 0", "pieces", "found 0", "at least 1"),
    ],
    "study": [
        *((f"fusion --quick --out r {option} {value}", option, value) for option, value in (
            ("--seeds", "5:5"), ("--seeds", "1000000000000"), ("--workers", "0"))),
    ],
    "reproduce": [
        ("--only , --out r", "accepted"),
        *((f"--out r --against {name}", f"--against: {name}: found no facts.json")
          for name in ("old", "mine.yaml", "list.json", "number.json")),
    ],
    "import-log": [
        ("log.csv --out log.csv --overwrite", "found log.csv, the log itself"),
        ("log.csv --out x.csv --plot x.bmp", "x.bmp: found the ending '.bmp'"),
        ("log.csv --out x.csv --plot x", "x: found the ending ''; accepted: png"),
        ("log.csv --out x.csv --plot no/x.png", "there is no folder no"),
        ("log.csv --out x.csv --rate -5", "--rate: found -5.0; accepted: above 0"),
        ("log.csv --out x.csv --unit mm", "accepted: DIMENSION=UNIT, as length=mm"),
        ("log.csv --out x.csv --every 0", "--every: found '0'; accepted: a whole number, at least"),
        ("empty.csv --out x.csv", "empty.csv: found an empty file; accepted: a log"),
        ("empty --out x.csv", "empty: found a folder; accepted: a log"),
        ("none.csv --out x.csv", "none.csv: found no such file; accepted: a log"),
        ("long.csv --log-format csv", "long.csv"),
    ],
    "calibrate hangprinter_4 series.csv": [
        ("--bound tracker", "--bound"),
        ("--unknown exits", "--unknown: found 'exits'; accepted: exit_points"),
        ("--sigma length=1", "--sigma: found 'length=1'; accepted: name=number", "lengths_share"),
        ("--prior exit_points=-1", "--prior: found 'exit_points=-1'"),
        ("--campaign acrobot_sensors", "--campaign"),
        ("--next 0", "--next: found '0'"),
        ("--export caspr", "--export: found 'caspr'; accepted: klipper"),
        *((f"--zero home --hold-out {rows}", "--hold-out: found")
          for rows in ("0", "9", "50-60", "50-99999999999", "nine", "1-9")),
    ],
    "calibrate acrobot_small": [
        ("none.csv", "none.csv: found no such file"),
        ("posed.csv --export klipper", "motion: found 3R3T, 8 cables; accepted for klipper: 3T"),
    ],
    "calibrate-camera mine.yaml --board charuco": [
        ("--squares 9x7 --size 0.03", "mine.yaml: found no image"),
        ("--squares 9 --size 0.03", "--squares: found '9'"),
        ("--squares 9x7 --size -1", "--size: found -1"),
        ("--squares 9x7 --size 0.03 --rate 0", "--rate: found 0"),
    ],
    "identify planar posed.csv": [("", "motion: found 2T1R")],
    "identify acrobot_large": [
        ("posed.csv", "tensions: found none"),
        ("pulled.csv", "poses: found none"),
        ("timeless.csv", "time: found none"),
    ],
    "identify acrobot_large --no-pulleys": [
        ("still.csv", "cannot be told"),
        ("four.csv", "tensions: found none of C5, C6, C7, C8"),
        ("late.csv", "tracker: found it 0.12"),
        ("motion.csv --unknown weight", "--unknown: found 'weight'"),
        ("motion.csv --bandwidth 0", "--bandwidth: found 0 Hz"),
        ("motion.csv --unknown stiffness", "cable lengths: found none"),
        ("motion.csv --unknown friction", "motor torques: found none"),
        ("motion.csv --prior weight=1", "--prior: found 'weight'"),
    ],
}  # fmt: skip
"""By the words that a command begins with: the words that follow, and what is said of them."""

ROWS = [(f"{command} {more}", said) for command, rows in REFUSED.items() for more, *said in rows]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """With files that commands could read and write over, and a robot on two cables."""
    root = tmp_path_factory.mktemp("refused")
    for name, text in FILES.items():
        (root / name).parent.mkdir(exist_ok=True)
        (root / name).write_text(text)
    for name in FOLDERS:
        (root / name).mkdir()
    motion = time, poses, tensions = motions.log(span=4.0, **MOTION_NOISE)
    late = poses[np.maximum(np.arange(len(time)) - 30, 0)]
    logs = {
        "motion": motion, "four": (time, poses, tensions[:, :4]), "late": (time, late, tensions),
        "still": motions.log(span=4.0, turn=0.0, move=0.0, **MOTION_NOISE),
    }  # fmt: skip
    for name, log in logs.items():
        write_motion(root / f"{name}.csv", *log)
    hung = yaml.safe_load(robot_text("caroca"))
    hung["name"], hung["cables"] = "hung", [hung["cables"][0], hung["cables"][4]]
    del hung["slack_readings"]
    (root / "hung.yaml").write_text(yaml.safe_dump(hung))
    return root


def held(root):
    """Contents of all files, by name; of folders nothing."""
    return {path: path.read_bytes() if path.is_file() else b"" for path in root.rglob("*")}


@pytest.mark.parametrize(("line", "words"), ROWS, ids=[line[:70] for line, _ in ROWS])
def test_it_is_said_in_one_line_and_nothing_is_written(line, words, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    monkeypatch.setattr("cdpr_drake.analyses.frame.cluster.SCHEDULER_TIMEOUT", 0.3)
    before = held(folder)
    said = refuse(capsys, *shlex.split(line))
    for word in words:
        assert word in said
    assert held(folder) == before


@pytest.mark.parametrize(
    "words",
    [
        ["tension", "x" * 3000, "--pose", "0,0,0"],
        ["tension", "acrobot_small", "--pose", "0,0,0.2", "--mass", "x" * 3000],
        ["simulate", "y" * 3000 + ".yaml"],
        ["simulate", "--set", "robot=" + "z" * 3000],
        ["static", "acrobot_small", "--pose", "1," * 3000],
    ],
)
def test_of_long_words_the_middle_is_left_out(words, here, capsys):
    assert " ... " in refuse(capsys, *words)


@pytest.mark.parametrize("name", ["../../X", "/X", ".hidden", "a b", "x" * 65])
def test_names_that_could_be_paths_are_refused(name, here, capsys):
    text = scenario_file("acrobot_pbvs").read_text().replace("acrobot_pbvs", name)
    (here / "mine.yaml").write_text(text)
    code, _, err = run(capsys, "simulate", "mine.yaml", "--camera", "projected")
    assert (code, "name: found" in err) == (2, True)
    assert [path.name for path in here.iterdir()] == ["mine.yaml"]


def test_all_problems_of_a_file_have_a_line_each(here, capsys):
    (here / "mine.yaml").write_text("name: x\nrobot: y\ndurration: 3\ntitle: [1]\n")
    code, _, err = run(capsys, "simulate", "mine.yaml")
    lines = err.splitlines()
    assert (code, len(lines) > 4) == (2, True)
    assert all(line.startswith("cdpr: ") and "mine.yaml:" in line for line in lines)
    assert "did you mean duration?" in err
    assert "robot 'y' is unknown" in err


def test_a_renderer_or_a_format_that_is_not_installed_is_said_first(here, monkeypatch, capsys):
    def no_library(name):
        raise OSError(name)

    monkeypatch.setattr("cdpr_drake.models.rendered_camera.CDLL", no_library)
    said = refuse(capsys, "simulate", "--duration", "0.2")
    assert "libegl1" in said
    assert "--camera projected" in said
    monkeypatch.setattr("cdpr_drake.analyses.reporting.exported_logs.find_spec", lambda name: None)
    said = refuse(capsys, "simulate", *QUICK.split(), "--log-format", "mat,parquet")
    assert "pip install '.[parquet]'" in said
    assert not any(here.iterdir())


MISSPELT = {
    "tension carcoa": "caroca",
    "workspace caroca --kind statc": "static",
    "design acrobot_large --goal surives": "survives",
    "examples lerning": "learning",
    "study stability-range": "stability-ranges",
    "simulate acrobot_pvbs": "acrobot_pbvs",
    "simulate --set camera.kind=projcted": "projected",
    "check caroac": "caroca",
    "tensoin": "tension",
}


@pytest.mark.parametrize(("words", "meant"), MISSPELT.items())
def test_the_name_that_was_meant_is_told(words, meant, here, capsys):
    code, out, err = run(capsys, *words.split())
    told = (out + err).lower().replace("'", "")
    assert code == 2
    assert f"did you mean {meant}?" in told or f"did you mean {meant}, " in told
    assert not any(here.iterdir())


def test_names_that_are_not_close_are_only_listed():
    assert accepted_names("xyz", ("pbvs", "ibvs")) == "accepted: pbvs, ibvs"
    assert accepted_names("pvbs", ("pbvs", "ibvs")) == "did you mean pbvs? accepted: pbvs, ibvs"


def raising(problem):
    """Stands for `call.run`."""

    def run(*arguments):
        raise problem

    return run


@pytest.mark.parametrize(
    "problem",
    [
        MemoryError(),
        OverflowError("int too large to convert to float"),
        ZeroDivisionError("division by zero"),
        RuntimeError("SpatialInertia: physically invalid:\n mass = nan\n and more"),
        RecursionError("maximum recursion depth exceeded"),
        CdprError("long " * 4000),
        OSError(28, "No space left on device", "log.npz"),
    ],
    ids=lambda problem: type(problem).__name__,
)
def test_what_drake_or_python_raise_is_one_line(problem, monkeypatch, capsys):
    monkeypatch.delenv(app.TRACEBACK, raising=False)
    monkeypatch.setattr("cdpr_drake.cli.call.run", raising(problem))
    said = refuse(capsys, "robots")
    assert "log.npz: No space left on device" in said or not isinstance(problem, OSError)


@pytest.mark.parametrize("mistake", [KeyError("name"), AssertionError(), RuntimeError("Drake")])
def test_mistakes_of_this_program_can_be_found(mistake, monkeypatch):
    monkeypatch.delenv(app.TRACEBACK, raising=False)
    if isinstance(mistake, RuntimeError):  # for which a variable lets it through
        monkeypatch.setenv(app.TRACEBACK, "1")
    monkeypatch.setattr("cdpr_drake.cli.call.run", raising(mistake))
    with pytest.raises(type(mistake)):
        app.main(["robots"])

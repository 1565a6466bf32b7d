"""The subcommands of `cdpr`: a row each, in the order of the help."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Command(NamedTuple):
    """A subcommand.

    Attributes:
        group: Heading of the help under which it stands.
        verb: Module and function that answers it.
        line: First line of the function's docstring, so that the help imports no verb.
        examples: Lines to try or to change.
        forms: By option the verb that the command calls with it, and first line of its docstring.
    """

    group: str
    verb: str
    line: str
    examples: tuple[str, ...]
    forms: Mapping[str, tuple[str, str]] = MappingProxyType({})


FIRST_STEPS = {
    "cdpr robots": "robots that come with the package",
    "cdpr simulate": "a visual servo, from rendered images to winches; opens as replay.html",
    "cdpr tension acrobot_large": "tensions that hold a robot at its home",
    "cdpr workspace acrobot_large": "where it can work",
    "cdpr new robot mine": "a commented file of a robot of your own",
}
"""What `cdpr` alone shows."""

_VERBS, _CLI = "cdpr_drake.analyses", "cdpr_drake.cli"
_RUN, _FILES, _ANALYSE, _PLAN, _MACHINES, _STUDIES, _TOOLS = (
    "Run", "Robots and scenarios", "Analyse", "Plan and design", "Real machines", "Reproduce",
    "Tools",
)  # fmt: skip

COMMANDS = {
    "simulate": Command(
        _RUN, f"{_VERBS}.runs.simulate:simulate",
        "Simulates a scenario and writes summary, log, figures and replay.",
        ("cdpr simulate", "cdpr simulate caroca_ibvs --camera projected --seeds 0:20"),
        {"seeds": (
            f"{_VERBS}.runs.seeds:repeat_run",
            "Repeats a visual servo over seeds, and writes statistics, a table and a figure.",
        )},
    ),
    "finish": Command(
        _RUN, f"{_VERBS}.runs.simulate:finish_run",
        "Writes log, summary and figures of a run that was interrupted, without going on.",
        ("cdpr finish runs/acrobot_pbvs", "cdpr finish runs/acrobot_pbvs --video"),
    ),
    "serve": Command(
        _RUN, "cdpr_drake.sections.remote.serve:serve",
        "Runs a scenario with an external process in its loop, over ZeroMQ.",
        ("cdpr serve acrobot_pbvs", "cdpr serve acrobot_pbvs --port 5599 --duration 5"),
    ),
    "reactions": Command(
        _RUN, "cdpr_drake.sections.emergency.reactions:compare_reactions",
        "Breaks a cable of a visual servo by motor torques, once for each reaction.",
        ("cdpr reactions", "cdpr reactions --cable 3 --reactions stop,brake --camera projected"),
    ),
    "environments": Command(
        _RUN, f"{_VERBS}.environments:list_environments",
        "Lists the Gymnasium environments, with the sizes of action and observation for a robot.",
        ("cdpr environments",
         "cdpr environments Reach --robot acrobot_small --picture reach.png"),
    ),
    "robots": Command(
        _FILES, f"{_VERBS}.catalogues:list_robots",
        "Lists the robots that come with the package; options filter them.",
        ("cdpr robots", "cdpr robots --json"),
    ),
    "scenarios": Command(
        _FILES, f"{_VERBS}.catalogues:list_scenarios",
        "Lists the scenarios that come with the package.",
        ("cdpr scenarios", "cdpr scenarios --json"),
    ),
    "new": Command(
        _FILES, f"{_VERBS}.templates:write_template",
        "Writes a robot, scenario, controller, estimator or study to start from.",
        ("cdpr new scenario mine --robot caroca", "cdpr new controller mine"),
    ),
    "check": Command(
        _FILES, f"{_VERBS}.checks:check_files",
        "Checks files of robots, mechanisms, scenarios; lists every problem; then exit code 2.",
        ("cdpr check mine.yaml", "cdpr check robot.yaml scenario.yaml"),
    ),
    "view": Command(
        _FILES, f"{_VERBS}.view:view",
        "Shows a robot or a mechanism at its home, held by its cables, in Meshcat.",
        ("cdpr view acrobot_large", "cdpr view two_platforms"),
    ),
    "studio": Command(
        _FILES, f"{_CLI}.studio:studio",
        "Opens the studio: a local page to edit a robot, see what it can do, and run it.",
        ("cdpr studio acrobot_large", "cdpr studio mine.yaml --port 7100"),
    ),
    "import": Command(
        _FILES, "cdpr_drake.formats.exchange:import_files",
        "Imports a robot from a file of another tool into a folder.",
        ("cdpr import IPAnema_1_bodies.xml", "cdpr import robot.urdf --out mine"),
    ),
    "export": Command(
        _FILES, "cdpr_drake.formats.exchange:export_files",
        "Exports a robot to the format of another tool.",
        ("cdpr export caroca --format mjcf", "cdpr export caroca --format sdf --out here"),
    ),
    "schema": Command(
        _FILES, f"{_VERBS}.templates:file_schema",
        "Prints the JSON schema of robot, mechanism or scenario files, for editors.",
        ("cdpr schema robot", "cdpr schema scenario"),
    ),
    "tension": Command(
        _ANALYSE, f"{_VERBS}.tensions:solve_tensions",
        "Finds cable tensions that hold the platform at a pose, or proves that there are none.",
        ("cdpr tension acrobot_large",
         "cdpr tension acrobot_large --pose 0.35,-0.27,0.45 --method all"),
    ),
    "static": Command(
        _ANALYSE, f"{_VERBS}.statics.static:solve_static",
        "Computes lengths, tensions, stiffness, vibrations and sag of a robot at rest.",
        ("cdpr static acrobot_large",
         "cdpr static caroca --pose 0,0,1.5 --cable-model catenary"),
    ),
    "equilibria": Command(
        _ANALYSE, f"{_VERBS}.equilibria:find_equilibria",
        "Finds all poses of rest, stable or not, with any cables slack, for lengths or a position.",
        ("cdpr equilibria grab_three --position 0.6,1.16,-1.5",
         "cdpr equilibria grab_four --position 0.6,1.16,-1.5 --taut C1,C2,C3"),
    ),
    "workspace": Command(
        _ANALYSE, f"{_VERBS}.workspaces.workspace:compute_workspace",
        "Finds where a robot can work: kinds of workspaces, their intersection, and measures.",
        ("cdpr workspace acrobot_large",
         "cdpr workspace acrobot_large --kind static,interference-free --certify"),
    ),
    "stability": Command(
        _ANALYSE, f"{_VERBS}.workspaces.stability:assess_stability",
        "Finds where a visual servo is stable (Z), the platform can be held (S), and both (SZ).",
        ("cdpr stability acrobot_large", "cdpr stability acrobot_large --scheme pbvs --json"),
        {"along": (
            f"{_VERBS}.runs.along:assess_run",
            "Judges the stability of a visual servo along a run, with slack cables left out.",
        )},
    ),
    "plan": Command(
        _PLAN, f"{_VERBS}.planning.path_plan:plan_path",
        "Plans the fastest motion along a path within limits of tensions and winches.",
        ("cdpr plan acrobot_large --waypoints '0,0,0.2;0.1,-0.1,0.3'",
         "cdpr plan acrobot_large --proven --from 0,0,0.3 --to 0.2,0,0.4",
         "cdpr plan acrobot_large --free --from 0,0,0.3 --to 0.2,0,0.4"),
        {
            "free": (
                f"{_VERBS}.planning.free_plan:plan_free_motion",
                "Plans a motion from one pose to another whose path is free, within limits.",
            ),
            "proven": (
                "cdpr_drake.proofs.proven_plan:plan_proven_motion",
                "Plans a motion from one pose to another in sets of poses that are proven.",
            ),
        },
    ),
    "reconfigure": Command(
        _PLAN, f"{_VERBS}.design.reconfiguration:reconfigure",
        "Places exit points along rails so that poses or a path are feasible or best, with a "
        "proof.",
        ("cdpr reconfigure acrobot_large --rails rails.yaml --poses 0.2,0,0.4",
         "cdpr reconfigure caroca --rails rails.yaml --path poses.csv"),
    ),
    "design": Command(
        _PLAN, f"{_VERBS}.design.optimization:optimize_design",
        "Searches for the best points, number of cables, drum and motor of a robot.",
        ("cdpr design acrobot_large --goal capacity-margin",
         "cdpr design acrobot_large --goal static --goal accuracy --quick"),
    ),
    "import-log": Command(
        _MACHINES, f"{_VERBS}.logs.import_log:import_log",
        "Reads a log as a machine or a tracker wrote it, and writes one that calibrate and "
        "identify take.",
        ("cdpr import-log series.txt --out series.csv",
         "cdpr import-log take.csv --log-format motive --out take_log.csv"),
    ),
    "calibrate": Command(
        _MACHINES, f"{_VERBS}.fits.calibration:calibrate",
        "Finds a robot's constants in a log of what was measured at poses of its platform.",
        ("cdpr calibrate hangprinter_4 series.csv",
         "cdpr calibrate hangprinter_4 series.csv --zero home --hold-out 5"),
    ),
    "calibrate-campaign": Command(
        _MACHINES, f"{_VERBS}.fits.campaign:calibrate_campaign",
        "Calibrates the wrongly believed robot of a visual servo in simulation, and servoes again.",
        ("cdpr calibrate-campaign acrobot_sensors",
         "cdpr calibrate-campaign acrobot_sensors --poses 8 --next 3"),
    ),
    "calibrate-camera": Command(
        _MACHINES, f"{_VERBS}.fits.camera:calibrate_camera",
        "Finds a camera's intrinsic parameters and its lens in images of a board.",
        ("cdpr calibrate-camera images/*.png --squares 9x6 --size 0.025",
         "cdpr calibrate-camera images/*.png --squares 9x6 --size 0.025 --model fisheye"),
    ),
    "identify": Command(
        _MACHINES, f"{_VERBS}.fits.identification:identify",
        "Finds a robot's dynamics in a log of a motion.",
        ("cdpr identify acrobot_large motion.csv",
         "cdpr identify mine.yaml motion.csv --validate other_motion.csv"),
    ),
    "identify-campaign": Command(
        _MACHINES, f"{_VERBS}.fits.identify_campaign:identify_campaign",
        "Identifies a scenario's robot with an unknown payload in simulation, and tracks again.",
        ("cdpr identify-campaign acrobot_computed_torque",
         "cdpr identify-campaign acrobot_computed_torque --unknown mass,center_of_mass,inertia"),
    ),
    "identify-swings": Command(
        _MACHINES, f"{_VERBS}.fits.swings:identify_swings",
        "Finds a robot's dynamics in a log of a platform that swings on standing winches.",
        ("cdpr identify-swings irma4u swings.csv",
         "cdpr identify-swings irma4u swings.csv --stretches 32:36 --hold-out 20:24"),
    ),
    "replay": Command(
        _MACHINES, f"{_VERBS}.logs.replay:replay_log",
        "Replays a log of a machine beside a model of it, with residuals by cable.",
        ("cdpr replay log.csv --robot hangprinter_4",
         "cdpr replay log.csv --robot mine.yaml --follow"),
    ),
    "study": Command(
        _STUDIES, f"{_CLI}.study:study",
        "Runs a study and writes results.json, tables and figures; Ctrl-C keeps what is finished.",
        ("cdpr study worked-examples", "cdpr study tension-methods --quick"),
    ),
    "reproduce": Command(
        _STUDIES, f"{_CLI}.study:reproduce",
        "Runs every study and writes one page on what sources print beside what is found.",
        ("cdpr reproduce --quick", "cdpr reproduce --only case-1,case-2"),
    ),
    "notebooks": Command(
        _TOOLS, f"{_VERBS}.programs:copy_notebooks",
        "Copies the notebooks to a folder, or lists them; never overwrites a file.",
        ("cdpr notebooks", "cdpr notebooks my_notebooks"),
    ),
    "examples": Command(
        _TOOLS, f"{_VERBS}.programs:copy_examples",
        "Lists short programs to start from, or copies one; never overwrites a file.",
        ("cdpr examples", "cdpr examples own_controller --out here"),
    ),
    "doctor": Command(
        _TOOLS, f"{_VERBS}.installation:examine_installation",
        "Checks what this machine has and names the remedy; exit code 1 if something is missing.",
        ("cdpr doctor", "cdpr doctor --compile"),
    ),
}  # fmt: skip

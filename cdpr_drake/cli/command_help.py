"""What helps to find and begin a command: groups of the help, first steps, two examples each."""

from __future__ import annotations

COMMANDS: dict[str, tuple[str, str, str]] = {
    "simulate": (
        "Run",
        "cdpr simulate",
        "cdpr simulate caroca_ibvs --camera projected --seeds 0:20",
    ),
    "serve": ("Run", "cdpr serve acrobot_pbvs", "cdpr serve acrobot_pbvs --port 5599 --duration 5"),
    "environments": (
        "Run",
        "cdpr environments",
        "cdpr environments Reach --robot acrobot_small --picture reach.png",
    ),
    "robots": ("Robots and scenarios", "cdpr robots", "cdpr robots --json"),
    "scenarios": ("Robots and scenarios", "cdpr scenarios", "cdpr scenarios --json"),
    "new": (
        "Robots and scenarios",
        "cdpr new scenario mine --robot caroca",
        "cdpr new controller mine",
    ),
    "check": (
        "Robots and scenarios",
        "cdpr check mine.yaml",
        "cdpr check robot.yaml scenario.yaml",
    ),
    "view": ("Robots and scenarios", "cdpr view acrobot_large", "cdpr view two_platforms"),
    "studio": (
        "Robots and scenarios",
        "cdpr studio acrobot_large",
        "cdpr studio mine.yaml --port 7100",
    ),
    "import": (
        "Robots and scenarios",
        "cdpr import IPAnema_1_bodies.xml",
        "cdpr import robot.urdf --out mine",
    ),
    "export": (
        "Robots and scenarios",
        "cdpr export caroca --format mjcf",
        "cdpr export caroca --format sdf --out here",
    ),
    "schema": ("Robots and scenarios", "cdpr schema robot", "cdpr schema scenario"),
    "tension": (
        "Analyse",
        "cdpr tension acrobot_large",
        "cdpr tension acrobot_large --pose 0.35,-0.27,0.45 --method all",
    ),
    "static": (
        "Analyse",
        "cdpr static acrobot_large",
        "cdpr static caroca --pose 0,0,1.5 --cable-model catenary",
    ),
    "equilibria": (
        "Analyse",
        "cdpr equilibria grab_three --position 0.6,1.16,-1.5",
        "cdpr equilibria grab_four --position 0.6,1.16,-1.5 --taut C1,C2,C3",
    ),
    "plan": (
        "Plan and design",
        "cdpr plan acrobot_large --proven --from 0,0,0.3 --to 0.2,0,0.4",
        "cdpr plan acrobot_large --free --from 0,0,0.3 --to 0.2,0,0.4",
    ),
    "reconfigure": (
        "Plan and design",
        "cdpr reconfigure acrobot_large --rails rails.yaml --poses 0.2,0,0.4",
        "cdpr reconfigure caroca --rails rails.yaml --path poses.csv",
    ),
    "design": (
        "Plan and design",
        "cdpr design acrobot_large --goal capacity-margin",
        "cdpr design acrobot_large --goal static --goal accuracy --quick",
    ),
    "import-log": (
        "Real machines",
        "cdpr import-log series.txt --out series.csv",
        "cdpr import-log take.csv --log-format motive --out take_log.csv",
    ),
    "calibrate": (
        "Real machines",
        "cdpr calibrate --campaign acrobot_sensors",
        "cdpr calibrate hangprinter_4 series.csv",
    ),
    "calibrate-camera": (
        "Real machines",
        "cdpr calibrate-camera images/*.png --squares 9x6 --size 0.025",
        "cdpr calibrate-camera images/*.png --squares 9x6 --size 0.025 --model fisheye",
    ),
    "identify": (
        "Real machines",
        "cdpr identify --campaign acrobot_computed_torque",
        "cdpr identify mine.yaml motion.csv --validate other_motion.csv",
    ),
    "replay": (
        "Real machines",
        "cdpr replay log.csv --robot hangprinter_4",
        "cdpr replay log.csv --robot mine.yaml --follow",
    ),
    "study": ("Reproduce", "cdpr study worked-examples", "cdpr study tension-methods --quick"),
    "reproduce": ("Reproduce", "cdpr reproduce --quick", "cdpr reproduce --only case-1,case-2"),
    "notebooks": ("Tools", "cdpr notebooks", "cdpr notebooks my_notebooks"),
    "examples": ("Tools", "cdpr examples", "cdpr examples own_controller --out here"),
    "doctor": ("Tools", "cdpr doctor", "cdpr doctor --compile"),
    "bench": ("Tools", "cdpr bench", "cdpr bench tension"),
}
"""Subcommands in the order of the help: group, and two lines to try or to change."""


def groups() -> dict[str, list[str]]:
    """Names of subcommands by what they are for."""
    found: dict[str, list[str]] = {}
    for name, (group, *_) in COMMANDS.items():
        found.setdefault(group, []).append(name)
    return found


FIRST_STEPS: tuple[tuple[str, str], ...] = (
    ("cdpr robots", "robots that come with the package"),
    ("cdpr simulate", "a visual servo, from rendered images to winches; opens as replay.html"),
    ("cdpr tension acrobot_large", "tensions that hold a robot at its home"),
    ("cdpr workspace acrobot_large", "where it can work"),
    ("cdpr new robot mine", "a commented file of a robot of your own"),
)
"""What `cdpr` alone shows."""


def examples_of(name: str) -> str:
    """Examples of a subcommand, for the end of its help, as Markdown."""
    lines = "\n\n".join(f"`{line}`" for line in COMMANDS[name][1:])
    return f"Examples:\n\n{lines}"


def first_steps() -> str:
    """What `cdpr` alone shows."""
    width = max(len(line) for line, _ in FIRST_STEPS)
    steps = "\n".join(f"  {line:<{width}}  {words}" for line, words in FIRST_STEPS)
    title = "Cable-driven parallel robots in Drake. To begin:"
    return f"{title}\n\n{steps}\n\ncdpr --help lists the rest."

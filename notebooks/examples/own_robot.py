"""A robot of your own: a file is changed in Python, saved, checked, and asked where it works."""

from dataclasses import replace
from pathlib import Path

import cdpr_drake as cdpr
from cdpr_drake.schema.typed_yaml import dump_typed

small = cdpr.load_robot("acrobot_small")
heavier = replace(small, name="mine", platform=replace(small.platform, mass=1.0))
path = Path("mine.yaml")
path.write_text(dump_typed(heavier))

robot = cdpr.load_robot(path)
print(robot)
print(cdpr.solve_tensions(robot))
workspace = cdpr.compute_workspace(robot, "static", (9, 9, 7))
print(workspace)
workspace.plot().savefig("mine_workspace.png")

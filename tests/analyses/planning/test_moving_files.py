"""Files of obstacles that move: shapes, other robots and their plans, and what is refused."""

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.workspaces.workspace_files import load_all_obstacles, load_obstacles
from cdpr_drake.errors import DataFileError

ROBOT = "acrobot_large"
AWAY = [0.0, -0.5, 0.2]
BOX = {"pose": {"position": AWAY}, "size": [0.1, 0.1, 0.1]}
VELOCITY = {"velocity": [0.1, 0.0, 0.0]}
WAY = [{"time": time, "pose": {"position": AWAY}} for time in (7.5, 5.0)]


def write(folder, content):
    path = folder / "obstacles.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def moved(motion):
    return {"boxes": [BOX | {"motion": motion}]}


def robot(**more):
    return {"robots": [{"robot": ROBOT, "pose": {"position": AWAY}} | more]}


@pytest.mark.parametrize(
    ("content", "refusal", "load"),
    [
        (moved({"waypoints": WAY}), r"boxes\[0\].motion.waypoints: .*growing", load_all_obstacles),
        (moved({**VELOCITY, "joint": {"point": AWAY, "axis": [0, 0, 1]}}),
         r"boxes\[0\].motion: .*one of", load_all_obstacles),
        (moved({"speed": 1.0}), r"boxes\[0\].motion.*speed", load_all_obstacles),
        (moved(VELOCITY), r"boxes\[0\]: found an obstacle that moves", load_obstacles),
        (robot(plan="nowhere"), r"robots\[0\].plan: .*no such file", load_all_obstacles),
        (robot(robot="nobody"), r"robots\[0\].robot: .*nobody", load_all_obstacles),
    ],
)  # fmt: skip
def test_what_is_not_accepted_is_named(tmp_path, content, refusal, load):
    with pytest.raises(DataFileError, match=refusal):
        load(write(tmp_path, content))


def test_all_shapes_and_other_robots_move(tmp_path):
    (tmp_path / "tip.obj").write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n")
    capsule = {"start": AWAY, "end": [0.0, -0.5, 0.6], "radius": 0.02}
    resting, moving = load_all_obstacles(write(tmp_path, {
        "boxes": [BOX],
        "spheres": [{"position": AWAY, "radius": 0.1, "motion": VELOCITY}],
        "capsules": [{**capsule, "motion": VELOCITY}],
        "meshes": [{"file": "tip.obj", "pose": {"position": AWAY}, "motion": VELOCITY}],
        **robot(beams=False),
    }))  # fmt: skip
    assert len(resting.boxes) == 1
    names = [thing.name for thing in moving]
    assert names == ["spheres[0]", "capsules[0]", "meshes[0]", f"robots[0] {ROBOT}"]
    points = moving[1].at(2.0)[0].points
    np.testing.assert_allclose(points, [[0.2, -0.5, 0.2], [0.2, -0.5, 0.6]], atol=1e-12)
    assert len(moving[3].at(0.0)) == 9

"""A robot with one platform, written as a mechanism: the same cables, tensions and rest."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.mechanisms import place_mechanism
from cdpr_drake.analyses.statics.static import solve_static
from cdpr_drake.analyses.tensions import solve_tensions
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot

pytestmark = pytest.mark.usefixtures("in_this_process")

SAME = 1e-9
"""Two ways to the same tensions of up to 30 N, by one program [N]."""

ROBOTS = ("acrobot_fully_constrained", "acrobot_large", "caroca", "spider_camera")


def as_mechanism_file(robot: Robot, folder: Path) -> Path:
    """Writes a robot in space as a URDF of its platform and a mechanism's file."""
    spatial = platform_inertia(robot)
    I = spatial.CalcRotationalInertia().CopyToFullMatrix3()  # noqa: E741, as in the literature
    p = spatial.get_com()
    I = spatial.Shift(p).CalcRotationalInertia().CopyToFullMatrix3()  # noqa: E741
    keys = {"ixx": I[0, 0], "iyy": I[1, 1], "izz": I[2, 2],
            "ixy": I[0, 1], "ixz": I[0, 2], "iyz": I[1, 2]}  # fmt: skip
    words = " ".join(f'{key}="{float(value)!r}"' for key, value in keys.items())
    origin = " ".join(repr(float(x)) for x in p)
    (folder / "platform.urdf").write_text(
        f'<robot name="robot"><link name="platform"><inertial><origin xyz="{origin}"/>'
        f'<mass value="{spatial.get_mass()!r}"/><inertia {words}/></inertial></link></robot>',
        encoding="utf-8",
    )
    cables = robot.cable_set()
    low, high = robot.tension_limits()
    lines = []
    for i, cable in enumerate(robot.cables):
        ends = {"exit_point": cables.p_WA[:, i], "anchor_point": cables.p_PB[:, i],
                "swivel_axis": cables.swivel_axis[:, i]}  # fmt: skip
        words = ", ".join(f"{key}: {value.tolist()}" for key, value in ends.items())
        lines.append(f"  - {{name: {cable.name}, {words}, anchor_frame: platform}}\n")
    home, material = robot.home, robot.cable
    path = folder / "mechanism.yaml"
    path.write_text(
        f"""name: {robot.name}
mechanism: platform.urdf
gravity: {robot.gravity}
pulley: {{radius: {robot.pulley.radius}}}
home:
  bodies:
    platform: {{position: {home.position.tolist()}, angles_deg: {home.angles_deg.tolist()}}}
cable:
  youngs_modulus: {material.youngs_modulus!r}
  diameter: {material.diameter!r}
  linear_density: {material.linear_density!r}
  retardation_time: {material.retardation_time!r}
  breaking_load: {"null" if material.breaking_load is None else material.breaking_load}
tension_bounds: {{lower: {low}, upper: {high}}}
cables:
{"".join(lines)}""",
        encoding="utf-8",
    )
    return path


@pytest.mark.parametrize("name", ROBOTS)
def test_its_cables_are_the_same(name, tmp_path):
    robot = load_robot(name)
    placed = place_mechanism(as_mechanism_file(robot, tmp_path))
    body = int(placed.plant.GetBodyByName("platform").index())
    found, wanted = placed.cables.routes.as_cable_set(body), robot.cable_set()
    assert found is not None
    for field in fields(wanted):
        np.testing.assert_allclose(
            getattr(found, field.name), getattr(wanted, field.name), rtol=1e-15, atol=1e-15,
            err_msg=field.name,
        )  # fmt: skip


@pytest.mark.parametrize("name", ["acrobot_fully_constrained", "acrobot_large", "caroca"])
def test_its_tensions_are_the_same(name, tmp_path):
    robot, path = load_robot(name), as_mechanism_file(load_robot(name), tmp_path)
    for method in ("quadratic_program", "closed_form"):
        wanted, found = (solve_tensions(form, method=method) for form in (robot, path))
        assert found.status == wanted.status == "feasible"
        np.testing.assert_allclose(found.tensions, wanted.tensions, rtol=SAME, atol=SAME)


def test_it_stays_where_pulleys_are(tmp_path):
    robot = load_robot("caroca")
    path = as_mechanism_file(robot, tmp_path)
    over, straight = solve_static(path), solve_static(path, pulleys=False)
    assert np.min(np.abs(over.lengths - straight.lengths)) > 1e-3
    assert over.rest.residual < 1e-6 * robot.platform.mass * robot.gravity
    assert over.rest.stability == "stable"


def test_gravity_may_point_elsewhere(tmp_path):
    path = as_mechanism_file(load_robot("acrobot_fully_constrained"), tmp_path)
    text = path.read_text(encoding="utf-8") + "gravity_direction: [0, 2, 0]\n"
    path.write_text(text, encoding="utf-8")
    mechanism = load_mechanism(path)
    placed = place_mechanism(mechanism)
    np.testing.assert_allclose(placed.plant.gravity_field().gravity_vector(), [0, 9.81, 0])
    np.testing.assert_array_equal(placed.cables.routes.ends.down, [0, 1, 0])
    force = placed.cables.other_forces(placed.context)
    np.testing.assert_allclose(force[3:], [0, 3.5 * 9.81, 0], atol=1e-12)

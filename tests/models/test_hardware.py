"""Cables of several materials, exit points on rails, platforms and frames that are no boxes."""

import numpy as np
import pytest
import yaml
from pydrake.geometry import Cylinder, Mesh, Role, SceneGraph, Sphere
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.analyses.workspaces.robot_conditions import interference_bodies
from cdpr_drake.cables.states import check_breaking
from cdpr_drake.errors import CableGeometryError, RobotFileError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.models.robot_in_plant import add_robot, platform_inertia
from cdpr_drake.models.robot_loader import load_robot, robot_text
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.models.scene import add_frame
from cdpr_drake.models.ups_robot import rod_masses
from cdpr_drake.statics.stiffness import platform_stiffness
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.winches.motor import MODES, winch_motion
from cdpr_drake.winches.motor_kernel import pack_winch, winch_rates
from tests.models.robots import content_of, robot_of

# Materials: stiffness, weight, damping, breaking, drums.

OWN = {
    "diameter": 0.004,
    "youngs_modulus": 2.5e9,
    "linear_density": 0.03,
    "retardation_time": 2e-3,
    "breaking_load": 90.0,
}

SAME = 1e-12
"""The kernel and the array path round alike, up to the order of two products."""


def mixed(own=OWN, cables=(2, 5)):
    content = content_of()
    for k in cables:
        content["cables"][k]["material"] = own
    return robot_of(content)


def test_a_cable_has_its_own_values_and_the_others_the_common_ones():
    robot, common = mixed(), load_robot("acrobot_small")
    cables, before = robot.cable_set(), common.cable_set()
    others = [0, 1, 3, 4, 6, 7]
    for name in ("stiffness", "retardation", "linear_weight", "breaking_load"):
        np.testing.assert_array_equal(getattr(cables, name)[others], getattr(before, name)[others])
    for k in (2, 5):
        assert cables.stiffness[k] == pytest.approx(np.pi * 1.0e4, rel=1e-15)
        assert cables.linear_weight[k] == 0.03 * robot.gravity
        assert cables.retardation[k] == 2e-3
        assert cables.breaking_load[k] == 90.0
    assert robot.knows_breaking_loads()
    assert not common.knows_breaking_loads()
    assert rod_masses(robot)[2] / rod_masses(common)[2] == pytest.approx(
        0.03 / common.cable.linear_density
    )


def test_one_key_alone_leaves_the_others_as_they_are():
    robot, common = mixed({"diameter": 0.004}), load_robot("acrobot_small").cable_set()
    ratio = (0.004 / robot.cable.diameter) ** 2
    assert robot.cable_set().stiffness[2] == pytest.approx(ratio * common.stiffness[2])
    assert robot.cable_set().linear_weight[2] == common.linear_weight[2]


def test_the_platform_stiffness_is_that_of_these_springs():
    robot = mixed({"youngs_modulus": 2.5e9})
    cables, X_WP = robot.cable_set().without_pulleys(), robot.home.transform()
    paths = cable_paths(X_WP, cables)
    strain = 1e-4
    l0 = paths.lengths / (1.0 + strain)
    found = platform_stiffness(cables, "elastic", rigid_platform(robot), X_WP, l0)
    springs = paths.J.T @ np.diag(cables.stiffness / l0) @ paths.J
    np.testing.assert_allclose(found.elastic, springs, rtol=1e-12, atol=1e-9 * np.max(springs))


def test_the_weaker_cable_breaks():
    cables = mixed().cable_set()
    l0 = np.ones(8)
    check_breaking(cables, np.full(8, 89.0), l0)
    with pytest.raises(CableGeometryError, match=r"cable 3: .*breaking load, 90 N"):
        check_breaking(cables, np.full(8, 91.0), l0)


def test_a_thicker_cable_lies_farther_out_on_its_drum():
    robot, common = mixed({"diameter": 0.01}), load_robot("acrobot_small")
    radii, before = robot.drum().radii(8), common.drum().radii(8)
    more = (0.01 - common.cable.diameter) / 2.0 / common.winch.gear_ratio
    np.testing.assert_allclose(radii - before, more * np.isin(np.arange(8), (2, 5)), atol=1e-18)
    angles = np.linspace(-3.0, 3.0, 8)
    np.testing.assert_allclose(robot.drum().paid_out(angles), radii * angles, rtol=1e-12)
    np.testing.assert_allclose(robot.drum().motor_angles(radii * angles), angles, rtol=1e-12)


@pytest.mark.parametrize("layers", [None, {"turns": 3.0, "wound": 1.5}])
def test_motors_with_several_diameters_move_as_single_ones(layers):
    content = content_of()
    content["winch"]["layers"] = layers
    alone = []
    for diameter in (None, 0.01):
        if diameter:
            content["cable"]["diameter"] = diameter
        alone.append(robot_of(content).winch_law())
    content = content_of()
    content["winch"]["layers"] = layers
    content["cables"][5]["material"] = {"diameter": 0.01}
    law = robot_of(content).winch_law()
    home = np.full(8, 2.0)
    state = np.concatenate([home + np.linspace(-0.4, 0.4, 8), np.linspace(-0.2, 0.3, 8)])
    tensions, command, free = np.linspace(5.0, 40.0, 8), np.linspace(-0.3, 0.2, 8), np.zeros(8)

    def rates(one):
        out = np.empty(16)
        winch_rates(state, tensions, command, free, home, MODES["torque"], pack_winch(one), out)
        return out

    thin, thick = map(rates, alone)
    for found in (rates(law), arrays_of(law, state, tensions, command, home)):
        np.testing.assert_allclose(np.delete(found[8:], 5), np.delete(thin[8:], 5), rtol=SAME)
        assert found[13] == pytest.approx(thick[13], rel=SAME)


def arrays_of(law, state, tensions, command, home):
    """The same by the array path."""
    parts = (state[:8], state[8:], np.zeros(8))
    motion = winch_motion(law, MODES["torque"], parts, tensions, command, np.zeros(8), home=home)
    return np.concatenate([state[8:], motion.length_acceleration])


# Rails: a coordinate is a configuration of the robot, given with its name.

RAIL = {"axis": [0.0, 0.0, 2.0], "lower": -0.2, "upper": 0.1}


def with_rails(**changes):
    content = content_of()
    content["cables"][0]["rail"] = RAIL | changes
    content["cables"][5]["rail"] = RAIL | {"axis": [1.0, 1.0, 0.0], "at": -0.1}
    return content


@pytest.fixture
def path(tmp_path):
    folder = tmp_path / "some@place"
    folder.mkdir()
    path = folder / "rails.yaml"
    path.write_text(yaml.safe_dump(with_rails(), sort_keys=False))
    return path


def names():
    return [cable["name"] for cable in content_of()["cables"]]


def test_exit_points_are_where_their_rails_say():
    robot, fixed = robot_of(with_rails()), robot_of(content_of())
    shift = robot.cable_set().p_WA - fixed.cable_set().p_WA
    expected = np.zeros((3, 8))
    expected[:2, 5] = -0.1 / np.sqrt(2.0)
    np.testing.assert_allclose(shift, expected, atol=1e-15)


def test_a_point_that_was_found_goes_back_into_the_file():
    robot = robot_of(with_rails())
    found = robot.cable_set().p_WA + 0.01
    for k, cable in enumerate(robot.cables):
        cable.exit_point = cable.base_of(found[:, k])
    np.testing.assert_allclose(robot.cable_set().p_WA, found, atol=1e-15)


def test_a_name_puts_them_elsewhere(path):
    first, sixth = names()[0], names()[5]
    robot = load_robot(f"{path}@{first}=-0.15,{sixth}=0.05")
    fixed = robot_of(content_of()).cable_set()
    shift = robot.cable_set().p_WA - fixed.p_WA
    np.testing.assert_allclose(shift[:, 0], [0.0, 0.0, -0.15], atol=1e-15)
    np.testing.assert_allclose(shift[:2, 5], 0.05 / np.sqrt(2.0), atol=1e-15)
    text = yaml.safe_load(robot_text(f"{path}@{first}=-0.15"))
    assert [text["cables"][k]["rail"]["at"] for k in (0, 5)] == [-0.15, -0.1]
    # The file itself stays.
    np.testing.assert_allclose(load_robot(str(path)).cable_set().p_WA[:, 0], fixed.p_WA[:, 0])


def test_a_scenario_and_what_is_left_of_its_run_have_the_configuration(path, tmp_path):
    words = f"robot={path}@{names()[0]}=-0.15"
    scenario = load_scenario("acrobot_pbvs", ["camera.kind=projected", words])
    robot = load_robot(scenario.robot)
    assert robot.cables[0].rail.at == -0.15
    write_run_inputs(tmp_path, scenario, robot)
    again = load_scenario(str(tmp_path / "scenario.yaml"))
    cables = load_robot(again.robot).cable_set()
    np.testing.assert_array_equal(cables.p_WA, robot.cable_set().p_WA)
    X_WP = robot.home.transform()
    moved = cable_lengths(X_WP, cables.p_WA, cables.p_PB)
    assert abs(moved[0] - cable_lengths(X_WP, *fixed_points())[0]) > 0.05


def fixed_points():
    cables = robot_of(content_of()).cable_set()
    return cables.p_WA, cables.p_PB


@pytest.mark.parametrize(
    ("suffix", "words"),
    [
        ("{0}=0.5", r"cables\[0\]\.rail\.at: found 0\.5; accepted: -0\.2 to 0\.1 \[m\]"),
        ("{1}=0.0", r"found no rail of that cable; accepted: {0}, {5}"),
        ("{0}", r"found '{0}' behind @; accepted: coordinates of exit points on rails"),
        ("{0}=x", r"found '{0}=x' behind @"),
        ("{0}=0,{0}=0.1", r"found '{0}=0\.1' behind @; accepted: .* each cable once"),
    ],
)
def test_what_no_rail_can_do_is_named(path, suffix, words):
    with pytest.raises(RobotFileError, match=words.format(*names())):
        load_robot(f"{path}@{suffix.format(*names())}")


def test_a_robot_without_rails_says_so():
    with pytest.raises(RobotFileError, match=r"accepted: none, since its file gives no cables\[\]"):
        load_robot(f"acrobot_small@{names()[0]}=0.1")


# Shapes: inertia where it is asked for, scene, clearances.

SIZE, MASS = np.array([0.2, 0.2, 0.2]), 3.0

EXACT = 1e-12


def content_with(shape=None, inertia_of=None, beams=None):
    content = content_of()
    content["platform"] = {"mass": MASS, "size": SIZE.tolist()}
    if shape is not None:
        content["platform"]["shape"] = shape
    if inertia_of is not None:
        content["platform"]["inertia_of"] = inertia_of
    if beams is not None:
        content["frame"]["beams"] = beams
    return content


def moments(robot):
    """About the centre of mass, axes of P [kg m^2]."""
    return platform_inertia(robot).Shift(robot.center_of_mass()).CalcRotationalInertia()


def crate(folder, edges=SIZE):
    """A closed box of triangles as an OBJ file, its origin in its middle."""
    x, y, z = np.asarray(edges) / 2.0
    corners = [(a * x, b * y, c * z) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]
    quads = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = [f"v {a!r} {b!r} {c!r}" for a, b, c in np.array(corners).tolist()]
    lines += [f"f {a} {b} {c}\nf {a} {c} {d}" for a, b, c, d in quads]
    (folder / "crate.obj").write_text("\n".join(lines) + "\n")


def loaded(folder, content):
    path = folder / "robot.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return load_robot(str(path))


def test_a_shape_alone_changes_no_inertia():
    box = robot_of(content_with())
    ball = robot_of(content_with({"kind": "sphere", "radius": 0.1}))
    np.testing.assert_array_equal(
        platform_inertia(ball).CopyToFullMatrix6(), platform_inertia(box).CopyToFullMatrix6()
    )


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ({"kind": "sphere", "radius": 0.1}, [0.4 * 0.01] * 3),
        (
            {"kind": "cylinder", "radius": 0.08, "height": 0.2},
            [(3 * 0.0064 + 0.04) / 12, (3 * 0.0064 + 0.04) / 12, 0.0032],
        ),
        (
            {"kind": "cylinder", "radius": 0.08, "height": 0.2, "angles_deg": [0.0, 90.0, 0.0]},
            [0.0032, (3 * 0.0064 + 0.04) / 12, (3 * 0.0064 + 0.04) / 12],
        ),
        ({"kind": "box", "size": [0.1, 0.2, 0.1]}, [0.05 / 12, 0.02 / 12, 0.05 / 12]),
    ],
)
def test_a_homogeneous_shape_has_its_inertia_where_it_is_asked_for(shape, expected):
    robot = robot_of(content_with(shape, "shape"))
    np.testing.assert_allclose(moments(robot).get_moments(), MASS * np.array(expected), rtol=EXACT)
    np.testing.assert_allclose(moments(robot).get_products(), 0.0, atol=1e-15)
    assert platform_inertia(robot).get_mass() == pytest.approx(MASS, rel=EXACT)


def test_a_shape_off_the_middle_moves_the_centre_of_mass():
    shape = {"kind": "sphere", "radius": 0.05, "position": [0.03, -0.02, 0.06]}
    robot = robot_of(content_with(shape, "shape"))
    np.testing.assert_allclose(robot.center_of_mass(), [0.03, -0.02, 0.06], atol=EXACT)
    np.testing.assert_allclose(moments(robot).get_moments(), 0.4 * MASS * 0.0025, rtol=EXACT)
    content = content_with(shape, "shape")
    content["platform"]["center_of_mass"] = [0.0, 0.0, 0.1]
    given = robot_of(content)
    np.testing.assert_allclose(platform_inertia(given).get_com(), [0.0, 0.0, 0.1], atol=EXACT)
    np.testing.assert_allclose(moments(given).get_moments(), 0.4 * MASS * 0.0025, rtol=EXACT)


def test_a_mesh_has_the_inertia_of_what_it_encloses(tmp_path):
    crate(tmp_path, [0.1, 0.2, 0.15])
    robot = loaded(tmp_path, content_with({"kind": "mesh", "file": "crate.obj"}, "shape"))
    expected = MASS / 12.0 * np.array([0.0625, 0.0325, 0.05])
    np.testing.assert_allclose(moments(robot).get_moments(), expected, rtol=1e-9)


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "mesh"])
def test_the_scene_shows_the_shape(kind, tmp_path):
    crate(tmp_path)
    robot = loaded(
        tmp_path,
        content_with(
            {"kind": kind, "radius": 0.1, "height": 0.2, "file": "crate.obj"},
            beams=[{"start": [-0.5, 0, 0], "end": [-0.5, 0, 1]}] * 3,
        ),
    )
    scene, plant = SceneGraph(), MultibodyPlant(0.0)
    plant.RegisterAsSourceForSceneGraph(scene)
    in_plant = add_robot(plant, robot)
    add_frame(plant, robot)
    plant.Finalize()
    inspector = scene.model_inspector()
    frame = plant.GetBodyFrameIdOrThrow(in_plant.body_index)
    (found,) = inspector.GetGeometries(frame, Role.kIllustration)
    shape = inspector.GetShape(found)
    assert isinstance(shape, {"sphere": Sphere, "cylinder": Cylinder, "mesh": Mesh}[kind])
    assert len(inspector.GetGeometries(inspector.world_frame_id(), Role.kIllustration)) == 3


def test_clearances_reckon_with_the_frames_own_beams():
    ends = np.array([[-0.6, -0.6, 0.0], [0.6, 0.6, 1.2]])
    beams = [{"start": ends[0].tolist(), "end": ends[1].tolist(), "width": 0.02}]
    around = interference_bodies(robot_of(content_with(beams=beams)))
    (row,) = around.fixtures
    R, middle, half = row[:9].reshape(3, 3), row[9:12], row[12:]
    np.testing.assert_allclose(middle, ends.mean(axis=0), atol=EXACT)
    np.testing.assert_allclose(half, [0.01, 0.01, np.linalg.norm(ends[1] - ends[0]) / 2])
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=EXACT)
    np.testing.assert_allclose(middle + half[2] * R[:, 2], ends[1], atol=EXACT)
    assert len(interference_bodies(robot_of(content_with())).fixtures) == 12


def test_a_mesh_that_encloses_nothing_has_no_inertia(tmp_path):
    crate(tmp_path)
    path = tmp_path / "crate.obj"
    shape = {"kind": "mesh", "file": "crate.obj"}
    path.write_text("\n".join(path.read_text().splitlines()[:-1]) + "\n")  # a triangle less
    with pytest.raises(RobotFileError, match=r"crate\.obj: found no volume that its triangles"):
        loaded(tmp_path, content_with(shape, "shape"))
    assert loaded(tmp_path, content_with(shape)).platform.inertia_of == "box"


def test_the_folder_of_a_run_has_all_of_the_robot(tmp_path):
    """Whatever a robot file can say of hardware, written as it was run and read elsewhere."""
    there, kept = tmp_path / "there", tmp_path / "kept"
    there.mkdir()
    kept.mkdir()
    crate(there)
    lines = (there / "crate.obj").read_text()
    (there / "crate.obj").write_text("mtllib crate.mtl\n" + lines)
    (there / "crate.mtl").write_text("newmtl grey\nKd 0.5 0.5 0.5\n")
    beams = [{"start": [-0.5, 0, 0], "end": [-0.5, 0, 1]}]
    content = content_with({"kind": "mesh", "file": "crate.obj"}, "shape", beams)
    content["cables"][0] |= {"material": {"diameter": 0.002}, "winch": "both"}
    content["cables"][1] |= {"material": {"diameter": 0.002}, "winch": "both"}
    content["cables"][2] |= {"anchor_pulley_radius": 0.01, "anchor_swivel_axis": [1.0, 0.0, 0.0]}
    content["platform_pulley"] = {"radius": 0.005}
    robot = loaded(there, content)
    write_run_inputs(kept, load_scenario("acrobot_pbvs"), robot)
    inertia = platform_inertia(robot).CopyToFullMatrix6()
    for file in there.iterdir():
        file.unlink()
    again = load_robot(str(kept / "robot.yaml"))
    assert (kept / "crate.mtl").is_file()
    ours, theirs = robot.cable_set(), again.cable_set()
    np.testing.assert_array_equal(theirs.packed(), ours.packed())
    assert again.winch_groups() == robot.winch_groups()
    np.testing.assert_array_equal(platform_inertia(again).CopyToFullMatrix6(), inertia)
    np.testing.assert_array_equal(again.frame.beams[0].end, robot.frame.beams[0].end)

"""CASPR's models of several links: what the format's definition says, by hand."""

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex

from cdpr_drake import models
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.caspr_mechanism import (
    joint_names,
    link_names,
)
from cdpr_drake.formats.caspr_trees import (
    AXIS_KINDS,
    KINDS,
    excess,
    matrix_of,
    possible_inertia,
    read_tree,
)
from cdpr_drake.formats.mechanism_exchange import import_mechanism
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from tests.models.formats.tree_files import BOX, Cable, Link, Model, at_start, pair, two_link

pytestmark = pytest.mark.usefixtures("in_this_process")

ROUNDING = 2e-15
"""Of lengths below 2 m and rotations: some units in the last place."""

REPAIRED = 1e-12
"""Of moments after an eigendecomposition, as a share of the largest."""


def loaded(folder, model, **options):
    """A model as a mechanism in a finalized plant, and its cables."""
    imported = import_mechanism(model.write(folder), **options)
    target = folder / "made"
    target.mkdir()
    for name, text in imported.files().items():
        (target / name).write_text(text, encoding="utf-8")
    mechanism = models.load_mechanism(target)
    plant = MultibodyPlant(0.0)
    added = add_mechanism(plant, mechanism)
    added.finalize()
    return imported, plant, models.PlantCables(plant, added.routes())


def about(axis, angle):
    """Rotation about any axis, by Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    A = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * A + (1 - np.cos(angle)) * A @ A


AXIS = (0.3, -0.4, 1.2)
UNIT = np.array(AXIS) / np.linalg.norm(AXIS)


def turned(axes, q):
    """One turn after the other about axes of the frame that was turned before."""
    R = np.eye(3)
    for axis, angle in zip(axes, q, strict=True):
        R = R @ about(np.eye(3)["XYZ".index(axis)], angle)
    return R


def along(axes, q):
    return sum(x * np.eye(3)["XYZ".index(axis)] for axis, x in zip(axes, q, strict=True))


# Of each joint, rotation and translation from CASPR's RelRotationMatrix and RelTranslationVector,
# src/Model/Bodies/Joints of github.com/darwinlau/CASPR.
DEFINED = {
    **{
        f"{'RU'[len(a) - 1]}_{a}": lambda q, a=a: (turned(a, q), np.zeros(3))
        for a in ("X", "Y", "Z", "XY", "YZ", "XZ")
    },
    **{
        f"P_{a}": lambda q, a=a: (np.eye(3), along(a, q)) for a in ("X", "Y", "Z", "XY", "YZ", "XZ")
    },
    **{
        f"PLANAR_{a}": lambda q, a=a, n=n: (turned(n, q[2:]), along(a, q[:2]))
        for a, n in (("XY", "Z"), ("YZ", "X"), ("XZ", "Y"))
    },
    "R_AXIS": lambda q: (about(AXIS, q[0]), np.zeros(3)),
    "P_AXIS": lambda q: (np.eye(3), q[0] * UNIT),
    "T_XYZ": lambda q: (np.eye(3), q[:3]),
    "S_EULER_XYZ": lambda q: (turned("XYZ", q), np.zeros(3)),
    "S_FIXED_XYZ": lambda q: (turned("ZYX", q[::-1]), np.zeros(3)),
    "SPATIAL_EULER_XYZ": lambda q: (turned("XYZ", q[3:]), q[:3]),
}


def test_all_kinds_have_a_definition_here():
    assert set(DEFINED) == {*KINDS, *AXIS_KINDS}


@pytest.mark.parametrize("kind", DEFINED)
def test_a_joint_moves_as_it_is_defined(kind, tmp_path):
    """The second of two such joints, on a link that is turned and moved itself."""
    rng = np.random.default_rng(len(kind))
    count = 1 if kind in AXIS_KINDS else len(KINDS[kind])
    q1, q2 = rng.uniform(-1.0, 1.0, (2, count))
    more = f'axis="{AXIS[0]} {AXIS[1]} {AXIS[2]}"' if kind in AXIS_KINDS else ""
    p1, p2 = np.array([0.3, -0.2, 0.5]), np.array([-0.1, 0.4, 0.2])
    words = [" ".join(repr(float(x)) for x in values) for values in (q1, q2, p1, p2)]
    model = Model(
        [
            Link(kind, words[0], name="one", location=words[2], more=more),
            Link(kind, words[1], parent=1, name="two", location=words[3], more=more),
        ],
        [Cable([(0, "3 3 3"), (2, "0.1 0.2 0.3")])],
    )
    tree = read_tree(*pair(model, tmp_path), "toy")
    plant, context = at_start(tree)
    R1, r1 = DEFINED[kind](q1)
    R2, r2 = DEFINED[kind](q2)
    poses = (("one", R1, p1 + r1), ("two", R1 @ R2, p1 + r1 + R1 @ (p2 + r2)))
    for name, R, p in poses:
        X_WB = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(name))
        np.testing.assert_allclose(X_WB.rotation().matrix(), R, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(X_WB.translation(), p, rtol=0, atol=ROUNDING)
    # Rates are those of the coordinates, and each is one joint's.
    assert plant.num_positions() == plant.num_velocities() == 2 * count == tree.coordinates
    v = rng.uniform(-1.0, 1.0, 2 * count)
    np.testing.assert_array_equal(plant.MapVelocityToQDot(context, v), v)
    found = {plant.get_joint(JointIndex(i)).name() for i in plant.GetJointIndices()}
    assert {name for names in joint_names(tree) for name in names} <= found


def test_two_links_in_a_plane_have_lengths_by_hand(tmp_path):
    _, plant, cables = loaded(tmp_path, two_link())
    context = plant.CreateDefaultContext()
    a, b = 0.3, 0.3 - 0.7  # of the links from z to x

    def at(angle, x, z):
        """A point of a link that is turned so, in W, and its derivative by that."""
        c, s = np.cos(angle), np.sin(angle)
        return np.array([c * x + s * z, c * z - s * x]), np.array([-s * x + c * z, -c * x - s * z])

    elbow, elbow_a = at(a, 0.0, 0.4)
    A1, B1 = np.array([0.5, 0.1]), np.array([-0.5, 0.1])
    V, V_a = at(a, 0.05, 0.22)  # both from the centres of mass, 0.2 and 0.1 along z
    P, P_b = at(b, 0.04, 0.16)
    Q, Q_b = at(b, -0.04, 0.2)
    P, Q = P + elbow, Q + elbow
    first, second = np.linalg.norm(V - A1), np.linalg.norm(P - V)
    third = np.linalg.norm(Q - B1)
    u1, u2, u3 = (V - A1) / first, (P - V) / second, (Q - B1) / third
    # q1 turns both links, q2 the second one: d/dq1 = d/da + d/db, d/dq2 = d/db.
    J = [[u1 @ V_a + u2 @ (elbow_a + P_b - V_a), u2 @ P_b], [u3 @ (elbow_a + Q_b), u3 @ Q_b]]
    lengths, found = cables.lengths_and_jacobian(context)
    np.testing.assert_allclose(lengths, [first + second, third], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(found, J, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize(
    ("kind", "moves"), [("S_QUATERNION", ""), ("SPATIAL_QUATERNION", "1 2 3 ")]
)
def test_quaternions_become_euler_angles(kind, moves, tmp_path):
    links = [Link(kind, moves + "1.6 0.4 -0.6 0.2", name="one"), Link("R_X", "0", 1, name="two")]
    model = Model(links, [Cable([(0, "3 3 3"), (1, "0 0 1")])])
    tree = read_tree(*pair(model, tmp_path), "toy")
    q = np.array([1.6, 0.4, -0.6, 0.2])
    R = RotationMatrix(Quaternion(q / np.linalg.norm(q))).matrix()
    joint = tree.links[0].joint
    found, r = DEFINED[joint.kind](joint.initial)
    np.testing.assert_allclose(found, R, rtol=0, atol=ROUNDING)
    np.testing.assert_array_equal(r, [1, 2, 3] if moves else [0, 0, 0])
    assert any(f"{kind} was read as {joint.kind}" in words for words in tree.remarks)


def test_inertia_about_the_joint_is_turned_to_the_centre_of_mass(tmp_path):
    """Steiner's theorem, by hand."""
    model, given = two_link(), np.array(BOX.split(), float)
    x, y, z = 0.1, -0.2, 0.3
    shift = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    about_joint = " ".join(repr(float(value)) for value in given + 1.5 * np.array(shift))
    model.links[0] = Link("R_Y", "0.3", name="upper", ref="joint", inertia=about_joint)
    tree = read_tree(*pair(model, tmp_path), "toy")
    np.testing.assert_allclose(tree.links[0].inertia, given, rtol=0, atol=1e-16)


def test_inertia_of_no_body_is_refused_or_repaired_by_name(tmp_path):
    model = two_link()
    model.links[1].inertia = "0.01 0.01 0.1 0 0 0"
    files = pair(model, tmp_path)
    with pytest.raises(
        RobotFileError, match=r"link 2, inertia: found 0\.01, 0\.01, 0\.1"
    ) as caught:
        read_tree(*files, "toy")
    assert "\n" not in str(caught.value)
    tree = read_tree(*files, "toy", None, True)
    np.testing.assert_allclose(tree.links[1].inertia, [0.05, 0.05, 0.1, 0, 0, 0], rtol=2e-6)
    np.testing.assert_array_equal(tree.links[0].inertia, np.array(BOX.split(), float))
    told = [words for words in tree.remarks if "principal moments" in words]
    assert len(told) == 1
    assert told[0].startswith("link 2: principal moments 0.01, 0.01, 0.1 were changed to 0.05")


def test_repaired_inertia_is_that_of_the_nearest_body():
    """Nearest in the integral of r r' over the mass: no other positive one is nearer."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        given = np.array([*rng.uniform(0.01, 0.1, 3), *rng.uniform(-0.03, 0.03, 3)])
        made = possible_inertia(given)
        assert excess(made) < 0.0
        if excess(given) < -1e-3:
            np.testing.assert_array_equal(made, given)
        S, S_made = (np.trace(J) / 2 * np.eye(3) - J for J in map(matrix_of, (given, made)))
        away = np.linalg.norm(S_made - S)
        for _ in range(20):
            L = rng.normal(size=(3, 3)) * 0.05
            other = S_made + 0.1 * (L @ L.T)  # another body
            assert np.linalg.norm(other - S) >= away - REPAIRED
    np.testing.assert_array_equal(possible_inertia(np.zeros(6)), 0.0)  # a point stays one


def test_a_tree_that_moves_no_mass_says_what_might_help(tmp_path):
    """A rod that a spherical joint can spin about itself has no inertia there."""
    rod = "0.02 0.02 0 0 0 0"
    model = Model(
        [
            Link("S_EULER_XYZ", "0 0 0", name="upper", com="0 0 0.2", inertia=rod),
            Link("R_Y", "0", 1, "0 0 0.4", "lower", com="0 0 0.1", inertia=rod),
        ],
        [Cable([(0, "1 1 1"), (2, "0.1 0 0.1")])],
    )
    path = model.write(tmp_path)
    with pytest.raises(RobotFileError) as caught:
        import_mechanism(path)
    words = str(caught.value)
    assert words.startswith(f"{path}: mechanism: found a joint of toy.xml that moves no mass")
    assert words.endswith("--repair-inertia gives them: upper, lower")
    imported = import_mechanism(path, repair_inertia=True)
    assert sum("principal moments" in words for words in imported.completed.remarks) == 2


def test_links_without_any_inertia_are_not_sent_to_a_repair_that_was_tried(tmp_path):
    none = "0 0 0 0 0 0"
    model = Model(
        [
            Link("S_EULER_XYZ", "0 0 0", name="upper", com="0 0 0", inertia=none),
            Link("R_Y", "0", 1, "0 0 0.4", "lower", com="0 0 0", inertia=none),
        ],
        [Cable([(0, "1 1 1"), (2, "0.1 0 0.1")])],
    )
    path = model.write(tmp_path)
    with pytest.raises(RobotFileError) as caught:
        import_mechanism(path, repair_inertia=True)
    words = str(caught.value)
    assert words.endswith("accepted: moments of inertia above 0 in the file, of upper, lower")
    assert "repair" not in words


def test_a_pulley_at_the_base_is_one_here(tmp_path):
    model = two_link()
    model.cables[1].points[0] = (
        "<base_rotating_pulley><fixed_location>-0.5 0 0.1</fixed_location><pulley_radius>0.03"
        "</pulley_radius><cable_entry_vector>0 0 2</cable_entry_vector></base_rotating_pulley>"
    )
    _, plant, cables = loaded(tmp_path, model)
    context = plant.CreateDefaultContext()
    lengths, _ = cables.lengths_and_jacobian(context)
    X_WB = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("lower"))
    B = X_WB.multiply(np.array([-0.04, 0.0, 0.2]))
    # The cable comes up at F = (-0.5, 0, 0.1), runs over the pulley's top to the side of B, and
    # leaves it along the tangent to B.
    C, r = np.array([-0.47, 0.0, 0.1]), 0.03
    d = float(np.linalg.norm(B - C))
    free = np.sqrt(d * d - r * r)
    bearing = np.arctan2(B[2] - C[2], B[0] - C[0])
    arc = r * (np.pi - (bearing + np.arccos(r / d)))
    np.testing.assert_allclose(lengths[1], free + arc, rtol=0, atol=ROUNDING)


def test_a_pulley_that_travels_is_put_where_the_file_has_a_point(tmp_path):
    model = two_link()
    screw = (
        "<screw_base_rotating_pulley><constant_winch_point>-0.5 0 0.1</constant_winch_point>"
        "<winch_vector>0 1 0</winch_vector><cable_pulley_entry_vector>0 0 1"
        "</cable_pulley_entry_vector><pulley_radius>0.03</pulley_radius><winch_radius>0.06"
        "</winch_radius><winch_groove_width>0.002</winch_groove_width></screw_base_rotating_pulley>"
    )
    for cable in model.cables:
        cable.points[0] = screw
    tree = read_tree(*pair(model, tmp_path), "toy")
    for cable in tree.cables:
        np.testing.assert_array_equal(cable.points[:, 0], [-0.5, 0.0, 0.1])
        assert cable.pulley_radius == 0.03
    assert sum("travel along their winches" in words for words in tree.remarks) == 1


def test_springs_have_their_stiffness_and_passive_ones_are_left_out(tmp_path):
    model = two_link()
    model.cables[0].kind = "cable_linear_spring"
    model.cables[0].properties += "<K>5000</K><diameter>0.002</diameter>"
    model.cables.append(
        Cable([(0, "0 1 1"), (1, "0 0 0.1")], "rubber", kind="cable_passive_linear_spring",
              properties="<K>10</K><l0>0.1</l0>")
    )  # fmt: skip
    model.cables.append(
        Cable([(0, "0 1 1"), (1, "0 0 0.1")], "cable 3", kind="cable_vsd_torsion_spring")
    )
    imported, _, cables = loaded(tmp_path, model)
    assert cables.routes.names == ("C1", "C2", "C3")
    np.testing.assert_allclose(cables.routes.ends.stiffness[0], 5000.0, rtol=1e-12)
    remarks = imported.completed.remarks
    assert "rubber, a passive spring, was left out." in remarks
    assert any("cable_vsd_torsion_spring" in words for words in remarks)


def test_sets_of_cables_and_their_names(tmp_path):
    model = two_link()
    model.sets = {"other": [Cable([(0, "1 1 1"), (1, "0 0 0.1")], name="7")], "empty": []}
    model.cables.append(Cable([(0, "1 0 1"), (1, "0 0 0.1")], name="Cable 2"))
    files = pair(model, tmp_path)
    tree = read_tree(*files, "toy")
    assert [cable.name for cable in tree.cables] == ["C1", "C2", "C2_3"]
    assert "Cables of the set basic; the file also has other." in tree.remarks
    assert any("is called 'C2_3'" in words for words in tree.remarks)
    assert [cable.name for cable in read_tree(*files, "toy", "other").cables] == ["C7"]
    with pytest.raises(RobotFileError, match=r"cable_set empty: found no cable; .* basic, other"):
        read_tree(*files, "toy", "empty")
    with pytest.raises(RobotFileError, match="cable set: found none; accepted: one of basic"):
        read_tree(*files, "toy", "none")


def test_names_of_links_stay_apart_from_massless_bodies(tmp_path):
    links = [Link("U_XZ", "0.1 0.2", k, "0 0 0.1", f"link {k + 1}") for k in range(11)]
    links.append(Link("R_X", "0", 11, "0 0 0.1", "world"))
    links.append(Link("R_X", "0", 11, "0 0 0.1", "link/2"))
    model = Model(links, [Cable([(0, "1 1 1"), (11, "0 0 0.1")])])
    imported, plant, _ = loaded(tmp_path, model)
    names = link_names(imported.tree)
    assert names[:3] == ("link_1_", "link_2", "link_3")
    assert names[-2:] == ("world_12", "link_2_13")
    assert all(plant.HasBodyNamed(name) for name in names)
    assert any("'link 1' is link_1_" in words for words in imported.completed.remarks)


def test_limits_that_a_joint_starts_beyond_are_left_out_by_name(tmp_path):
    model = two_link()
    model.links[1].q = "-2.6"
    imported, plant, _ = loaded(tmp_path, model)
    assert plant.GetJointByName("upper_ry").position_upper_limits() == [2.0]
    assert plant.GetJointByName("lower_ry").position_upper_limits() == [np.inf]
    said = "Limits of joints that start beyond them were left out: lower_ry."
    assert said in imported.completed.remarks
    assert plant.num_actuators() == 1

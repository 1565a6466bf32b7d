"""Mechanisms at rest on their cables: residuals, a simulation that does not move, and tensions."""

import numpy as np
import pytest
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.analyses.mechanisms import place_mechanism
from cdpr_drake.analyses.statics.static import solve_static
from cdpr_drake.analyses.tensions import solve_tensions
from cdpr_drake.errors import (
    CdprError,
    EquilibriumError,
    InfeasibleTensionError,
    RobotFileError,
    TensionProblemError,
)
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.systems.robots.route_assembly import add_cables

pytestmark = pytest.mark.usefixtures("in_this_process")

STILL = 1e-9
"""What moves less in a second was at rest [m, rad]: an ulp of a length times E S over an inertia
accelerates by some 1e-9 m/s^2."""

BALANCED = 1e-8
"""Of forces up to 1000 N m, after lengths of 2 m are rounded at a stiffness of 3.5e5 N [N, N m]."""

SAME = 1e-6
"""Between a program of Drake and one of our kernels [N]."""

ARM = {"arm_on_platform::shoulder": 0.4, "arm_on_platform::elbow": -0.7}
JOINTS = tuple(ARM)


@pytest.mark.parametrize("name", mechanism_names())
def test_a_second_of_simulation_does_not_move_it(name):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    added = add_mechanism(plant, load_mechanism(name))
    added.finalize()
    cables = add_cables(builder, plant, added.routes())
    still = builder.AddSystem(ConstantVectorSource(np.zeros(added.routes().count)))
    builder.Connect(still.get_output_port(), cables.GetInputPort("cable_velocities"))
    found = solve_static(name)
    rest = found.rest
    if plant.num_actuators():
        effort = plant.MakeActuationMatrix().T @ rest.held
        motors = builder.AddSystem(ConstantVectorSource(effort))
        builder.Connect(motors.get_output_port(), plant.get_actuation_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    cables.put(simulator.get_mutable_context(), rest)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.AdvanceTo(1.0)
    after = plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context()))
    assert rest.residual < BALANCED
    assert rest.stability == "stable"
    np.testing.assert_allclose(after, rest.positions, rtol=0.0, atol=STILL)
    np.testing.assert_array_equal(rest.positions, added.home_positions())


def test_motors_hold_the_weight_of_the_arm():
    found = solve_static("arm_on_platform")
    held = found.held()
    upper, lower, g = 0.5, 0.3, 9.81
    # Shoulder at 0.4, elbow at 0.4 - 0.7: lever arms in the vertical plane, links from their ends.
    elbow = lower * g * 0.075 * np.sin(0.4 - 0.7)
    shoulder = upper * g * 0.1 * np.sin(0.4) + lower * g * 0.2 * np.sin(0.4) + elbow
    assert held["arm_on_platform::shoulder"][0] == pytest.approx(shoulder, abs=BALANCED)
    assert held["arm_on_platform::elbow"][0] == pytest.approx(elbow, abs=BALANCED)
    assert found.as_dict()["held"] == held


def test_a_passive_arm_hangs_straight_down():
    with pytest.raises(InfeasibleTensionError, match="arm_on_platform::"):
        solve_static("arm_on_platform", held=[], free=[])
    found = solve_static("arm_on_platform", held=[])
    q = found.placed.positions(found.rest.positions)
    assert [q[name][0] for name in JOINTS] == pytest.approx([0.0, 0.0], abs=STILL)
    assert q["arm_on_platform::platform"][:3] == [0.0, 0.0, 0.5]
    assert found.held() == {}
    assert found.rest.stability == "stable"


def test_an_arm_that_stands_upright_is_unstable():
    up = dict(zip(JOINTS, (2.5, 0.0), strict=True))
    found = solve_static("arm_on_platform", joints=up, held=[])
    q = found.placed.positions(found.rest.positions)
    assert q[JOINTS[0]][0] == pytest.approx(np.pi, abs=STILL)
    assert found.rest.stability == "unstable"
    assert found.as_dict()["frequencies_hz"][0] is None


def test_prestress_or_pose_yields():
    kept = solve_static("cable_arm", prestress=50.0)
    moved = solve_static("cable_arm", prestress=50.0, yields="pose")
    home = kept.placed.plant.GetPositions(kept.placed.plant.CreateDefaultContext())
    np.testing.assert_array_equal(kept.rest.positions, home)
    assert np.max(np.abs(moved.rest.tensions - 50.0)) < 1e-3
    assert np.max(np.abs(moved.rest.positions - home)) > 0.1


def test_lengths_say_where_it_rests():
    hung = solve_static("mobile_bases")
    again = solve_static("mobile_bases", lengths=hung.rest.unstrained_lengths)
    np.testing.assert_allclose(again.rest.positions, hung.rest.positions, atol=STILL)
    shorter = hung.rest.unstrained_lengths.copy()
    shorter[::2] -= 0.02  # the upper cables
    z = solve_static("mobile_bases", lengths=shorter).rest.positions[-1]
    platform = hung.placed.positions(hung.rest.positions)["platform::platform"]
    lifted = solve_static("mobile_bases", lengths=shorter)
    assert lifted.placed.positions(lifted.rest.positions)["platform::platform"][2] > platform[2]
    assert np.isfinite(z)
    with pytest.raises(CdprError, match="prestress: found with lengths"):
        solve_static("mobile_bases", lengths=shorter, prestress=5.0)


@pytest.mark.parametrize("name", mechanism_names())
def test_tensions_of_least_norm_are_those_of_hang(name):
    tensions = solve_tensions(name)
    assert tensions.status == "feasible"
    np.testing.assert_allclose(tensions.tensions, solve_static(name).rest.tensions, atol=SAME)


def test_the_weight_has_its_sign():
    # A suspended mechanism tells the sign of the wrench; a fully constrained one does not.
    found, placed = (
        solve_tensions("mobile_bases", limits=(0.0, 1000.0)),
        place_mechanism("mobile_bases"),
    )
    J = placed.cables.length_jacobian(placed.context)
    weight = placed.cables.other_forces(placed.context)
    left = (weight - J.T @ found.tensions)[-6:]
    assert np.max(np.abs(left)) < 1e-6
    assert weight[-1] == pytest.approx(-98.1)


def test_every_method_balances():
    found = solve_tensions("cable_arm", method="all")
    placed = place_mechanism("cable_arm")
    W = -placed.cables.length_jacobian(placed.context).T
    w = placed.cables.other_forces(placed.context)
    feasible = [one for one in found.solutions if one.status == "feasible"]
    assert len(feasible) > 10
    for one in feasible:
        assert np.max(np.abs(W @ one.tensions + w)) < 1e-6, one.method


def test_bounds_that_give_way_by_the_shortfall_hold_a_mechanism():
    least = solve_tensions("cable_arm")
    assert least.shortfall is None
    largest = float(np.max(least.tensions))
    limits = (0.6 * largest, 0.7 * largest)
    found = solve_tensions("cable_arm", limits=limits)
    assert found.status == "infeasible"
    beyond = found.as_dict()["infeasible_by"]["beyond_bounds_n"]
    for give, status in ((1.001, "feasible"), (0.999, "infeasible")):
        wider = (limits[0] - give * beyond, limits[1] + give * beyond)
        assert solve_tensions("cable_arm", limits=wider).status == status


def test_what_no_cable_acts_on_is_said():
    found = solve_tensions("arm_on_platform", held=[])
    assert found.status == "infeasible"
    words = [row["combination"] for row in found.uncontrolled()]
    assert words == [f"moment at {name}" for name in JOINTS]
    assert found.as_dict()["rank"] == 6
    down = solve_tensions("arm_on_platform", held=[], joints=dict.fromkeys(JOINTS, 0.0))
    assert down.status == "feasible"
    with pytest.raises(TensionProblemError, match="accepted: quadratic_program"):
        solve_tensions("arm_on_platform", method="closed_form", held=[])


HANG, SOLVE = solve_static, solve_tensions


@pytest.mark.parametrize(
    ("ask", "arguments", "error", "words"),
    [
        (SOLVE, {"held": ["shoulder", "elbow"]}, TensionProblemError, "all joints held"),
        (SOLVE, {"held": "knee"}, EquilibriumError, "accepted: one of cable_arm::elbow"),
        (SOLVE, {"length_scale": 0.0}, TensionProblemError, "length_scale"),
        (HANG, {"joints": {"elbow": "a"}}, EquilibriumError, "joints: found"),
        (HANG, {"joints": {"elbow": [1.0, [2.0]]}}, EquilibriumError, "joints: found"),
        (HANG, {"joints": {"elbow": np.nan}}, RobotFileError, r"home\.joints\.elbow: found"),
        (HANG, {"joints": {"elbow": 3.0}}, RobotFileError, r"home\.joints\.elbow: found"),
        (HANG, {"joints": {"elbow": [0.1, 0.2]}}, RobotFileError, r"home\.joints\.elbow: found"),
        (HANG, {"prestress": [1.0, 2.0]}, InfeasibleTensionError, "prestress"),
        (HANG, {"limits": (5.0, 1.0)}, InfeasibleTensionError, "lower <= upper"),
        (HANG, {"model": "rubber"}, EquilibriumError, "model: 'rubber' is unknown"),
    ],
)
def test_wrong_questions(ask, arguments, error, words):
    with pytest.raises(error, match=words):
        ask("cable_arm", **arguments)


def test_joints_of_home_can_be_put_elsewhere():
    placed = place_mechanism("cable_arm", {"elbow": 1.0})
    assert placed.positions(placed.plant.GetPositions(placed.context)) == {
        "cable_arm::shoulder": [0.2], "cable_arm::elbow": [1.0],
    }  # fmt: skip

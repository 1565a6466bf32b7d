"""Scenario files of mechanisms: what is refused, what motion they mean, who takes them."""

import shutil

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BallRpyJoint, SpatialInertia

from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.models.robot_loader import names_mechanism, robot_file
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.mechanism_control import build_mechanism_follower
from cdpr_drake.systems.scenarios.files import (
    check_moves_robot,
    robot_scenario_names,
    scenario_file,
    scenario_names,
)
from cdpr_drake.systems.scenarios.mechanism_motion import plant_motion
from cdpr_drake.systems.scenarios.mechanism_scenario import Waypoint

ARM, BASES = "cable_arm_computed_torque", "mobile_bases_winches"


def waypoint(words):
    return f"motion.waypoints=[{{time: 1.0, {words}}}]"


@pytest.mark.parametrize(
    ("name", "overrides", "words"),
    [
        (ARM, ["motion.waypoints=[]"], "motion.waypoints: found none; accepted: at least one"),
        (
            ARM,
            ["motion.waypoints=[{time: 1.0}, {time: 0.5}]"],
            "motion.waypoints[1].time: found 0.5; accepted: above 1 [s]",
        ),
        (ARM, [waypoint("joints: {knee: 1}")], "joints.knee: found knee; accepted: one of"),
        (ARM, [waypoint("joints: {elbow: 2.5}")], "joints.elbow: found 2.5; accepted: within"),
        (ARM, [waypoint("joints: {elbow: [1, 2]}")], "joints.elbow: found 2 numbers; accepted: 1"),
        (ARM, [waypoint("bodies: {upper: {position: [0, 0, 0]}}")], "bodies.upper: found upper"),
        (ARM, ["control.kind=magic"], "control.kind: found magic"),
        (ARM, ["control.kp=-1"], "control.kp: found -1"),
        (ARM, ["control.limits=[9, 3]"], "control.limits: found [9.0, 3.0]; accepted: lower <"),
        (ARM, ["control.method=kernel"], "control.method: kernel: found redundancy"),
        (ARM, ["control.method=reference_program"], "control.prestress: found null"),
        (ARM, ["control.prestress=20"], "control.prestress: found 20; accepted: null with"),
        (ARM, ["control.limits=[2, 20]", waypoint("joints: {elbow: 1.5}")],
         "motion.waypoints[0]: found positions where no tensions within 2..20 N"),
        (ARM, ["integration.engine=compiled"], "engine: found compiled; accepted: plant"),
        (ARM, ["cables.model=elastic"], "cables.model: found elastic; accepted: with winches"),
        (ARM, ["cables.stiffness_ratio=0.5"], "cables.stiffness_ratio: found 0.5"),
        (ARM, ["mechanism=cable_leg"], "mechanism: found 'cable_leg'; did you mean cable_arm"),
        (ARM, ["mechanism=planar"], "mechanism: found 'planar'; known: arm_on_platform, bm_arm"),
        (ARM, ["robot=planar"], "no key robot"),
        (BASES, ["control.method=kernel"], "control.method: found kernel; accepted: with comp"),
        (BASES, ["cables.model=catenary"], "cables.model: hang: found cables by the model cat"),
        (BASES, ["control.limits=[200, 210]"], "control: at the start, "),
    ],
)  # fmt: skip
def test_refusals_are_one_line(name, overrides, words):
    with pytest.raises(CdprError) as caught:
        load_scenario(name, overrides)
    message = str(caught.value)
    assert words in message
    assert scenario_file(name).name in message or message.startswith("overrides ")
    assert "\n" not in message


def test_joints_stay_where_they_were_before():
    motion = build_mechanism_follower(
        load_scenario(ARM, ["motion.waypoints=[{time: 1.0, joints: {elbow: 0.6}}, {time: 2.0, "
                            "joints: {shoulder: 0.3}}]"])
    ).motion  # fmt: skip
    np.testing.assert_allclose(motion.positions, [[0.2, 0.4], [0.2, 0.6], [0.3, 0.6]])


def test_a_mechanism_is_found_beside_the_file(tmp_path):
    shutil.copytree(robot_file("cable_arm").parent, tmp_path / "mine")
    path = tmp_path / "held.yaml"
    path.write_text(
        "kind: mechanism\nname: held\nmechanism: ./mine\nduration: 1.0\n"
        "motion: {waypoints: [{time: 1.0, joints: {elbow: 0}}]}\ncontrol: {kind: winches}\n"
    )
    assert not names_mechanism(path)  # though it has the key mechanism
    assert load_scenario(str(path)).mechanism == str(tmp_path / "mine")


def test_joints_whose_velocities_are_not_rates_of_positions_are_refused():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidSphereWithMass(1.0, 0.2))
    plant.AddJoint(BallRpyJoint("ball", plant.world_frame(), body.body_frame()))
    plant.Finalize()
    with pytest.raises(ScenarioError, match="found a joint of the type ball_rpy; accepted: revol"):
        plant_motion(plant, np.zeros(3), [Waypoint(time=1.0, joints={"ball": np.zeros(3)})])
    stays = plant_motion(plant, np.full(3, 0.2), [Waypoint(time=1.0)])
    assert not np.any(stays.at(0.5)[1])


def test_what_takes_robots_refuses_them():
    assert set(scenario_names()) - set(robot_scenario_names()) == {ARM, BASES}
    check_moves_robot("acrobot_pbvs", "cdpr serve")
    with pytest.raises(ScenarioError, match="found mechanism; accepted by cdpr serve: kinds"):
        check_moves_robot(ARM, "cdpr serve")

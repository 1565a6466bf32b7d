"""A section of dynamic control by somebody else, with a block in the place of the controller."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.control.task_space import TaskGains
from cdpr_drake.errors import ScenarioError
from cdpr_drake.schema.declarations import settings
from cdpr_drake.systems.controllers.computed_torque import PoseTracking
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.sections import Section
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory


class Watching(PoseTracking):
    """Computed torque that says how hard the cables pull and how long they are, in all."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        for name, total in (("tensions", "pull"), ("lengths", "reach")):
            port = self.DeclareVectorInputPort(name, 8)

            def write(context, out, port=port):
                out.SetFromVector([np.sum(port.Eval(context))])

            self.DeclareVectorOutputPort(
                total, 1, write, {self.input_port_ticket(port.get_index())}
            )

    def logged(self):
        """As of `PoseTracking`, and both sums."""
        return (*super().logged(), "pull", "reach")


@settings
class Watch(Section):
    """A toy of a section."""

    words = "A watch"

    def tension_blocks(self, settings, robot):
        """The controller."""
        assert settings.dynamics is not None
        assert settings.believed_cables.count == len(robot.cables)
        return {"controller": Watching}


def test_a_section_brings_a_controller_that_sees_cables_and_logs():
    motion = PoseTrajectory(
        (RigidTransform([0.0, 0.0, 0.3]), RigidTransform([0.05, 0.0, 0.3])), (0.2,)
    )
    wanted = TensionControlSettings(
        trajectory=motion, gains=TaskGains(stiffness=100.0, damping=20.0), rate=200.0,
        limits=(1.0, 60.0), sections=[Watch()],
    )  # fmt: skip
    control = build_tension_control("acrobot_large", wanted, log_rate=50.0)
    simulator = Simulator(control.diagram, control.make_context())
    simulator.AdvanceTo(0.2)
    log = control.read_log(simulator.get_context())
    assert len(log["time"]) > 5
    for total, parts in (("pull", "tensions"), ("reach", "lengths")):
        np.testing.assert_allclose(log[total][:, 0], np.sum(log[parts], axis=1), rtol=1e-12)


@pytest.mark.parametrize(("changes", "follow", "words"), [
    (["remote.place=controller"], Follow(), "remote: found a section, so a process outside"),
    ([], Follow(connect=print), "found no section that lets a process outside close the loop"),
])  # fmt: skip
def test_a_process_outside_is_there_just_where_a_section_wants_it(changes, follow, words):
    run = TensionRun(load_scenario("acrobot_computed_torque", changes))
    with pytest.raises(ScenarioError, match=words):
        run.simulate(follow=follow)

"""An estimate that is always wrong by the same."""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.systems.estimators.basic_estimators import ShiftedPose

ROUNDING = 1e-12


def test_ports_have_their_names():
    system = ShiftedPose(RigidTransform(), RigidTransform())
    assert system.get_input_port().get_name() == "X_WP_measured"
    assert system.get_output_port().get_name() == "X_WP"


def test_the_error_is_the_same_everywhere():
    start = RigidTransform(RotationMatrix.MakeXRotation(0.4), [1.0, 0.0, 0.5])
    turn = RotationMatrix.MakeZRotation(0.1)
    believed = RigidTransform(start.rotation() @ turn, [1.0, 0.03, 0.5])
    system = ShiftedPose(start, believed)
    context = system.CreateDefaultContext()
    for angle in (0.0, 0.4, 1.3):
        X_WP = RigidTransform(RotationMatrix.MakeXRotation(angle), [angle, 2.0, 0.5])
        system.get_input_port().FixValue(context, X_WP)
        found = system.get_output_port().Eval(context)
        np.testing.assert_allclose(
            found.translation() - X_WP.translation(), [0.0, 0.03, 0.0], atol=ROUNDING
        )
        error = X_WP.rotation().inverse() @ found.rotation()
        np.testing.assert_allclose(error.matrix(), turn.matrix(), atol=ROUNDING)

"""Rows of the log: which quantity stands where, and poses as seven numbers."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import LeafSystem

from cdpr_drake.geometry.poses import pose_error, pose_from_angles, pose_from_row, pose_row
from cdpr_drake.systems.monitoring.log_row import POSE_SIZE, LogRow

ROUND_OFF = 1e-12
"""Of a pose with entries up to ten."""


class Sources(LeafSystem):
    """Ports of both kinds, to be logged."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("pair", 2, lambda context, output: None)
        self.DeclareAbstractOutputPort(
            "pose", lambda: Value(RigidTransform()), lambda context, output: None
        )
        self.DeclareVectorOutputPort("one", 1, lambda context, output: None)

    def ports(self):
        return {name: self.GetOutputPort(name) for name in ("pair", "pose", "one")}


def test_ports_and_columns_are_in_the_given_order():
    row = LogRow(Sources().ports())
    inputs = [row.get_input_port(i) for i in range(row.num_input_ports())]
    assert [(port.get_name(), port.size()) for port in inputs] == [
        ("pair", 2),
        ("pose", 0),
        ("one", 1),
    ]
    assert row.columns == {"pair": slice(0, 2), "pose": slice(2, 9), "one": slice(9, 10)}
    assert row.num_output_ports() == 1
    assert row.GetOutputPort("log_row").size() == 10


def test_a_row_holds_what_stands_on_the_ports():
    row = LogRow(Sources().ports())
    X = pose_from_angles(np.array([1.0, 2.0, 3.0]), np.array([0.1, -0.2, 0.3]))
    for pair in ([4.0, 5.0], [-1.0, 0.5]):  # a second context, a second row
        context = row.CreateDefaultContext()
        row.GetInputPort("pair").FixValue(context, pair)
        row.GetInputPort("pose").FixValue(context, Value(X))
        row.GetInputPort("one").FixValue(context, [6.0])
        found = row.GetOutputPort("log_row").Eval(context)
        np.testing.assert_array_equal(found, [*pair, *pose_row(X), 6.0])


def test_a_pose_is_its_quaternion_and_position():
    half = np.sqrt(0.5)
    X = pose_from_angles(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, np.pi / 2.0]))
    np.testing.assert_allclose(pose_row(X), [half, 0, 0, half, 1, 2, 3], atol=ROUND_OFF)


@given(
    position=st.tuples(*[st.floats(-10.0, 10.0)] * 3),
    angles=st.tuples(*[st.floats(-np.pi, np.pi)] * 3),
)
def test_a_pose_comes_back_from_its_row(position, angles):
    X = pose_from_angles(np.array(position), np.array(angles))
    row = pose_row(X)
    assert row.shape == (POSE_SIZE,)
    assert row[0] >= 0.0
    assert max(pose_error(X, pose_from_row(row))) < ROUND_OFF

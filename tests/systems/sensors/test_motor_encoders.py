"""Encoders: ports, whole counts, lengths by the true and by a wrong drum."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator

from cdpr_drake.models.sensor_catalogue import EncoderModel
from cdpr_drake.systems.sensors.motor_encoders import MotorEncoders
from cdpr_drake.winches.drum import Drum

REFERENCE = np.array([1.0, 1.5, 0.8])
DRUM = Drum(radius=0.041, gear_ratio=10.0, layer_turns=4.0, layer_height=0.002, wound=1.2)
COARSE = EncoderModel(name="coarse", counts_per_turn=100, rate_hz=1000.0)


def measured(encoders, lengths):
    sample = encoders.measure(np.asarray(lengths), 1)
    return sample[:3], sample[3:]


def test_ports_are_these():
    encoders = MotorEncoders(COARSE, DRUM, REFERENCE)
    assert encoders.GetInputPort("unstrained_lengths").size() == 3
    assert encoders.num_output_ports() == 2
    for name in ("motor_angles", "measured_lengths"):
        assert encoders.GetOutputPort(name).size() == 3


@given(st.lists(st.floats(-0.5, 0.5), min_size=3, max_size=3))
def test_lengths_are_right_to_half_a_count(paid_out):
    lengths = REFERENCE + np.array(paid_out)
    angles, found = measured(MotorEncoders(COARSE, DRUM, REFERENCE), lengths)
    count = 2.0 * np.pi / 100
    np.testing.assert_allclose(angles / count, np.round(angles / count), atol=1e-9)
    largest = 0.5 * count * np.max(DRUM.length_per_angle(angles + np.array([[-count], [count]])))
    assert np.max(np.abs(found - lengths)) <= largest * (1.0 + 1e-9)


def test_a_controller_that_ignores_the_layers_is_wrong_by_them():
    plain = Drum(radius=0.041, gear_ratio=10.0)
    fine = EncoderModel(name="fine", counts_per_turn=2**24, rate_hz=1000.0)
    lengths = REFERENCE + 0.3
    _, found = measured(MotorEncoders(fine, DRUM, REFERENCE, plain), lengths)
    turned = DRUM.motor_angles(np.full(3, 0.3))
    np.testing.assert_allclose(found, REFERENCE + 0.0041 * turned, atol=1e-8)
    assert np.all(np.abs(found - lengths) > 1e-3)


def test_samples_arrive_on_the_ports():
    encoders = MotorEncoders(COARSE, DRUM, REFERENCE, rate=50.0)
    simulator = Simulator(encoders)
    context = simulator.get_mutable_context()
    encoders.GetInputPort("unstrained_lengths").FixValue(context, REFERENCE)
    simulator.AdvanceTo(0.01)
    np.testing.assert_array_equal(encoders.GetOutputPort("motor_angles").Eval(context), np.zeros(3))
    found = encoders.GetOutputPort("measured_lengths").Eval(context)
    np.testing.assert_allclose(found, REFERENCE, atol=1e-14)

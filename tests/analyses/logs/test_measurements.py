import numpy as np
import pytest

from cdpr_drake.analyses.fits.tags import read_tags
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.poses import pose_from_angles

CABLES = ("C1", "C2")


@pytest.fixture
def read(write):
    return lambda text: read_measurements(write("log.csv", text), CABLES)


def test_units_separators_and_gaps(read):
    header = "time_ms;l1_mm;tension_1 (kN);C2_swivel_deg;x_mm;y_mm;z_mm;phi_deg;theta_deg;psi_deg;n"
    log = read(f"# robot\n{header}\n" + "0;1,5;0,1;90;1;2;3;0;0;90;7\n10;;;;;;;;;;\n")
    np.testing.assert_allclose(log.time, [0.0, 0.01])
    np.testing.assert_allclose(log.lengths, [[0.0015, np.nan], [np.nan, np.nan]])
    assert log.tensions[0, 0] == 100.0
    assert log.swivels[0, 1] == pytest.approx(np.pi / 2)
    expected = pose_from_angles(np.array([0.001, 0.002, 0.003]), np.array([0, 0, np.pi / 2]))
    assert log.poses[0].IsNearlyEqualTo(expected, 1e-12)
    assert log.poses[1] is None
    assert log.remarks == ("columns not read: n",)


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("qw,qx,qy,qz", f"{np.cos(0.15):.15f},0,0,{np.sin(0.15):.15f}"),
        ("phi,theta,psi", "0,0,0.3"),
        ("rx,ry,rz", "0,0,0.3"),
        ("roll,pitch,yaw", "0,0,0.3"),
    ],
)
def test_rotations_of_every_kind_agree(read, header, row):
    log = read(f"x,y,z,{header}\n1,2,3,{row}\n")
    expected = pose_from_angles(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 0.3]))
    assert log.poses[0].IsNearlyEqualTo(expected, 1e-9)


def test_roll_pitch_and_yaw_without_a_position_are_an_inclination(read):
    log = read("C1_length_m,roll_deg,pitch_deg,yaw_deg\n1,10,20,30\n1,,,\n")
    assert log.poses is None
    np.testing.assert_allclose(log.tilts[0], np.radians([10.0, 20.0, 30.0]))
    assert np.isnan(log.tilts[1]).all()
    alone = read("C1_length_m,pitch_rad\n1,0.2\n")
    np.testing.assert_allclose(alone.tilts, [[np.nan, 0.2, np.nan]])


def test_other_rotations_without_a_position_are_one_too(read):
    half = np.radians(15.0)
    log = read(f"C1_length_m,qw,qx,qy,qz\n1,{np.cos(half)},{np.sin(half)},0,0\n")
    np.testing.assert_allclose(log.tilts, [[np.radians(30.0), 0.0, 0.0]], atol=1e-12)
    log = read("C1_length_m,phi_deg,theta_deg,psi_deg\n1,0,0,40\n")
    np.testing.assert_allclose(log.tilts, [[0.0, 0.0, np.radians(40.0)]], atol=1e-12)


def test_cables_with_other_names_are_bound_by_their_order_and_a_remark_says_so(read):
    log = read("C1_length_m,E_length_m\n1,2\n")
    np.testing.assert_array_equal(log.lengths, [[1.0, 2.0]])
    assert "E is C2" in log.remarks[0]


def test_corners_of_tags(read):
    names = [f"tag7_{a}{c}_px" for c in range(1, 5) for a in "uv"]
    log = read(",".join(names) + "\n" + ",".join("12345678") + "\n")
    np.testing.assert_allclose(log.corners[7], np.arange(1.0, 9.0).reshape(1, 4, 2))


def test_tags_with_and_without_a_place(write):
    header = "tag,size_mm,x_m,y_m,z_m,phi_deg,theta_deg,psi_deg"
    tags = read_tags(write("tags.csv", f"{header}\n3,60,1,0,0,0,0,0\n4,50,,,,,,\n"))
    assert tags[3][0] == pytest.approx(0.06)
    assert tags[3][1].translation()[0] == 1.0
    assert tags[4][:2] == (pytest.approx(0.05), None)
    with pytest.raises(CalibrationError, match="size > 0"):
        read_tags(write("tags.csv", "tag,size_m\n3,0\n"))

import numpy as np

import cdpr_drake as cdpr
from tests.figure_faults import figure_faults


def drawn(tmp_path, header, row):
    """The figure of a log of a few rows, and its axes by their labels."""
    path = tmp_path / "recorded.csv"
    rows = [",".join(str(value * (k + 1)) for value in row) for k in range(5)]
    path.write_text("\n".join([header, *rows]) + "\n")
    figure = cdpr.import_log(path).plot()
    assert figure_faults(figure) == []
    return figure, {axes.get_ylabel(): axes for axes in figure.axes}


def names(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_motor_angles_in_degrees_of_cables_with_any_names_are_drawn(tmp_path):
    figure, panels = drawn(
        tmp_path, "A_motor_deg,B_motor_deg,C1_motor_angle_rad,x_mm,y_mm,z_mm",
        (90.0, 180.0, 2.0, 1.0, 2.0, 3.0),
    )  # fmt: skip
    assert list(panels) == ["motor angle [deg]", "motor angle [rad]", "position [m]"]
    degrees = panels["motor angle [deg]"]
    assert names(degrees) == ["A_motor", "B_motor"]
    assert np.allclose(degrees.lines[1].get_ydata(), 180.0 * np.arange(1, 6))
    assert "not drawn" not in figure.get_suptitle()


def test_columns_that_are_not_drawn_are_said(tmp_path):
    header = "time_s,C1_length_m,supply_voltage," + ",".join(f"aux{k}" for k in range(9))
    figure, panels = drawn(tmp_path, header, range(1, 13))
    assert list(panels) == ["cable length [m]"]
    title = " ".join(figure.get_suptitle().split())
    assert title.endswith("not drawn: supply_voltage, aux0, aux1, aux2, aux3, aux4, aux5, aux6 "
                          "and 2 more")  # fmt: skip

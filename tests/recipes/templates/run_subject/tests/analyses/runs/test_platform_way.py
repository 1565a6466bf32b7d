"""How far the platform went."""

import json

import cdpr_drake as cdpr


def test_a_run_has_the_way_in_its_summary_and_a_figure(tmp_path):
    changes = ["camera.kind=projected", "duration=0.3"]
    run = cdpr.simulate("acrobot_pbvs", changes, folder=tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["platform_way"]["length_m"] > 0.0
    assert (tmp_path / "out" / "platform_way.png").is_file()
    assert run.plot("platform_way").axes[0].get_ylabel() == "way of P [m]"

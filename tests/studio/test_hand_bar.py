"""A cable that is broken and a platform that is pushed, by buttons, in a run that goes on."""

from cdpr_drake.studio.run import _boards
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.studio.pages import field, opened_page, problems, shown, until
from tests.studio.run_page import write_scenario


async def test_buttons_break_and_push_and_the_scenario_keeps_it(tmp_path):
    write_scenario(tmp_path, **{"duration: 30.0": "duration: 0.5"})
    async with opened_page(tmp_path, "acrobot_small") as (user, bench, _):
        user.find(marker="tab-run").click()
        await until(lambda: "acrobot_pbvs.yaml" in field(user, "scenario").options)
        field(user, "scenario").value = "acrobot_pbvs.yaml"
        field(user, "paused").value = field(user, "by-hand").value = True
        user.find(marker="start").click()
        board = _boards[bench]
        await until(lambda: _ready(user), 600.0)
        job = board.run(board.shown).job
        assert field(user, "hand-cable").options[2] == "C3"
        field(user, "hand-cable").value = 2
        user.find(marker="break").click()
        await until(lambda: "C3 breaks" in field(user, "hand-done").text)
        assert 2 not in field(user, "hand-cable").options
        field(user, "push-force").value = 0.0
        user.find(marker="push").click()
        await until(lambda: any("force: found" in words for words in problems(user)))
        field(user, "push-force").value, field(user, "push-direction").value = 4.0, "-y"
        user.find(marker="push").click()
        await until(lambda: "push of 4 N for 0.3 s" in field(user, "hand-done").text)
        job.set_speed(None)
        job.go()
        await until(lambda: job.state.is_over, 600.0)
        kept = load_scenario(str(job.folder / "scenario.yaml"))
        assert [(event.kind, event.cable) for event in kept.failures.events] == [
            ("cable_breaks", 2)
        ]
        assert kept.disturbances.pushes[-1].force.tolist() == [0.0, -4.0, 0.0]
        await until(lambda: not field(user, "break").enabled)


def _ready(user):
    return shown(user, "break") and field(user, "break").enabled

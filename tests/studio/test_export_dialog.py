"""Who exports a robot from the studio is told what its format could not hold."""

import asyncio

from cdpr_drake.models.robot_exports import export_omissions, omission_words
from cdpr_drake.models.robot_loader import load_robot
from tests.studio.pages import field, opened_page, until


def test_what_was_not_written_is_said_over_the_page(tmp_path):
    async def scenario():
        async with opened_page(tmp_path) as (user, _, _):
            user.find(marker="export").click()
            await user.should_see(marker="export-now")
            field(user, "export-format").value = "sdf"
            user.find(marker="export-now").click()
            await until(lambda: user.notify.messages, 60.0)
            return list(user.notify.messages)

    said = asyncio.run(scenario())
    lost = export_omissions(load_robot("acrobot_large"), "sdf")
    assert "cable.youngs_modulus" in lost
    assert "\n".join(omission_words(lost)) in said

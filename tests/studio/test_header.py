"""The open robot is the subject of every tab: its name, state and fingerprint, and what an import
assumed."""

import asyncio

from cdpr_drake.studio.workbench.yaml_edit import with_value
from tests.models.formats.foreign_files import caspr
from tests.studio.pages import field, opened_page, shown, type_into, until


def said(user):
    return tuple(field(user, f"subject-{name}").text for name in ("name", "state", "fingerprint"))


def test_name_state_and_fingerprint_follow_the_robot(tmp_path):
    async def look():
        async with opened_page(tmp_path, "acrobot_small") as (user, bench, _):
            name, state, first = said(user)
            assert (name, state) == ("acrobot_small", "of the package")
            assert first == bench.subject.digest[:8]
            heavier = with_value(bench.robot.text, ("platform", "mass"), 5.25)
            bench.robot.change(heavier)
            assert said(user)[1] == "not saved"
            assert said(user)[2] not in ("", first)
            bench.save("mine.yaml", overwrite=False)
            assert said(user)[1] == "saved"
            bench.robot.change(with_value(heavier, ("platform", "mass"), 5.5))
            assert said(user)[1] == "edited, not saved"
            bench.robot.undo()
            assert said(user)[1] == "saved"
            bench.open("planar")
            assert said(user)[:2] == ("planar", "of the package")

    asyncio.run(look())


def test_what_an_import_assumed_stays_as_a_card_until_it_is_seen(tmp_path):
    caspr(tmp_path)
    files = {path.name: path.read_bytes() for path in tmp_path.glob("*.xml")}

    async def look():
        async with opened_page(tmp_path, "acrobot_small") as (user, bench, _):
            assert not shown(user, "assumed")
            opened = bench.upload(files)
            assert any(line.startswith("assumed ") for line in opened.notes)
            assert shown(user, "assumed")
            assert bench.assumed == opened.notes
            bench.save("toy.yaml", overwrite=False)
            assert bench.assumed == opened.notes
            bench.open("planar")
            assert not shown(user, "assumed")
            bench.robot.undo()
            assert shown(user, "assumed")
            user.find(marker="assumed-seen").click()
            await until(lambda: not shown(user, "assumed"))

    asyncio.run(look())


def test_undo_and_redo_by_keys_in_a_field(tmp_path):
    async def look():
        async with opened_page(tmp_path, "acrobot_small") as (user, bench, _):
            type_into(user, "cell-cables-0-exit_point-0", "-0.37")
            cell = field(user, "cell-cables-0-exit_point-0")

            def press(key, shift=False):
                for one in cell._event_listeners.values():
                    if one.type == f"keydown.ctrl.{key}":
                        one.handler(_Pressed({"key": key, "shiftKey": shift}))

            assert bench.robot.value.cables[0].exit_point[0] == -0.37
            press("z")
            assert bench.robot.value.cables[0].exit_point[0] == -0.47
            press("y")
            assert bench.robot.value.cables[0].exit_point[0] == -0.37
            press("z")
            press("z", shift=True)
            assert bench.robot.value.cables[0].exit_point[0] == -0.37
            cell.value = "-0.3"  # typed, not yet taken: the browser's own undo has that
            press("z")
            assert bench.robot.value.cables[0].exit_point[0] == -0.37

    asyncio.run(look())


class _Pressed:
    """A key as the browser tells it."""

    def __init__(self, args):
        self.args = args

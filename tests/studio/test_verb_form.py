"""Forms of verbs: what is filled in becomes words of a command line, which its parser checks."""

from functools import partial
from typing import Annotated

import pytest
from cyclopts import App

from cdpr_drake.analyses.frame.words import one_of, words
from cdpr_drake.cli.call import shown_arguments
from cdpr_drake.cli.commands import COMMANDS
from cdpr_drake.cli.studio import NOT_OFFERED, verbs
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.verb_form import Verb, VerbForm
from tests.studio.pages import field, simulated

ROBOT = "acrobot_small"
ALL = verbs()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "link.yaml").symlink_to("/etc/hostname")
    return WorkingFolder(tmp_path)


def test_every_command_and_form_is_offered_with_its_options():
    forms = {f"{name} --{form}" for name, command in COMMANDS.items() for form in command.forms}
    assert ALL.keys() == ({*COMMANDS} | forms) - {*NOT_OFFERED}
    for name in ("workspace", "plan --free", "check"):
        names = [argument.name for argument in shown_arguments(*name.split())]
        assert [option.argument.name for option in ALL[name].options.values()] == names
    some = ("workspace", "tension", "import-log")
    assert [name for name in some if ALL[name].writes_folder] == ["workspace"]
    assert [name for name in some if ALL[name].needs_robot] == ["workspace", "tension"]


@pytest.mark.parametrize(
    ("name", "values", "line"),
    [
        ("workspace",
         {"robot": ROBOT, "kind": "static", "measure": "payload", "certify": True,
          "force": "2.5", "velocity": "0,0,1; 0,0,2", "grid": "", "pulleys": False},
         [f"--robot={ROBOT}", "--measure=payload", "--force=2.5", "--velocity=0,0,1",
          "--velocity=0,0,2", "--no-pulleys", "--certify"]),
        ("plan --free", {"robot": ROBOT, "from": "-0.1,0,0.3", "to": "0,0,0.4"},
         ["--free", f"--robot={ROBOT}", "--from=-0.1,0,0.3", "--to=0,0,0.4"]),
        ("simulate --seeds", {"seeds": "0:3", "set": "duration=1; robot=planar"},
         ["--set=duration=1", "--set=robot=planar", "--seeds=0:3"]),
        ("robots", {"suspended": "no"}, ["--not-suspended"]),
        ("check", {"files": "mine.yaml; b/c.yaml"}, ["--", "mine.yaml", "b/c.yaml"]),
    ],
)  # fmt: skip
def test_a_form_says_words_of_the_command_line(folder, name, values, line):
    assert ALL[name].words(values, folder) == [name.split()[0], *line]


@pytest.mark.parametrize(
    ("key", "value"),
    [("force", "much"), ("force", "nan"), ("force", "1e999"), ("rays", "1.5"), ("rays", "9" * 5000),
     ("obstacles", "../secret.yaml"), ("obstacles", "/etc/passwd"), ("obstacles", "link.yaml"),
     ("velocity", "0,0,1;/etc/passwd"), ("grid", "five"), ("method", "guess"), ("robot", "")],
)  # fmt: skip
def test_a_wrong_value_is_refused_for_its_field(folder, key, value):
    with pytest.raises(CdprError) as problem:
        ALL["workspace"].words({"robot": ROBOT, key: value}, folder)
    assert ALL["workspace"].field_of(str(problem.value)) == key
    assert "--help" not in str(problem.value)


@pytest.mark.parametrize(
    ("name", "word"),
    [("simulate", "--set=robot=../../mine.yaml"), ("workspace", "--out=x"),
     ("workspace", "--overwrite"), ("workspace", "--kind=a\x00b"), ("check", "/etc/passwd"),
     ("simulate", "--set=world={file: /etc/passwd}"), ("workspace", "--no-such=1")],
)  # fmt: skip
def test_words_that_no_form_makes_are_refused(folder, name, word):
    robot = [f"--robot={ROBOT}"] if ALL[name].needs_robot else []
    with pytest.raises(CdprError):
        ALL[name].accept([name, *robot, word], folder)


async def test_inputs_have_the_choices_and_defaults_of_the_declarations(folder):
    filled = {"workspace": {"kind": "static,closed", "robot": "mine.yaml"}}  # before

    def page():
        for name in ("workspace", "check"):
            VerbForm(ALL[name], filled, folder, ["mine.yaml"])

    async with simulated(page) as user:
        kind, method, scenario, rays, pulleys, robot = (
            field(user, f"workspace-{key}")
            for key in ("kind", "method", "scenario", "rays", "pulleys", "robot")
        )
        assert (kind.value, robot.value) == (["static"], "mine.yaml")
        assert "wrench-feasible" in kind.options
        assert "mine.yaml" in scenario.options
        assert "mine.yaml" not in method.options
        assert (rays.props["placeholder"], pulleys.value) == ("10000", True)
        for many in ("workspace-velocity", "check-files"):
            assert field(user, many).props["hint"].endswith("several by semicolons")


async def test_an_option_of_a_new_type_has_its_input_and_words_at_once(folder):
    """Its one entry are the words of its type."""

    def hue(word):
        return float(word.removeprefix("hue "))

    def verb(
        *, hue: Annotated[float, words(hue, "a hue, as hue 12", "HUE")] = 0.0,
        colours: Annotated[str, one_of(("red", "blue"))] = "red", far: bool = False,
    ):  # fmt: skip
        """Does it.

        Args:
            hue: Hue of it.
        """

    def parsed(line):
        app.parse_args(line[1:], exit_on_error=False, print_error=False)
        if "--colours=blue" in line:
            raise CdprError(f"{'' if '--far' in line else '--hue: '}never; see cdpr new --help")

    app, forms = App(), []
    app.default(verb)
    arguments = partial(app.assemble_argument_collection, parse_docstring=True)
    new = Verb("new", "", arguments, parsed)
    async with simulated(lambda: forms.append(VerbForm(new, {}, folder, []))) as user:
        hue, colours, far = (field(user, f"new-{key}") for key in ("hue", "colours", "far"))
        assert (hue.props["hint"], colours.options) == ("Hue of it", ["red", "blue"])
        hue.value, far.value = "hue 12", True
        assert await forms[0].words({}) == ["new", "--hue=hue 12", "--far"]
        for wrong in ("red", "r" * 5000):
            hue.value = wrong
            assert await forms[0].words({}) == []
            refusal = f"--hue: found '{wrong}'; accepted: a hue, as hue 12"
            assert hue.error == refusal[:400]
        hue.value, colours.value = "", "blue"
        with pytest.raises(CdprError, match=r"^never$"):  # no field can say it
            await forms[0].words({})
        far.value = False
        assert await forms[0].words({}) == []
        assert hue.error == "--hue: never"
        colours.value = "red"
        assert await forms[0].words({}) == ["new"]
        assert hue.error is None

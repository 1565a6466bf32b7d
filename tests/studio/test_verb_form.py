"""Forms of verbs: what is filled in becomes words of a command line, which its parser checks."""

from typing import Annotated

import pytest
from cyclopts import App

from cdpr_drake.analyses.frame.words import one_of, words
from cdpr_drake.cli.call import shown_arguments
from cdpr_drake.cli.commands import COMMANDS
from cdpr_drake.cli.studio import NOT_OFFERED, verbs
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.verb_form import FieldProblem, Verb
from tests.studio.pages import field, shown, simulated, until

ROBOT = "acrobot_small"


@pytest.fixture(scope="module")
def every():
    return verbs()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.yaml").touch()
    (tmp_path / "link.yaml").symlink_to("/etc/hostname")
    return WorkingFolder(tmp_path)


def test_every_command_and_form_is_offered_with_its_options(every):
    forms = {f"{name} --{form}" for name, command in COMMANDS.items() for form in command.forms}
    assert every.keys() == ({*COMMANDS} | forms) - {*NOT_OFFERED}
    for name in ("workspace", "plan --free", "check"):
        names = [argument.name for argument in shown_arguments(*name.split())]
        assert [option.name for option in every[name].options.values()] == names


def test_choices_and_defaults_are_those_of_the_declarations(every):
    options = every["workspace"].options
    assert {"static"} <= {*options["kind"].choices}
    assert (options["kind"].several, options["velocity"].many) == (True, True)
    assert (options["rays"].default, options["pulleys"].default) == ("10000", True)
    assert (options["scenario"].is_free, options["method"].is_free) == (True, False)
    assert (options["robot"].required, options["grid"].required) == (True, False)
    assert every["check"].options["files"].many
    assert [every[name].writes_folder for name in ("workspace", "tension", "import-log")] == [
        True, False, False,
    ]  # fmt: skip


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
def test_a_form_says_words_of_the_command_line(every, folder, name, values, line):
    assert every[name].words(values, folder) == [name.split()[0], *line]


@pytest.mark.parametrize(
    ("key", "value"),
    [("force", "much"), ("force", "nan"), ("force", "1e999"), ("rays", "1.5"), ("rays", "9" * 5000),
     ("obstacles", "../secret.yaml"), ("obstacles", "/etc/passwd"), ("obstacles", "link.yaml"),
     ("velocity", "0,0,1;/etc/passwd"), ("grid", "five"),
     ("method", "guess"), ("robot", "")],
)  # fmt: skip
def test_a_wrong_value_is_refused_at_its_field(every, folder, key, value):
    with pytest.raises(FieldProblem) as problem:
        every["workspace"].words({"robot": ROBOT, key: value}, folder)
    assert every["workspace"].field_of(str(problem.value)) == key
    assert len(str(problem.value)) <= 500


@pytest.mark.parametrize(
    "line",
    [["simulate", "--set=robot=../../mine.yaml"], ["workspace", f"--robot={ROBOT}", "--out=x"],
     ["workspace", f"--robot={ROBOT}", "--overwrite"], ["workspace", "--kind=a\nb"],
     ["check", "--", "/etc/passwd"], ["simulate", "--set=world={file: /etc/passwd}"],
     ["workspace", "--no-such=1"]],
)  # fmt: skip
def test_words_that_no_form_makes_are_refused(every, folder, line):
    with pytest.raises(FieldProblem):
        every[line[0]].accept(line, folder)


async def test_an_option_of_a_new_type_has_its_input_and_words_at_once(folder):
    """Its one entry are the words of its type."""

    def hue(word):
        if not word.endswith("deg"):
            raise ValueError(word)
        return float(word.removesuffix("deg"))

    def verb(
        *, hue: Annotated[float, words(hue, "a hue, as 12deg", "HUE")] = 0.0,
        colours: Annotated[str, one_of(("red", "blue"))] = "red", far: bool = False,
    ):  # fmt: skip
        """Does it.

        Args:
            hue: Hue of it.
        """

    app = App()
    app.default(verb)
    new = Verb(
        "new", "Does it.", lambda: app.assemble_argument_collection(parse_docstring=True),
        lambda line: app.parse_args(line[1:], exit_on_error=False, print_error=False),
    )  # fmt: skip
    filled, forms = {}, []

    def page():
        from cdpr_drake.studio.verb_form import VerbForm

        forms.append(VerbForm(new, filled, folder, []))

    async with simulated(page) as user:
        await until(lambda: shown(user, "new-hue"))
        assert field(user, "new-hue").props["hint"] == "Hue of it"
        assert field(user, "new-colours").options == ["red", "blue"]
        field(user, "new-hue").value = "12deg"
        field(user, "new-far").value = True
        assert await forms[0].words({}) == ["new", "--hue=12deg", "--far"]
        field(user, "new-hue").value = "12"
        with pytest.raises(FieldProblem):
            await forms[0].words({})
        assert field(user, "new-hue").error == "--hue: found '12'; accepted: a hue, as 12deg"


def test_a_verb_that_is_not_accepted_as_a_whole_says_so(folder):
    def refuse(line):
        raise CdprError(f"{line[0]}: never; see cdpr some --help")

    with pytest.raises(FieldProblem, match=r"^some: never$"):
        Verb("some", "", list, refuse).words({}, folder)

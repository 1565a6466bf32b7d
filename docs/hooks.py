"""What the site makes of the code: pages of commands, of rooms, of notebooks; equations.

Griffe, which reads docstrings for mkdocstrings, takes its extension from here, too.
"""

from __future__ import annotations

import ast
import base64
import hashlib
import html
import inspect
import json
import logging
import os
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name
from textwrap import indent
from typing import Any

import griffe
import latex2mathml.converter
import nbformat
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOKS = ROOT / "notebooks"
EXECUTED = ROOT / ".executed_notebooks"
"""Notebooks with their outputs, each under the hash of its source; tests leave them there."""

CELL_TIMEOUT = 7200
"""A cell that takes longer than this [s] hangs."""

LARGEST_HTML = 50_000
"""Outputs of more characters, such as a replay, are left to the notebook."""

ROOT_PAGES = {
    "architecture.md": "ARCHITECTURE.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
}
"""Pages that stand at the root of the project."""

NOTEBOOKS_PAGE = "notebooks/index.md"

HIDDEN_ROOMS = ("cdpr_drake.cli", "cdpr_drake.notebooks")
"""Packages that are no rooms of functions."""

SEARCH_DIALOG = 'data-md-component="search" role="dialog"'
"""How the theme opens its search; `on_post_page` gives it a name."""

RULE = re.compile(r"^\s*=+( +=+)+\s*$")
"""First, second and last line of a simple table of reStructuredText; its columns are below them."""

_LOG = logging.getLogger("mkdocs.hooks.cdpr_drake")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Equations become MathML, which browsers draw without a script; the rooms join the menu."""
    fences = {"name": "math", "class": "math", "format": display_math}
    config.mdx_configs.setdefault("pymdownx.superfences", {})["custom_fences"] = [fences]
    inline = {"name": "math", "class": "math", "format": inline_math}
    config.mdx_configs.setdefault("pymdownx.inlinehilite", {})["custom_inline"] = [inline]
    for item in config.nav or []:
        for title, pages in item.items():
            if title == "Reference":
                pages += room_menu()
            if title == "Notebooks":
                pages += [{heading(path): f"notebooks/{path.stem}.md"} for path in notebooks()]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages that are made, not written."""

    def add(uri: str, content: str | bytes) -> None:
        files.append(File.generated(config, uri, content=content))

    for page, source in ROOT_PAGES.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        add(page, text.replace("](docs/", "]("))
    add("reference/commands.md", commands_page())
    add("howto/examples.md", examples_page())
    for room in rooms():
        add(room_page(room), room_text(room))
    for path in notebooks():
        for uri, content in notebook_pages(path):
            add(uri, content)
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """In code of a table's row GitHub wants a bar with a backslash, which this site would show.

    The page of all notebooks lists them.
    """
    if page.file.src_uri == NOTEBOOKS_PAGE:
        markdown += "\n" + "".join(notebook_rows())
    lines = markdown.split("\n")
    for k, line in enumerate(lines):
        if line.startswith("|"):
            lines[k] = re.sub(r"`[^`]*`", lambda code: code[0].replace("\\|", "|"), line)
    return "\n".join(lines)


def on_page_content(content: str, **_: Any) -> str:
    """A picture that is no link shows itself: on a telephone a figure can be enlarged so."""
    parts = re.split(r"(<a\b.*?</a>)", content, flags=re.DOTALL)
    parts[::2] = [
        re.sub(r'<img\b[^>]*?\bsrc="([^"]+)"[^>]*>', r'<a href="\1">\g<0></a>', part)
        for part in parts[::2]
    ]
    return "".join(parts)


def on_post_page(output: str, **_: Any) -> str:
    """Material's search is a dialog without a name, which a screen reader cannot announce."""
    return output.replace(SEARCH_DIALOG, f'{SEARCH_DIALOG} aria-label="Search"')


def math(source: str, display: str) -> str:
    """LaTeX as MathML."""
    return str(latex2mathml.converter.convert(source.strip(), display=display))


def display_math(source: str, *_: Any, **__: Any) -> str:
    """A fenced block of LaTeX, a line each, as equations of their own."""
    lines = [line for line in source.strip().split("\n\n") if line.strip()]
    return "".join(f'<div class="equation">{math(line, "block")}</div>' for line in lines)


def inline_math(source: str, *_: Any, **__: Any) -> str:
    """LaTeX within a sentence."""
    return math(source, "inline")


def rooms() -> list[str]:
    """Packages with a face: what a user may import; each has a stub that names it."""
    stubs = (ROOT / "cdpr_drake").glob("*/__init__.pyi")
    found = [f"cdpr_drake.{stub.parent.name}" for stub in stubs]
    for top in ("models", "systems", "analyses"):
        for stub in (ROOT / top).rglob("*/__init__.pyi"):
            found.append(".".join(("cdpr_drake", *stub.parent.relative_to(ROOT).parts)))
    return ["cdpr_drake", *sorted({*found} - {*HIDDEN_ROOMS})]


def room_menu() -> list[dict[str, Any]]:
    """The rooms by the folder that they are in, by the part of their names that differs."""
    groups: dict[str, list[dict[str, str]]] = {}
    for room in rooms():
        name = room.removeprefix("cdpr_drake.")
        found = re.match(r"(analyses\.studies|models|systems|analyses)(\.|$)", name)
        group = found[1].rpartition(".")[2] if found else "library"
        title = name[found.end() :] if found else name
        groups.setdefault(group, []).append({title or name: room_page(room)})
    return [{group.capitalize(): pages} for group, pages in groups.items()]


def room_text(room: str) -> str:
    """A room's docstring, then its public names; what a room below it explains is a link."""
    below = {
        name: other
        for other in rooms()
        if room in ("cdpr_drake", "cdpr_drake.systems") and other.startswith(f"{room}.")
        for name in public_names(other).items()
    }
    title = re.sub(r"[._](?=\w)", r"\g<0><wbr>", room)  # a telephone breaks it there
    out = [f"# {title}\n\n::: {room}\n    options:\n      members: false\n"]
    for name, module in sorted(public_names(room).items()):
        if (name, module) in below:
            other = below[name, module]
            page = os.path.relpath(room_page(other), Path(room_page(room)).parent)
            anchor = f"{module}.{name}" if _stands_alone(module, name) else name.lower()
            out.append(f"\n## {name}\n\nSee [{other}]({page}#{anchor}).\n")
        elif _stands_alone(module, name):
            out.append(
                f"\n::: {module}.{name}\n    options:\n      show_root_heading: true\n"
                "      show_root_full_path: false\n      show_root_toc_entry: true\n"
            )
        else:
            out.append(f"\n## {name}\n\n{_words_of(module, name)}\n\nIn `{module}`.\n")
    return "".join(out)


def _words_of(module: str, name: str) -> str:
    """What a name stands for that no statement of its own binds: its value, or its docstring."""
    value = getattr(import_module(module), name)
    if isinstance(value, str):
        return f"`{value!r}`"
    return with_tables(inspect.getdoc(value) or "").replace("Args:\n", "Arguments:\n\n")


def public_names(room: str) -> dict[str, str]:
    """The names that a room's stub lists, and the modules that define them."""
    stub = ast.parse((_file_of(room) / "__init__.pyi").read_text(encoding="utf-8"))
    return {
        alias.name: f"{room}.{node.module}"
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def _file_of(module: str) -> Path:
    """Where a package, or a module without its ending, lies."""
    parts = module.split(".")[1:]
    top = ROOT if parts[:1] in (["models"], ["systems"], ["analyses"]) else ROOT / "cdpr_drake"
    return top.joinpath(*parts)


def _stands_alone(module: str, name: str) -> bool:
    """Whether a module binds a name by a statement of its own, which mkdocstrings can read."""
    path = _file_of(module).with_suffix(".py")
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", node)]
        if any(
            name in (getattr(each, "id", None), getattr(each, "name", None)) for each in targets
        ):
            return True
    return False


def room_page(room: str) -> str:
    """Where a room's page stands."""
    return f"reference/{room.removeprefix('cdpr_drake.').replace('.', '/')}.md"


def commands_page() -> str:
    """Every subcommand with its arguments and options, as its verb declares them."""
    from cdpr_drake.cli.call import shown_arguments
    from cdpr_drake.cli.commands import COMMANDS

    out = [
        "# Commands\n\nOutput of `cdpr COMMAND --help`. All commands have `--json`, which prints "
    ]
    out.append("the result as JSON, and `--plot [FIGURE=]FILE`, which draws it.\n")
    for name, command in COMMANDS.items():
        verb = resolve_name(command.verb)
        words = re.split(r"\n(?:Args|Raises):\n", inspect.cleandoc(verb.__doc__ or ""))[0]
        out.append(f"\n## cdpr {name}\n\n{words}\n")
        rows = [_argument_row(argument) for argument in shown_arguments(name)]
        if rows:
            out.append(
                "\n| argument or option | meaning |\n| --- | --- |\n" + "\n".join(rows) + "\n"
            )
        out.append("\n```text\n" + "\n".join(command.examples) + "\n```\n")
    return "".join(out)


def examples_page() -> str:
    """The example programs, as `cdpr examples` copies them."""
    out = [
        "# Examples\n\nShort programs to start from. `cdpr examples` lists them, `cdpr examples "
    ]
    out.append("NAME` copies one into the folder where you are, `cdpr examples all` all of them.\n")
    for path in sorted((NOTEBOOKS / "examples").glob("*.py")):
        source = path.read_text(encoding="utf-8")
        words = (ast.get_docstring(ast.parse(source)) or "").splitlines()[0]
        title, _, rest = words.partition(":")
        out.append(f"\n## {title}\n\n`{path.stem}`: {rest.strip() or words}\n")
        out.append(f"\n```python\n{source}```\n")
    return "".join(out)


def _argument_row(argument: Any) -> str:
    names = ", ".join(f"`{name}`" for name in argument.names)
    text = " ".join(html.escape(argument.parameter.help or "", quote=False).split())
    text = re.sub(r"([|\[\]*_])", r"\\\1", text)  # as it is printed, not as Markdown
    choices = argument.get_choices()
    if choices:
        text += f" One of {', '.join(f'`{choice}`' for choice in choices)}."
    default = argument.field_info.default
    words = argument.show_default(default) if callable(argument.show_default) else None
    return f"| {names} | {text}{f' Default: `{words}`.' if words else ''} |"


def notebooks() -> list[Path]:
    """The notebooks, the tour first."""
    return sorted(NOTEBOOKS.glob("*.ipynb"), key=lambda path: (path.stem != "tour", path.stem))


def notebook_rows() -> Iterator[str]:
    """A list of all notebooks, each with what it says first."""
    for path in notebooks():
        cells = nbformat.read(path, as_version=4).cells
        words = next(cell.source for cell in cells if cell.cell_type == "markdown")
        first = next(part for part in words.split("\n\n") if not part.startswith("#"))
        sentence = re.split(r"(?<=[.?:])\s", " ".join(first.split()))[0].rstrip(":")
        sentence += "" if sentence.endswith((".", "?")) else "."
        yield f"- [{heading(path)}]({path.stem}.md): {with_math(sentence)}\n"


def heading(path: Path) -> str:
    """First heading of a notebook."""
    for cell in nbformat.read(path, as_version=4).cells:
        for line in cell.source.splitlines():
            if line.startswith("# "):
                return str(line[2:])
    return path.stem


def executed(path: Path) -> Any:
    """A notebook with its outputs: those that a test left, or made now."""
    source = path.read_bytes()
    kept = EXECUTED / hashlib.sha256(source).hexdigest()[:16] / path.name
    if kept.is_file():
        return nbformat.read(kept, as_version=4)
    from nbclient import NotebookClient

    _LOG.info("running %s", path.name)
    notebook = nbformat.reads(source.decode(), as_version=4)
    kept.parent.mkdir(parents=True, exist_ok=True)
    resources = {"metadata": {"path": str(kept.parent)}}
    NotebookClient(notebook, timeout=CELL_TIMEOUT, resources=resources).execute()
    nbformat.write(notebook, kept)
    return notebook


def with_math(text: str) -> str:
    """A notebook's equations between dollars as the site's own."""
    text = re.sub(r"\$\$(.+?)\$\$", r"\n```math\n\1\n```\n", text, flags=re.DOTALL)
    return re.sub(r"\$(\S|\S[^$\n]*\S)\$", r"`#!math \1`", text)


def _joined(outputs: list[Any]) -> Iterator[Any]:
    """Outputs of a cell; what was printed in several pieces is one."""
    printed: list[Any] = []
    for output in outputs:
        if printed and output.get("output_type") == "stream" == printed[-1].get("output_type"):
            printed[-1]["text"] += output["text"]
        else:
            printed.append(output)
    yield from printed


def notebook_pages(path: Path) -> Iterator[tuple[str, str | bytes]]:
    """A notebook as a page and its pictures."""
    words, number = [], 0
    for cell in executed(path).cells:
        if cell.cell_type == "markdown":
            words.append(with_math(re.sub(r"\(([\w/]+)\.ipynb\)", r"(\1.md)", cell.source)))
        if cell.cell_type != "code":
            continue
        code = f"```python\n{cell.source}\n```"
        if cell.metadata.get("jupyter", {}).get("source_hidden"):
            code = '??? example "The cell"\n\n' + indent(code, "    ")
        words.append(code)
        for output in _joined(cell.get("outputs", [])):
            data = output.get("data", {})
            if "image/png" in data:
                name = f"{path.stem}_{number}.png"
                number += 1
                yield f"notebooks/{name}", base64.b64decode(data["image/png"])
                words.append(f"![Output of the cell above]({name})")
            elif len(data.get("text/html", "")) > LARGEST_HTML:
                words.append("*(An interactive page: run the notebook to see it.)*")
            elif "text/html" in data:
                words.append(f"<div class='output'>{data['text/html']}</div>")
            else:
                text = output.get("text") or data.get("text/plain", "")
                words.append(f"<pre class='output'>{html.escape(text)}</pre>")
    words.append(
        f"\n*`cdpr notebooks DIR` copies this notebook, {path.name}, to a folder of yours.*"
    )
    yield f"notebooks/{path.stem}.md", "\n\n".join(words) + "\n"


class Docstrings(griffe.Extension):
    """Rewrites the docstrings that it is shown."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Of every module, class and function."""
        if obj.is_class:
            rows = field_rows(obj)  # type: ignore[arg-type]
            if rows:
                words = "" if obj.docstring is None else obj.docstring.value
                obj.docstring = griffe.Docstring(f"{words}\n\n{rows}", parent=obj)
        if obj.docstring is not None:
            obj.docstring.value = with_tables(obj.docstring.value)


def with_tables(text: str) -> str:
    """Simple tables of reStructuredText as tables of Markdown."""
    if "=====" not in text:
        return text
    out, lines = [], text.splitlines()
    while lines:
        line = lines.pop(0)
        if not RULE.match(line):
            out.append(line)
            continue
        rules = [k for k, one in enumerate(lines) if RULE.match(one)]
        starts = [match.start() for match in re.finditer("=+", line)]
        rows = [_cells(one, starts) for one in lines[: rules[1]] if not RULE.match(one)]
        out += ["", *_table(rows), ""]
        del lines[: rules[1] + 1]
    return "\n".join(out)


def _cells(line: str, starts: list[int]) -> list[str]:
    return [line[a:b].strip() for a, b in zip(starts, [*starts[1:], None], strict=True)]


def _table(rows: list[list[str]]) -> list[str]:
    """The first row is the head; a row that begins empty goes on with the one before."""
    whole: list[list[str]] = []
    for row in rows:
        if row[0] or not whole:
            whole.append(row)
        elif any(row):
            whole[-1] = [f"{a} {b}".strip() for a, b in zip(whole[-1], row, strict=True)]
    lines = ["| " + " | ".join(_quoted(cell) for cell in row) + " |" for row in whole]
    return [lines[0], "|" + " --- |" * len(whole[0]), *lines[1:]]


def _quoted(cell: str) -> str:
    """Words of a cell, of which only backticks mean something."""
    parts = re.split(r"(`[^`]*`)", cell)
    parts[::2] = [re.sub(r"([\\*_|<\[])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


def field_rows(schema: griffe.Class) -> str:
    """A table of the fields of a schema's section: name, unit, meaning; empty: it is none."""
    rows = []
    for name, member in schema.members.items():
        value = getattr(member, "value", None)
        if member.is_alias or value is None or name.startswith("_"):
            continue
        call = ast.parse(str(value).strip(), mode="eval").body
        if not isinstance(call, ast.Call) or not call.args:
            continue
        first = call.args[0]
        if isinstance(first, ast.Constant) and isinstance(first.value, str):
            rows.append(f"| `{name}` | {_unit(call)} | {_quoted(first.value)} |")
    return "" if not rows else "| field | unit | meaning |\n| --- | --- | --- |\n" + "\n".join(rows)


def _unit(call: ast.Call) -> str:
    """The unit that a field of a schema is given, as its second argument or by name."""
    named = {one.arg: one.value for one in call.keywords}
    if getattr(call.func, "id", "") in ("number", "array", "named_numbers"):
        named.setdefault("unit", call.args[1] if len(call.args) > 1 else ast.Constant(""))
    unit = named.get("unit")
    return _quoted(str(unit.value)) if isinstance(unit, ast.Constant) else ""


if __name__ == "__main__":
    print(json.dumps(rooms(), indent=1))

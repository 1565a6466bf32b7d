"""The README of an imported robot: what came from its file, what was assumed, what was not kept."""

from __future__ import annotations

from cdpr_drake.formats.assumptions import CompletedDraft


def import_readme(name: str, source: str, tool: str, completed: CompletedDraft) -> str:
    """The README, as Markdown.

    Args:
        name: Name of the robot or mechanism.
        source: Name of the file that it came from.
        tool: The format of that file, in words.
        completed: What the file gave and lacked.
    """
    given = [f"- `{key}`" for key in completed.given]
    assumed = [f"| `{key}` | {words} |" for key, words in completed.assumed.items()]
    remarks = [f"- {words}" for words in completed.remarks] or ["- nothing"]
    return "\n".join(
        [
            f"# {name}", "", f"Imported from `{source}` ({tool}).",
            "", "## From the file", "", *given, "", "## Assumed, for the file lacks it", "",
            "| key | value |", "| --- | --- |", *assumed, "", "## Read otherwise or not kept",
            "", *remarks, "",
        ]
    )  # fmt: skip

"""The page "The result": stages and report keys of each verb, read from the Returns sections of their docstrings."""

from __future__ import annotations

import inspect
import re

from api import as_markdown, find, read_parameters

import texrs

NOTICE = "% Made by docs/results.py.\n\n"
VERBS = (
    "design", "design_variants", "tile", "inpaint", "splice", "self_splice", "synthesize", "solid", "perspective", "rectify",
    "remove", "extend", "PlaneTexture.window", "CornerTiles.window",
)  # fmt: skip
"""Functions that return a `Synthesis`. `SolidTexture.window` is the method of `PlaneTexture`."""
COMMON = {
    "ignored": "Parts of the input that were not used, one sentence each. Only if there are any.",
    "assumed": "Facts about the input that it does not state, one sentence each. Only if there are any.",
    "maps": "Role of each map, by its name. Only for a `texrs.Material`.",
    "palette": "Number of colours that were kept. Only if the input has a palette or few colours.",
}
"""Keys that the report of any verb may contain."""
MATERIAL_STAGES = {
    "guide": "All maps of the material as one image, which was used to choose places. Only for a `texrs.Material`."
}
ITEM = re.compile(r"^- ``([^`]+)``: ?(.*)$")
Entries = dict[str, str]


def read_returns(name: str) -> tuple[Entries, Entries]:
    """Return the stages and report keys in a docstring, and in the docstring of a function that it refers to."""
    lines = (inspect.getdoc(find(f"texrs.{name}")) or "").splitlines()
    start = lines.index("Returns") + 2 if "Returns" in lines else lines.index("Yields") + 2
    end = next((i for i in range(start, len(lines) - 1) if lines[i + 1] and not lines[i + 1].strip("-")), len(lines))
    text = [line.strip() for line in lines[start:end]]
    found: dict[str, Entries] = {"Stages": {}, "Report": {}}
    if other := re.search(r"\bas (?:of|in) `(\w+)`", " ".join(text)):
        found["Stages"], found["Report"] = read_returns(other.group(1))
        for name in re.findall(r"without ``(\w+)``", " ".join(text)):
            found["Report"].pop(name)
    section, key = "", ""
    for line in text:
        if line in ("Stages:", "Report:"):
            section, key = line[:-1], ""
        elif item := ITEM.match(line):
            key = item.group(1)
            found[section][key] = item.group(2)
        elif line and key:
            found[section][key] += f" {line}"
        elif not line:
            key = ""
    return found["Stages"], found["Report"]


def make_results() -> str:
    """Return the page of results."""
    text = f"{NOTICE}# The result\n\n"
    text += (
        "Every verb returns a {py:obj}`texrs.Synthesis`: the image, the source map, images of the stages, and a report\n"
        "of decisions and measurements. `result.report` contains JSON types only. On the command line, `--stages FOLDER`\n"
        "writes all stages and the report, and `texrs info FILE` prints how a file was made.\n\n"
    )
    text += "| attribute | contents |\n|---|---|\n"
    for name, kind, about in read_parameters(texrs.Synthesis):
        text += f"| `{name}` | {as_markdown(about)} ({as_markdown(kind)}) |\n"
    text += "\n## Keys of any report\n\n" + tabulate("key", COMMON)
    text += "\n## Stage of any material\n\n" + tabulate("stage", MATERIAL_STAGES)
    for name in VERBS:
        stages, report = read_returns(name)
        text += f"\n## {name}\n\n{{py:obj}}`texrs.{name}`\n\n"
        text += tabulate("stage", stages) + "\n" + tabulate("report key", report)
    return text


def tabulate(head: str, entries: Entries) -> str:
    """Return a table of names and their meanings."""
    rows = "".join(f"| `{name}` | {as_markdown(about)} |\n" for name, about in entries.items())
    return f"| {head} | contents |\n|---|---|\n{rows}"

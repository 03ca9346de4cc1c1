"""Pages that are generated from the code: commands, API, results, messages, performance, comparison and glossary."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

from api import write_api, write_tables
from messages import make_messages
from results import make_results

import texrs

NOTICE = "% Made by docs/pages.py.\n\n"


def write_pages(docs: Path) -> None:
    """Write all generated pages to the folder ``generated``."""
    out = docs / "generated"
    for each in ("api", "parameters", "results.md", "messages.md", "commands.md", "performance.md", "words.md"):
        if (out / each).is_dir():
            shutil.rmtree(out / each)
    (out / "api").mkdir(parents=True, exist_ok=True)
    write_api(out / "api")
    write_tables(out / "parameters")
    (out / "results.md").write_text(make_results(), encoding="utf-8")
    (out / "messages.md").write_text(make_messages(Path(texrs.__file__).parent), encoding="utf-8")
    (out / "commands.md").write_text(list_commands(), encoding="utf-8")
    (out / "performance.md").write_text(list_benches(docs.parent / "benches"), encoding="utf-8")
    (out / "install.md").write_text(tabulate_installs(docs / "install.json"), encoding="utf-8")
    write_comparison(out)
    (out / "words.md").write_text(list_words(docs.parent / "ARCHITECTURE.md"), encoding="utf-8")


# --- commands --------------------------------------------------------------------------------------------------------


def list_commands() -> str:
    """Return the page of all commands, with the help text of each."""
    import typer

    from texrs.cli import GROUPS, app, make_command

    group: Any = typer.main.get_command(app)
    wide = {"resilient_parsing": True, "terminal_width": 100, "max_content_width": 100}
    top = group.make_context("texrs", [], **wide)
    text = f"{NOTICE}# Commands\n\nThis page contains the output of `texrs COMMAND --help` for each command.\n\n"
    for title, commands in GROUPS.items():
        text += f"## {title}\n\n"
        for name, short in commands.items():
            command = make_command(name)
            said = command.get_help(command.make_context(name, [], parent=top, **wide))
            text += f"### texrs {name}\n\n{short}\n\n```text\n{said}\n```\n\n"
    return text


# --- words -----------------------------------------------------------------------------------------------------------


def list_words(architecture: Path) -> str:
    """Return the page with the glossary of ARCHITECTURE.md."""
    table = architecture.read_text(encoding="utf-8").partition("## Glossary")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.+?) \| (.+?) \|$", table, re.MULTILINE)[1:]
    words = "".join(f"{word}\n  {meaning}\n\n" for word, meaning in sorted(rows, key=lambda row: row[0].lower()))
    intro = "The terms of the interface, of messages and of the code. Each term has one meaning."
    return f"{NOTICE}# Glossary\n\n{intro}\n\n```{{glossary}}\n{words.rstrip()}\n```\n"


# --- comparison ------------------------------------------------------------------------------------------------------

COMPARED = """
This page compares texrs with other programs in three tasks, for ten images with a side of {side} pixels. It includes
the programs that were installed when the page was generated. <a href="../shown/comparison.html">The page of the
comparison</a> shows all images. This command writes it:

```sh
texrs compare -o comparison.html
```

This command compares your own images in one task, and gives the path of a program that is not found automatically:

```text
texrs compare stones.jpg bark.jpg --task more --program embark=PATH -o comparison.html
```

Lower values are better, and 0 is the value of the example itself. The best value of each column is bold. Trivial
methods, such as copies, are listed only for comparison. The measures do not replace looking at the images: a texture
with torn elements can have good values.
"""


def write_comparison(out: Path) -> None:
    """Compare methods on built-in images, and write a page with the means and a page with the images.

    If both pages are newer than the package, they are kept.
    """
    from texrs import samples
    from texrs.cli._compare import USUAL
    from texrs.comparison import TASKS, compare
    from texrs.comparison._page import explain, tabulate

    page, shown = out / "comparison.md", out / "extra" / "shown" / "comparison.html"
    newest = max(
        file.stat().st_mtime for file in Path(texrs.__file__).parent.rglob("*") if file.suffix in (".py", ".so")
    )
    if shown.exists() and page.exists() and shown.stat().st_mtime > newest:
        return
    shown.parent.mkdir(parents=True, exist_ok=True)
    side = 96
    found = compare({name: samples.load(name).image for name in USUAL}, side=side)
    text = f"{NOTICE}# Compared with others\n{COMPARED.format(side=side)}\n```{{raw}} html\n{explain(True)}\n```\n"
    for task, about in TASKS.items():
        some = [r for r in found.results if r.task == task]
        text += f"\n## {about.title}\n\n{about.lead}\n\n```{{raw}} html\n{tabulate(some, True)}\n```\n"
    text += (
        "\n## Not installed\n\nMethods that were not installed when the page was generated, and how to get them:\n\n"
    )
    text += "".join(f"- {each.method} ({TASKS[each.task].title.lower()}): {each.get}\n" for each in found.missing)
    page.write_text(text, encoding="utf-8")
    shown.write_text(found.page(), encoding="utf-8")


# --- installation ----------------------------------------------------------------------------------------------------

INSTALLED = """
## Size and time of the installation

`benches/install_table.py` measured these numbers on {date}, in an empty environment of Python {python} and with a
wheel of {wheel} MB. Times are processor seconds. Sizes are the growth of the environment.

| | packages | MB | installation, s | first image, s | first image |
|---|---|---|---|---|---|
{rows}
"""


def tabulate_installs(file: Path) -> str:
    """Return a table of the sizes and times of installations, or an empty text if they were not measured."""
    import json

    if not file.exists():
        return ""
    found = json.loads(file.read_text(encoding="utf-8"))
    rows = []
    for name, each in found.pop("rows").items():
        figures = [str(each.get(key, "")) for key in ("packages", "megabytes", "install", "picture")]
        rows.append(f"| {name} | {' | '.join(figures)} | {each.get('wrong', each['shows'])} |")
    return INSTALLED.format(rows="\n".join(rows), **found)


# --- performance -----------------------------------------------------------------------------------------------------

MEASURED = """
All numbers on this page come from commands. Times depend on the processor, on its load, and on the image. The
processor seconds of each method for ten images are in [the comparison](comparison.md).
`texrs compare photo.jpg -o compared.html` measures them for your own image.
{peers}
## The commands

These commands run in a checkout of the sources, and each prints a table. Most of them interleave rounds and report
medians, because a mean depends on the other load of the machine. `make bench-kernels` measures only the kernels in
Rust, and `make bench-guard` counts the instructions of eight kernels.
"""


PEERS = """
## Compared with other programs

`make bench` measured these numbers on {date}: {processor}, {cores} cores, {system}, Python {python}, at a load of
{load:.0f}. The results of all programs were compared before the times were measured.

| column | contents |
|---|---|
| work | the task, and how the results were compared |
| ms | processor milliseconds in one thread: the median of {rounds} interleaved rounds |
| spread | the smallest and the largest time. *published*: measured by others on other hardware, as the paper states |
| ratio | time divided by the time of texrs |
| target | the ratio, time or memory that was required before the measurement; *not reached* if it was missed |
| MB | memory of the work, without the memory of the loaded program and its input |

The row *floor* is the time to copy the input once. If numbers of threads are compared, ms is the smallest elapsed
time, because a busy machine may have no free second core.

| work | program | ms | spread | ratio | target | MB |
|---|---|---|---|---|---|---|
{rows}
"""


def tabulate_peers(file: Path) -> str:
    """Return a table of the comparison with other programs, or an empty text if it was not measured."""
    import json

    if not file.exists():
        return ""
    found = json.loads(file.read_text(encoding="utf-8"))
    rows = []
    for case in found["cases"]:
        said = f"**{case['case']}**{' (elapsed time)' if case['wall'] else ''}: {case['check']}"
        for each in case["rows"]:
            own = each is case["rows"][0]
            asked = f"at most {case['most_ms']:g} ms" if own and case["most_ms"] else ""
            missed = own and each["ms"] > (case["most_ms"] or float("inf"))
            if own and case["most_mb"]:
                asked += f"{', ' * bool(asked)}at most {case['most_mb']:g} MB"
                missed = missed or each["megabytes"] > case["most_mb"]
            if each["asked"]:
                asked, missed = f"{each['asked']:g}", each["ratio"] < each["asked"]
            if each.get("published"):
                figures = (_figure(each["ms"]), "*published*")
            else:
                figures = (_figure(each["ms"]), f"{_figure(each['least'])} to {_figure(each['most'])}")
            who = each["who"] + (f", {case['shown']} {each['shown']:g}" if case["shown"] and "shown" in each else "")
            asked += ", *not reached*" * missed
            size = f"{each['megabytes']:.0f}" if "megabytes" in each else ""
            rows.append(f"| {said} | {who} | {' | '.join(figures)} | {_figure(each['ratio'])} | {asked} | {size} |")
            said = ""
        for each in case["absent"]:
            rows.append(f"| | {each['who']} | not installed: {each['get']} | | | {each['asked'] or ''} | |")
        rows.append(f"| | *floor* | {_figure(case['floor'])} | | | | |")
    return PEERS.format(rows="\n".join(rows), rounds=found["rounds"], **found["machine"])


def _figure(ms: float) -> str:
    """Return milliseconds to three digits, without an exponent."""
    return f"{ms:.0f}" if ms >= 100 else f"{ms:.3g}"


def list_benches(folder: Path) -> str:
    """Return the page of performance: for each bench its command, and the first line of its docstring."""
    import ast

    text = f"{NOTICE}# Performance\n{MEASURED.format(peers=tabulate_peers(folder / 'peers.json'))}\n"
    groups = {"Speed": "_speed", "Other measurements": ""}
    files = sorted(folder.glob("*.py"))
    for title, ending in groups.items():
        some = [file for file in files if file.stem.endswith(ending)]
        files = [file for file in files if file not in some]
        rows = []
        for file in some:
            said = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
            # A file whose docstring does not name its own command is a helper.
            if f"benches/{file.name}" in said:
                rows.append(f"| `python benches/{file.name}` | {said.splitlines()[0]} |")
        text += f"### {title}\n\n| command | measurement |\n|---|---|\n" + "\n".join(rows) + "\n\n"
    return text

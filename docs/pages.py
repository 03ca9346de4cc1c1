"""Pages that are made from the code: the commands by their parsers, the words of ARCHITECTURE.md."""

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
    """Write all such pages anew, to the folder ``generated``."""
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
    """Return what each command says of itself."""
    import typer

    from texrs.cli import GROUPS, app, make_command

    group: Any = typer.main.get_command(app)
    wide = {"resilient_parsing": True, "terminal_width": 100, "max_content_width": 100}
    top = group.make_context("texrs", [], **wide)
    text = f"{NOTICE}# Commands\n\nWhat `texrs COMMAND --help` says.\n\n"
    for title, commands in GROUPS.items():
        text += f"## {title}\n\n"
        for name, short in commands.items():
            command = make_command(name)
            said = command.get_help(command.make_context(name, [], parent=top, **wide))
            text += f"### texrs {name}\n\n{short}\n\n```text\n{said}\n```\n\n"
    return text


# --- words -----------------------------------------------------------------------------------------------------------


def list_words(architecture: Path) -> str:
    """Return the glossary of ARCHITECTURE.md."""
    table = architecture.read_text(encoding="utf-8").partition("## The words")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.+?) \| (.+?) \|$", table, re.MULTILINE)[1:]
    words = "".join(f"{word}\n  {meaning}\n\n" for word, meaning in sorted(rows, key=lambda row: row[0].lower()))
    intro = "The words of the interface, of messages and of the code, each with one meaning."
    return f"{NOTICE}# Glossary\n\n{intro}\n\n```{{glossary}}\n{words.rstrip()}\n```\n"


# --- comparison ------------------------------------------------------------------------------------------------------

COMPARED = """
Each of ten pictures, of {side} pixels a side, by what texrs has for three tasks, and by what others have that is installed
where this page was made. The pictures stand in <a href="../shown/comparison.html">the page of the comparison</a>, which this
command writes:

```sh
texrs compare -o comparison.html
```

Your own pictures, one task, and programs that are not found by themselves:

```text
texrs compare stones.jpg bark.jpg --task more --program embark=PATH -o comparison.html
```

Of every figure less is better, 0 is what the example has itself, and the best of each column is bold; what costs nothing stands
there for comparison alone. Figures see some of what eyes see: a texture in which things are torn may have good ones.
"""


def write_comparison(out: Path) -> None:
    """Compare methods on built-in pictures: the means in a page of the documentation, the pictures in one of their own.

    Nothing is compared again while the package is as it was.
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
    text += "\n## Not here\n\nWhat was not installed, and how to get it:\n\n"
    text += "".join(f"- {each.method} ({TASKS[each.task].title.lower()}): {each.get}\n" for each in found.missing)
    page.write_text(text, encoding="utf-8")
    shown.write_text(found.page(), encoding="utf-8")


# --- installation ----------------------------------------------------------------------------------------------------

INSTALLED = """
## What it takes

From an empty environment of Python {python} to a first picture, as `benches/install_table.py` measured on {date} with a wheel
of {wheel} MB: seconds of the processor, and what the environment takes beyond an empty one.

| | packages | MB | to install, s | first picture, s | which shows |
|---|---|---|---|---|---|
{rows}
"""


def tabulate_installs(file: Path) -> str:
    """Return a table of what installations take, or nothing where nothing was measured."""
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
No figure stands here that a command did not give: times hang on the processor, on what else it does, and on the picture. How
long each method took on ten pictures, in processor seconds, says [the comparison](comparison.md); for yours, it is said by
`texrs compare photo.jpg -o compared.html`.
{peers}
## The commands

What is measured, and by which command, from a checkout of the sources. Each prints a table; most interleave rounds and take
medians, since a machine that does other things shows in the mean. `make bench-kernels` measures the kernels in Rust alone, and
`make bench-guard` counts the instructions of eight of them.
"""


PEERS = """
## Beside others

What `make bench` wrote: {processor}, {cores} cores, {system}, Python {python}, {date}, while the machine did {load:.0f} things
at once. Milliseconds of the processor, in one thread, the median of {rounds} rounds in which all took turns, and the least and
the most; how many times as long as texrs, and how many were asked for before that was measured (*not reached* where it fell
short); megabytes that the work took beyond what was there when all was ready. Results were compared first, as it says.
The floor is what copying what is given once takes. What is *published* was measured by others, on other hardware, as their
paper says. Where threads are compared, the least time that passed counts; a busy machine has no second core to give.

| work | who | ms | spread | ratio | asked | MB |
|---|---|---|---|---|---|---|
{rows}
"""


def tabulate_peers(file: Path) -> str:
    """Return a table of what was measured, or nothing where nothing was."""
    import json

    if not file.exists():
        return ""
    found = json.loads(file.read_text(encoding="utf-8"))
    rows = []
    for case in found["cases"]:
        said = f"**{case['case']}**{' (time that passes)' if case['wall'] else ''}: {case['check']}"
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
            rows.append(f"| | {each['who']} | not here: {each['get']} | | | {each['asked'] or ''} | |")
        rows.append(f"| | *floor* | {_figure(case['floor'])} | | | | |")
    return PEERS.format(rows="\n".join(rows), rounds=found["rounds"], **found["machine"])


def _figure(ms: float) -> str:
    """Return milliseconds to three digits, without an exponent."""
    return f"{ms:.0f}" if ms >= 100 else f"{ms:.3g}"


def list_benches(folder: Path) -> str:
    """Return a page of what each bench measures, as its own first words say it."""
    import ast

    text = f"{NOTICE}# Performance\n{MEASURED.format(peers=tabulate_peers(folder / 'peers.json'))}\n"
    groups = {"How fast": "_speed", "Beside others": "_vs_peers", "How well": ""}
    files = sorted(folder.glob("*.py"))
    for title, ending in groups.items():
        some = [file for file in files if file.stem.endswith(ending)]
        files = [file for file in files if file not in some]
        rows = []
        for file in some:
            said = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
            # What is no command is a helper of those that are.
            if f"benches/{file.name}" in said:
                rows.append(f"| `python benches/{file.name}` | {said.splitlines()[0]} |")
        text += f"### {title}\n\n| command | what it measures |\n|---|---|\n" + "\n".join(rows) + "\n\n"
    return text

"""The reference of the Python functions: a page for each, grouped by task, and tables of the parameters of the verbs."""

from __future__ import annotations

import enum
import inspect
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import texrs

NOTICE = "% Made by docs/api.py.\n\n"


@dataclass(frozen=True)
class Task:
    """A group of the reference: names of `texrs` itself, and modules whose names belong to it."""

    title: str
    guides: tuple[str, ...]
    names: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()


TASKS = (
    Task(
        "Make a texture larger",
        ("design", "field"),
        ("design", "design_variants", "synthesize", "DeformationOptions", "Constraints", "Guide"),
    ),
    Task("Make a photograph tileable", ("tile",), ("tile", "check_tiling", "Tiling")),
    Task(
        "Put elements into another layout",
        ("splice",),
        ("splice", "self_splice", "ElementAnalysis", "TextureDatabase"),
        ("elements", "layouts"),
    ),
    Task("Fill holes", ("inpaint",), ("inpaint", "blend", "Mask")),
    Task(
        "Photographs of planes",
        ("rectify", "remove", "extend", "perspective"),
        ("rectify", "remove", "extend", "perspective", "Plane", "PlaneView"),
        ("planes", "scale_maps"),
    ),
    Task("Volumes", ("solid", "microstructure"), ("solid",), ("volume",)),
    Task("Fields", ("field",), (), ("fields",)),
    Task("Larger than memory", ("large",), ("SolidTexture", "PlaneTexture", "CornerTiles"), ("stores",)),
    Task("Meshes", ("mesh",), (), ("painting",)),
    Task("Materials", ("materials", "source-map"), ("Material", "apply"), ("materials",)),
    Task("Examples and their elements", ("design", "samples"), ("Exemplar", "ElementOptions"), ("exemplar", "samples")),
    Task(
        "Results and their quality",
        ("source-map",),
        ("Synthesis", "SourceMap", "RenderOptions", "CopyStatistics", "ResultList"),
        ("metrics",),
    ),
    Task("Images to train on", ("augment",), (), ("transforms",)),
    Task("Files", ("files",), (), ("io",)),
    Task("Limits, threads and errors", ("batch",), ("threads",), ("limits", "errors")),
    Task("Kernels", (), (), ("kernels",)),
)


def list_modules() -> list[ModuleType]:
    """Return the public modules, by name."""
    found, left = [], [texrs]
    while left:
        module = left.pop()
        found.append(module)
        left += [m for n in module.__all__ if isinstance(m := getattr(module, n), ModuleType)]
    return sorted(found, key=lambda m: m.__name__)


def list_names(task: Task) -> dict[str, list[str]]:
    """Return the full names of the functions and classes of a task by module, first those of texrs itself."""
    found = {"": [f"texrs.{name}" for name in task.names]}
    for module in list_modules():
        path = module.__name__
        if path.split(".")[1:2] and path.split(".")[1] in task.modules:
            # Skip names that texrs itself exports, because they are listed there.
            values = [(n, getattr(module, n)) for n in module.__all__ if not n.startswith("_")]
            own = [n for n, v in values if is_described(v) and getattr(texrs, n, None) is not v]
            found[path] = [f"{path}.{n}" for n in own]
    return found


def is_described(value: object) -> bool:
    """Return whether a value is a function or a class, which have a page each."""
    return not isinstance(value, ModuleType) and (inspect.isroutine(value) or inspect.isclass(value))


def find(name: str) -> Any:
    """Return the object with a full name."""
    value: Any = texrs
    for part in name.split(".")[1:]:
        value = getattr(value, part)
    return value


def check_tasks() -> list[str]:
    """Return a message for each public name that is in no task or in several tasks."""
    listed = [name for task in TASKS for names in list_names(task).values() for name in names]
    public = [f"texrs.{n}" for n in texrs.__all__ if is_described(getattr(texrs, n))]
    modules = [m for n in texrs.__all__ if isinstance(m := getattr(texrs, n), ModuleType)]
    owned = [f"texrs.{m}" for task in TASKS for m in task.modules]
    wrong = [f"{name} is in {listed.count(name)} tasks" for name in public if listed.count(name) != 1]
    wrong += [f"{m.__name__} is in no task" for m in modules if m.__name__ not in owned]
    return wrong


def write_api(folder: Path) -> None:
    """Write a page for each function and class, one for each task, and one that lists the tasks."""
    wrong = check_tasks()
    assert not wrong, f"docs/api.py: {'; '.join(wrong)}"
    text, slugs = "", []
    for task in TASKS:
        slug = make_slug(task.title)
        slugs.append(slug)
        groups = list_names(task)
        (folder / f"{slug}.rst").write_text(make_group(task, groups), encoding="utf-8")
        for name in (n for names in groups.values() for n in names):
            (folder / f"{name}.rst").write_text(make_page(name), encoding="utf-8")
        some = [n for names in groups.values() for n in names]
        shown = ", ".join(f"[{n.rpartition('.')[2]}]({n}.rst)" for n in some[:6])
        text += f"- **[{task.title}]({slug}.rst)**: {shown}{' ...' if len(some) > 6 else ''}\n"
    lead = (
        "Each public function and class has a page. The pages are grouped by task. [The result](../results.md) describes\n"
        "what all verbs return, and [Conventions](../../conventions.md) the order of axes, sizes and types. The kernels in\n"
        'Rust have <a href="../../rust/texrs/index.html">a reference of their own</a>.'
    )
    toctree = "\n\n```{toctree}\n:hidden:\n\n" + "\n".join(slugs) + "\n```\n"
    (folder / "index.md").write_text(f"{NOTICE}# API reference\n\n{lead}\n\n{text}{toctree}", encoding="utf-8")


def make_slug(title: str) -> str:
    """Return the name of a task's file."""
    return "task-" + re.sub("[^a-z]+", "-", title.lower())


def make_group(task: Task, groups: dict[str, list[str]]) -> str:
    """Return the page of a task: its guides, its modules, and a table of its functions and classes."""
    lines = [task.title, "=" * len(task.title), ""]
    if task.guides:
        lines += ["Guides: " + ", ".join(f":doc:`/guides/{guide}`" for guide in task.guides) + ".", ""]
    for module, names in groups.items():
        if module:
            lines += [module, "-" * len(module), "", f".. automodule:: {module}", "   :no-members:", ""]
        if names:
            lines += [".. list-table::", "   :widths: 30 70", "   :class: names", ""]
        for name in names:
            short = name.removeprefix("texrs.")
            lines += [f"   * - :py:obj:`{short} <{name}>`", f"     - {take_summary(find(name))}"]
        lines += [""]
    every = [name for names in groups.values() for name in names]
    lines += [".. toctree::", "   :hidden:", "", *(f"   {n.removeprefix('texrs.')} <{n}>" for n in every), ""]
    return "\n".join(lines)


def make_page(name: str) -> str:
    """Return the page of a function or class."""
    value = find(name)
    lines = [name, "=" * len(name), ""]
    lines += [f".. autoclass:: {name}", "   :members:"] if inspect.isclass(value) else [f".. autofunction:: {name}"]
    return "\n".join([*lines, ""])


def take_summary(value: object) -> str:
    """Return the first paragraph of a docstring."""
    text = (inspect.getdoc(value) or "").partition("\n\n")[0]
    # Drop marks of references, because the table does not contain the list of references.
    return re.sub(r"\s*\[\d+\]_", "", " ".join(text.split()))


# --- tables of parameters --------------------------------------------------------------------------------------------

UNITS = ("pixels", "voxels", "degrees", "radians", "seconds", "bytes", "tiles", "share")
NUMBER = r"-?\d+(?:\.\d+)?(?:\^-?\d+|e-?\d+)?(?: ?%)?"
RANGE = re.compile(
    rf"{NUMBER} to (?:{NUMBER}(?: - 1)?|the [^,;.]*|half [^,;.]*)|at (?:least|most) {NUMBER}"
    rf"|{NUMBER} or (?:more|less|larger|fewer)|(?:above|below) {NUMBER}|within [(\[][^)\]]*[)\]]"
)
USUAL = re.compile(r"[;,] (?:None: )?([^;,:]+ by default|(?<=None: )[^;.]+)\.?$")
SENTENCE = re.compile(r"(?<=[.])\s+(?=[A-Z\"`])")
TABLES: dict[str, tuple[str, ...]] = {
    "design": ("design", "DeformationOptions", "ElementOptions"),
    "tile": ("tile", "check_tiling"),
    "inpaint": ("inpaint", "Mask"),
    "splice": ("splice", "self_splice"),
    "perspective": ("perspective",),
    "rectify": ("rectify", "PlaneView"),
    "remove": ("remove",),
    "extend": ("extend",),
    "solid": ("solid",),
    "field": ("synthesize", "Constraints", "Guide"),
    "large": ("SolidTexture", "CornerTiles"),
    "mesh": ("painting.texture_mesh", "painting.field_on_surface"),
    "materials": ("Material.save", "Material.preview", "materials.flatten_lighting"),
    "augment": ("transforms.TextureAugment",),
    "source_map": ("apply", "SourceMap.render"),
    "files": ("io.read", "io.write"),
    "batch": ("limits.context",),
}
"""Functions whose parameters each guide lists."""


def read_parameters(function: object) -> Iterator[tuple[str, str, str]]:
    """Return the name, the type and the description of each parameter of a docstring."""
    section, kind = "", ""
    names: list[str] = []
    words: list[str] = []
    lines = [*(inspect.getdoc(function) or "").splitlines(), "", "End", "---"]
    for line, after in zip(lines, [*lines[1:], ""], strict=True):
        heading = bool(after) and not after.strip("-")
        known = section in ("Parameters", "Attributes")
        if known and (heading or (line and not line.startswith(" ") and line.strip("-"))):
            yield from ((name, kind, " ".join(words)) for name in names)
            names = []
        if heading:
            section = line
        elif known and line.startswith(" "):
            words.append(line.strip())
        elif known and line.strip("-"):
            left, _, kind = line.partition(" : ")
            names, words = [n.strip(" *") for n in left.split(",")], []


def list_rows(function: Callable[..., Any], options: dict[str, str]) -> Iterator[tuple[str, ...]]:
    """Return the rows of a table: parameter, option, meaning, unit, range and default."""
    known = inspect.signature(function).parameters
    for name, kind, text in read_parameters(function):
        if name not in known or name == "progress":
            continue
        sentences = SENTENCE.split(text)
        inside = USUAL.search(sentences[0])
        stated = [s for s in sentences[1:] if re.match(r"By default|None|The default", s)]
        stated = [s[9:].rstrip(".") for s in sentences[1:] if s.startswith("Default: ")] or stated
        usual = stated[0] if stated else inside and inside[1]
        unit = next(
            (u for u in UNITS if re.search(rf"(?:in|of|many|number of|{NUMBER}) {u}\b", sentences[0], re.I)), ""
        )
        choices, found = re.search(r"\{([^}]*)\}", kind), RANGE.search(sentences[0])
        shape = re.sub(r",? ?(?:optional|default .*)$", "", kind)
        plain = re.match("int|float|pair|\\(", kind) and "array" not in kind
        given = f"one of {choices[1]}" if choices else found[0] if found and plain else shape
        default = show_default(known[name].default)
        yield f"`{name}`", options.get(name, ""), sentences[0], unit, given, default or usual or "none"


def show_default(value: object) -> str:
    """Return a default value as code, or an empty string for None."""
    if value is inspect.Parameter.empty:
        return "required"
    value = value.value if isinstance(value, enum.Enum) else value
    plain = value is True or value is False or isinstance(value, str | int | float | tuple | list)
    return "" if value is None else f"`{value!r}`" if plain else f"`{type(value).__name__}()`"


def list_options() -> dict[str, dict[str, str]]:
    """Return the options of each command by parameter. Fields of a dataclass are listed under its class."""
    from texrs.cli import COMMANDS, make_command

    found = {}
    for command in COMMANDS:
        options = {p.name: p.opts[0] for p in make_command(command).params if p.name and p.opts[0].startswith("--")}
        found[command.replace("-", "_")] = {name: f"`{flag}`" for name, flag in options.items()}
    groups = {"DeformationOptions": "deformation_", "ElementOptions": "elements_"}
    for name, start in groups.items():
        found[name] = {n.removeprefix(start): f for n, f in found["design"].items() if n.startswith(start)}
    return found


def make_tables(names: tuple[str, ...], options: dict[str, dict[str, str]]) -> str:
    """Return the tables of the parameters of functions, to be included in a guide."""
    text = ""
    for name in names:
        rows = list(list_rows(find(f"texrs.{name}"), options.get(name, {})))
        first = "parameter and option" if any(row[1] for row in rows) else "parameter"
        text += f"{{py:obj}}`texrs.{name}`:\n\n| {first} | meaning | range and unit | default |\n|---|---|---|---|\n"
        for parameter, option, *rest in rows:
            meaning, unit, given, default = map(as_markdown, rest)
            if unit and "array" not in given:
                given += f" {unit}" if given[-1].isdigit() else f", {unit}"
            both = "<br>".join(each for each in (parameter, option) if each)
            text += f"| {both} | {meaning} | {given} | {default} |\n"
        text += "\n"
    return text


def as_markdown(text: str) -> str:
    """Return text of a docstring as a table cell in Markdown."""
    return text.replace("``", "`").replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*")


def write_tables(folder: Path) -> None:
    """Write the tables of parameters of each guide as a page that the guide includes."""
    folder.mkdir(parents=True, exist_ok=True)
    options = list_options()
    for guide, names in TABLES.items():
        (folder / f"{guide}.md").write_text(make_tables(names, options), encoding="utf-8")

"""The layers of ARCHITECTURE.md: which modules may import which."""

import ast
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "python" / "texrs"

LAYERS = (
    ("_rust", "errors", "_typing"),
    ("_calls", "_memory", "_notices"),
    ("limits",),
    ("_alpha", "_cache", "_checks", "_digits", "_progress", "_version"),
    ("io", "_requests"),
    ("_conversion",),
    ("_masks",),
    ("_arrays",),
    ("_colours",),
    ("_light_evidence", "_light", "_show", "_threads", "kernels"),
    ("_chunks", "_lighting_correction", "_html", "_viewer"),
    ("_engine",),
    ("source_map",),
    ("blending",),
    ("materials",),
    ("fields", "scale_maps", "samples", "point_sets"),
    ("planes",),
    ("exemplar",),
    ("elements",),
    ("volume", "layouts"),
    ("synthesis", "metrics"),
    ("_palettes",),
    ("_verbs", "_comparison_of_ways"),
    ("quilting",),
    ("growth", "sowing"),
    ("mosaic",),
    ("tiling",),
    ("inpainting",),
    ("papers",),
    ("database", "extension", "stores", "painting", "rectification", "removal", "corner_tiles", "transforms"),
    ("_napari", "comparison", "demo"),
    ("cli",),
)
"""Layers, lowest first. A module imports its own package and lower layers, and nothing else."""
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}
TOP = ("__init__", "__main__")
"""The package itself, which loads names on first use, and its command."""

FILES = {
    ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(PACKAGE.rglob("*.py"))
}


def imports(name: str) -> set[str]:
    """Return the modules of texrs that a module imports, also inside functions and for type checkers only."""
    found = set()
    for node in ast.walk(ast.parse(FILES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [a.name for a in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}: imports inside the package name it in full"
            names = [f"{node.module}.{a.name}" for a in node.names]
        else:
            continue
        for full in names:
            root, _, inner = full.partition(".")
            if root != "texrs":
                continue
            while inner not in FILES and "." in inner:
                inner = inner.rpartition(".")[0]
            found.add(inner or "__init__")
    return found


def list_imports() -> list[tuple[str, str]]:
    """Return (module, imported module) of all files below the top layer."""
    return [(name, other) for name in FILES if name not in TOP for other in sorted(imports(name))]


def test_no_import_runs_upwards() -> None:
    arrows = list_imports()
    assert len(arrows) > 1000
    for name, other in arrows:
        package, theirs = name.partition(".")[0], other.partition(".")[0]
        if theirs != package:
            assert theirs in RANK, f"{name} imports {other}, which is in no layer"
            assert RANK[theirs] < RANK[package], f"{name} imports {other}, which lies no lower"


def test_no_imports_run_in_circles() -> None:
    graph = {name: imports(name) & FILES.keys() - {name} for name in FILES}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_papers_do_not_import_each_other() -> None:
    for name in FILES:
        parts = name.split(".")
        if parts[0] == "papers" and len(parts) > 1:
            others = {other.split(".")[1] for other in imports(name) if other.startswith("papers.")}
            assert others <= {parts[1]}, name


def test_private_modules_are_imported_by_their_own_package_only() -> None:
    for name, other in list_imports():
        package = name if FILES[name].name == "__init__.py" else name.rpartition(".")[0]
        owner, private, _ = other.partition("._")
        assert not private or f"{package}.".startswith(f"{owner}."), f"{name} imports {other}"


def test_every_module_has_a_layer() -> None:
    assert {name.partition(".")[0] for name in FILES} - set(TOP) == RANK.keys() - {"_rust"}


def test_nothing_reaches_a_verb_by_a_way_round() -> None:
    """The tests above find imports only if they are written as imports."""
    evasion = re.compile(r"\bvars\(texrs|\bgetattr\(texrs\b|(import_module|__import__)\(.texrs|\bsys\.modules\b")
    for name, path in FILES.items():
        assert not evasion.search(path.read_text(encoding="utf-8")), name


def test_the_project_speaks_of_itself_alone() -> None:
    words = re.compile(r"\b(TODO|FIXME|XXX)\b")
    for path in PACKAGE.rglob("*.py"):
        assert not words.search(path.read_text(encoding="utf-8")), path.name

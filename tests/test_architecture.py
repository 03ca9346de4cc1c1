"""The rooms of ARCHITECTURE.md: who may import whom."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "python" / "texrs"

# Each room may import the rooms of the lines above its own, and those named behind the arrow in its own line.
FOUNDATION = {"errors", "_typing", "_arrays", "_progress", "threads", "samples"}
KERNELS = {"kernels"}
NOUNS = {
    "analysis": {"io"},
    "source_map": {"io", "_pixels"},
    "_pixels": {"source_map"},
    "io": set(),
    "report": {"source_map", "io", "volume"},
    "segment": set(),
    "elements": {"analysis", "io", "matching", "segment"},
    "fields": set(),
    "volume": {"io", "fields", "source_map"},
    "deform": set(),
    "quilt": {"source_map", "_pixels"},
    "blend": {"source_map"},
    "cyclic": {"source_map", "report"},
    "completion": {"source_map", "report", "deform", "blend", "_completion_scaled"},
    "_completion_scaled": {"source_map", "scale_maps", "supply"},
    "matching": set(),
    "supply": {"source_map"},
    "scale_maps": set(),
}
TOP = {
    "papers": set(NOUNS),
    "database": {"io", "elements"},
    "cli": {"papers", "demo", "database", *NOUNS},
    "demo": {"papers", *NOUNS},
}


def imports(path: Path) -> set[str]:
    """Return the texrs modules, by their first name inside the package, that a file imports."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [a.name for a in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [f"{node.module}.{a.name}" for a in node.names]
        else:
            continue
        for name in names:
            parts = name.split(".")
            if parts[0] == "texrs" and len(parts) > 1:
                found.add(parts[1])
    return found


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_arrows(path: Path) -> None:
    mine, theirs = room(path), imports(path)
    if mine in ("__init__", "__main__"):
        return
    theirs.discard(mine)
    if mine in FOUNDATION:
        allowed = {"errors", "_typing", "_arrays"} | ({"_rust"} if mine == "threads" else set())
    elif mine == "kernels":
        allowed = {"errors", "_typing", "_arrays", "_rust"}
        if path.name == "warp.py":  # What a warp is: a source map.
            allowed |= {"source_map"}
    elif mine in NOUNS:
        allowed = FOUNDATION | KERNELS | NOUNS[mine] | ({"_rust"} if mine in ("source_map", "io") else set())
    else:
        allowed = FOUNDATION | KERNELS | TOP[mine]
    assert theirs <= allowed, f"{mine} must not import {theirs - allowed}"


def test_papers_do_not_import_each_other() -> None:
    """A paper may have parts of its own, whose names begin with its own: design and _design_literal."""
    for path in (PACKAGE / "papers").glob("*.py"):
        found = re.findall(r"^\s*(?:from|import) texrs\.papers\.?(\S*)", path.read_text(encoding="utf-8"), re.MULTILINE)
        own = path.stem.strip("_").split("_")[0]
        assert all(name == own or name.startswith(f"_{own}_") for name in found), found


RUST = ROOT / "rust" / "src"


def rust_files() -> list[Path]:
    return sorted(RUST.rglob("*.rs"))


@pytest.mark.parametrize(
    ("crate", "home"),
    [
        ("rayon", "par.rs"),
        ("pyo3", "py/"),
        ("numpy", "py/"),
        ("image", "image_io"),
        ("spade", "warp"),
    ],
)
def test_each_library_has_one_home(crate: str, home: str) -> None:
    use = re.compile(rf"(?:\buse {crate}(?:::|;| )|(?<![\w:]){crate}::\w)")
    for path in rust_files():
        name = path.relative_to(RUST).as_posix()
        code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        if not name.startswith(home):
            assert not use.search(code), f"{name} names {crate}, whose home is {home}"


def test_kernels_do_not_import_the_door() -> None:
    for path in rust_files():
        name = path.relative_to(RUST).as_posix()
        if not name.startswith("py/"):
            assert "crate::py" not in path.read_text(encoding="utf-8"), name


FOUNDATION_RUST = {"error", "grid", "par", "hash", "fixed", "pca", "sparse", "Error", "Result"}
KERNEL_ARROWS = {
    "gather": set(),
    "image_io": set(),
    "seam": set(),
    "patch_search": set(),
    "mean_shift": set(),
    "ncc": set(),
    "nearest": set(),
    "poisson": set(),
    "appearance": set(),
    "guide": {"appearance"},
    "blocks": {"appearance", "guide"},
    "optimize": {"appearance", "guide"},
    "coherence": {"appearance"},
    "pyramid": set(),
    "complete": {"seam", "patch_search"},
    "warp": set(),
}


def test_kernel_arrows() -> None:
    for path in rust_files():
        mine = path.relative_to(RUST).parts[0].removesuffix(".rs")
        if mine in ("lib", "py"):
            continue
        code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        used = set(re.findall(r"\bcrate::\{?\s*(\w+)", code))
        for group in re.findall(r"\buse crate::\{([^}]*)\}", code):
            used |= {item.strip().split("::")[0] for item in group.split(",") if item.strip()}
        allowed = FOUNDATION_RUST | KERNEL_ARROWS.get(mine, set()) | {mine}
        assert used <= allowed, f"{path.name} must not use {used - allowed}"


def test_the_project_speaks_of_itself_alone() -> None:
    words = re.compile(r"\b(TODO|FIXME|XXX)\b|todo!\(|unimplemented!\(")
    for path in [*rust_files(), *PACKAGE.rglob("*.py")]:
        assert not words.search(path.read_text(encoding="utf-8")), path.name

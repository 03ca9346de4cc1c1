"""The layers of the Rust crate: which modules may use which, and the one home of each library."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

RUST = Path(__file__).resolve().parents[1] / "rust" / "src"

LAYERS = ("foundation", "kernels", "engine", "bindings")
"""Layers, lowest first. A module uses the layers below its own."""
WITHIN = {
    "kernels": {
        "hierarchy": {"watershed"},
        "inpaint": {"seam", "patch_search"},
        "packing": {"hierarchy"},
        "warp": {"gather"},
    },
    "engine": {
        "guide": {"appearance"},
        "blocks": {"appearance", "guide"},
        "optimize": {"appearance", "guide"},
        "coherence": {"appearance"},
        "stitcher": {"guide"},
        "quilt": {"stitcher"},
    },
}
"""Modules of the same layer that a module may use. Modules of the foundation and the bindings are not restricted."""
HOMES = {
    "rayon": ("foundation/par",),
    "libm": ("foundation/libm",),
    "rustfft": ("foundation/fft",),
    "pulp": ("foundation/simd",),
    "spade": ("kernels/warp",),
    "image": ("kernels/image_io",),
    "pyo3": ("bindings/",),
    "numpy": ("bindings/",),
    "thiserror": ("foundation/error",),
}


def files() -> list[tuple[str, str]]:
    """Return path and code, without comments, of every source file."""
    found = sorted(RUST.rglob("*.rs"))
    return [(p.relative_to(RUST).as_posix(), re.sub(r"//.*", "", p.read_text(encoding="utf-8"))) for p in found]


def uses(code: str) -> set[tuple[str, str]]:
    """Return (layer, module) of every path that begins at the root of the crate."""
    # Expand names in braces to one path each: use crate::a::{b::c, d} becomes crate::a::b::c and crate::a::d.
    flat = re.sub(
        r"\b(crate(?:::\w+)*)::\{([^{}]*(?:\{[^{}]*\}[^{}]*)*)\}",
        lambda m: " ".join(f"{m[1]}::{item}" for item in re.split(r",\s*(?![^{}]*\})", m[2]) if item.strip()),
        code,
    )
    return {(m[1], m[2] or "") for m in re.finditer(r"\bcrate::\s*(\w+)(?:::\s*(\w+))?", flat)}


FILES = files()


def test_arrows_point_down() -> None:
    assert len(FILES) > 100
    for path, code in FILES:
        if path != "lib.rs":
            check_arrows(path, code)


def check_arrows(path: str, code: str) -> None:
    layer, module = path.removesuffix(".rs").split("/")[:2]
    assert layer in LAYERS, f"{path} stands in no layer"
    whole = module.endswith("_tests")  # Tests of a whole layer.
    for other, name in uses(code):
        if other in ("Error", "Result"):  # These are re-exported from foundation::error.
            continue
        assert other in LAYERS, f"{path} uses crate::{other}, which is no layer"
        if other == layer:
            allowed = WITHIN.get(layer, {}).get(module, set()) | {module}
            assert layer not in WITHIN or whole or name in allowed, f"{path} must not use {name}"
        else:
            assert LAYERS.index(other) < LAYERS.index(layer), f"{path} must not use {other}::{name}"


def test_no_relative_path_reaches_a_neighbour() -> None:
    """Paths out of a module must begin at the root, where the test above reads them."""
    modules = {
        layer: {path.split("/")[1].removesuffix(".rs") for path, _ in FILES if layer in path} for layer in LAYERS
    }
    for path, code in FILES:
        if path == "lib.rs" or path.startswith("bindings/"):
            continue
        layer, module = path.removesuffix(".rs").split("/")[:2]
        depth = path.count("/") - path.endswith("/mod.rs")
        for climb, name in re.findall(r"\b((?:super::)+)(\w+)", code):
            if climb.count("super") >= depth:
                assert name == module or name not in modules[layer], f"{path} reaches {name} by {climb}"


@pytest.mark.parametrize("crate", HOMES)
def test_each_library_has_one_home(crate: str) -> None:
    # texrs has modules with the names of crates, such as libm. Their paths begin at the root of texrs, and the crate
    # itself is ::libm.
    use = re.compile(rf"\buse (?:::)?{crate}(?:::|;| )|(?<![\w:])(?:::)?{crate}::\w")
    users = {path for path, code in FILES if use.search(code)}
    assert users, f"nothing uses {crate}"
    strangers = {path for path in users if not path.startswith(HOMES[crate])}
    assert not strangers, f"{strangers} name {crate}, whose home is {HOMES[crate]}"


def test_every_library_is_in_the_table() -> None:
    text = (RUST.parents[1] / "Cargo.toml").read_text(encoding="utf-8")
    section = re.search(r"^\[dependencies\]\n(.*?)^\[", text, re.MULTILINE | re.DOTALL)
    assert section is not None
    assert set(re.findall(r"^(\w+) *=", section[1], re.MULTILINE)) == set(HOMES)


def test_the_map_names_every_module() -> None:
    """The tables of lib.rs list the modules of the folders."""
    text = (RUST / "lib.rs").read_text(encoding="utf-8")
    for layer in LAYERS[:-1]:
        inside = {p.stem for p in (RUST / layer).iterdir() if p.stem != "mod" and not p.stem.endswith("_tests")}
        table = re.search(rf"^//! \| {layer} \|.*?(?=^//!$)", text, re.MULTILINE | re.DOTALL)
        assert table is not None
        assert set(re.findall(r"^//! \| \[?`(\w+)`", table[0], re.MULTILINE)) == inside


def test_the_project_speaks_of_itself_alone() -> None:
    words = re.compile(r"\b(TODO|FIXME|XXX)\b|todo!\(|unimplemented!\(")
    for path in RUST.rglob("*.rs"):
        assert not words.search(path.read_text(encoding="utf-8")), path.name

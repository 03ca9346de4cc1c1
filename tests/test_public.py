"""The public names: they exist, there are no others, and they are loaded on use."""

import enum
import inspect
import re
import subprocess
import sys
from types import ModuleType
from typing import Any, get_origin

import texrs


def public_modules() -> list[ModuleType]:
    found, left = [], [texrs]
    while left:
        module = left.pop()
        found.append(module)
        left += [m for m in (getattr(module, n) for n in module.__all__) if isinstance(m, ModuleType)]
    return sorted(found, key=lambda m: m.__name__)


MODULES = public_modules()


def test_modules_are_found() -> None:
    names = {module.__name__ for module in MODULES}
    assert {"texrs", "texrs.errors", "texrs.fields", "texrs.io", "texrs.kernels", "texrs.kernels.seam"} <= names


def test_dir_shows_public_names_alone() -> None:
    for module in MODULES:
        assert sorted(dir(module)) == sorted(module.__all__), module
        assert all(hasattr(module, name) for name in module.__all__), module


def test_public_names_are_documented() -> None:
    for name in texrs.__all__:
        text = getattr(texrs, name).__doc__
        # Refuse the generated docstring of a dataclass, which is its signature.
        assert name.startswith("_") or (text and not text.startswith(f"{name}(")), name


def test_importing_texrs_loads_no_library() -> None:
    code = "import sys, texrs; print(sorted({'numpy', 'scipy', 'skimage', 'texrs._rust'} & sys.modules.keys()))"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"


def test_a_name_loads_no_more_than_it_needs() -> None:
    code = "import sys, texrs; texrs.kernels; texrs.io; print(sorted({'scipy', 'skimage', 'PIL'} & sys.modules.keys()))"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"


# --- what docstrings say --------------------------------------------------------------------------------------------


def public_entries() -> dict[str, Any]:
    """Return all public functions, classes and methods by their names, each once.

    Exempt are constants and types of arguments without a docstring; properties, whose first line is enough;
    exceptions, which their root describes; and members inherited from classes of other libraries.
    """
    found: dict[int, tuple[str, Any]] = {}
    for module in MODULES:
        for name in module.__all__:
            value = getattr(module, name)
            if not (inspect.isclass(value) or inspect.isroutine(value)) or get_origin(value) is not None:
                continue
            if inspect.isclass(value) and issubclass(value, Exception):
                continue
            found.setdefault(id(value), (f"{module.__name__}.{name}", value))
            for part, method in vars(value).items() if inspect.isclass(value) else ():
                inner = getattr(method, "__func__", method)
                if not part.startswith("_") and inspect.isfunction(inner):
                    found.setdefault(id(inner), (f"{module.__name__}.{name}.{part}", inner))
    return dict(sorted(found.values(), key=lambda entry: entry[0]))


def list_parameters(value: Any) -> list[inspect.Parameter]:
    # Skip enumerations, because their signature is the signature of their base class.
    if inspect.isclass(value) and issubclass(value, enum.Enum):
        return []
    own = inspect.signature(value).parameters.values()
    return [p for p in own if p.name not in ("self", "cls") and not p.name.startswith("_")]


def read_sections(text: str) -> dict[str, str]:
    parts = re.split(r"^(\w[\w ]*)\n-{3,}\n", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def read_parameters(sections: dict[str, str]) -> dict[str, tuple[str, str]]:
    """Return the type and the description of each parameter or field."""
    said: dict[str, tuple[str, str]] = {}
    for section in ("Parameters", "Attributes"):
        for block in re.split(r"^(?=\S)", sections.get(section, ""), flags=re.MULTILINE):
            head, _, rest = block.partition("\n")
            names, _, kind = head.partition(" : ")
            said |= {name.strip().lstrip("*"): (kind, " ".join(rest.split())) for name in names.split(",") if name}
    return said


ENTRIES = public_entries()
SHAPE = re.compile(r"\([^)]*(,|\.\.\.)[^)]*\)|of shape|\blike\b|`|register|'s shape|s' shape")
"""An array has a shape in letters, or refers to another argument."""
UNIT = re.compile(
    r"\d|pixel|degree|share|second|byte|voxel|sample|number|how many|seed|times|cells|units|weight|`", re.IGNORECASE
)
"""A number has a unit or a range, or counts something."""
RAISE_NOTHING = {
    "texrs.elements.to_html",
    "texrs.elements.draw",
    "texrs.exemplar.Segmentation.measure_depth",
    "texrs.io.Metadata.fit",
}
"""Functions that take results and numbers of texrs, and do not check them."""


def find_faults(value: Any, name: str) -> list[str]:
    text = inspect.getdoc(value) or ""
    sections = read_sections(text)
    said, taken = read_parameters(sections), list_parameters(value)
    faults = [f"{p.name}: not described" for p in taken if p.name not in said]
    for parameter, (kind, words) in said.items():
        if re.search(r"\barray", kind) and not SHAPE.search(kind + words):
            faults.append(f"{parameter}: an array without a shape")
        if re.match(r"(int|float)\b", kind) and parameter != "seed" and not UNIT.search(kind + words):
            faults.append(f"{parameter}: a number without a unit or a range")
    if "Examples" not in sections:
        faults.append("no example")
    if inspect.isfunction(value):
        if value.__annotations__.get("return") not in ("None", None) and not {"Returns", "Yields"} & sections.keys():
            faults.append("nothing of what is returned")
        if taken and "Raises" not in sections and name not in RAISE_NOTHING:
            faults.append("nothing of what is raised")
    return faults


def test_docstrings_say_shapes_units_what_is_raised_and_an_example() -> None:
    assert len(ENTRIES) > 200
    faults = {name: found for name, value in ENTRIES.items() if (found := find_faults(value, name))}
    assert not faults

"""The options of commands equal the parameters of their functions."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import typer

import texrs
from texrs import io
from texrs.cli import COMMANDS, _elements, _maps, app
from texrs.cli._options import MISSING, Option, Options, describe
from texrs.cli._texts import About
from texrs.cli._verbs import NAMES, make_verb
from texrs.errors import InvalidInput

GROUP: Any = typer.main.get_command(app)
VERBS = {name: make_verb(name) for name in NAMES}
STANDING = {name: (verb.options,) for name, verb in VERBS.items()} | {
    "analyse": (_elements.PICTURED,),
    "apply": (_maps.APPLIED,),
}
"""Commands of functions, and all options that they take from them."""


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_has_a_help_text(command: str) -> None:
    for parameter in GROUP.get_command(None, command).params:
        text = parameter.help
        assert text, parameter.name
        assert text[0] == text[0].strip(), text
        assert text.endswith((".", ")")), text
        # Words of Python signatures must not occur, because they do not exist in a shell.
        assert not any(word in text for word in ("None", "`", "  ", "texrs.exemplar")), text


@pytest.mark.parametrize("command", STANDING)
def test_every_parameter_is_an_option_or_left_out_for_a_reason(command: str) -> None:
    taken = {p.name for p in GROUP.get_command(None, command).params}
    for options in STANDING[command]:
        found = {option.path[0] for option in options}
        for name in inspect.signature(options.function).parameters:
            if name != "self":
                assert (name in found) != bool(options.leave.get(name)), name
        assert {option.name for option in options} <= taken
        for name in options.leave.keys() - {"progress"}:
            assert name.partition(".")[0] in inspect.signature(options.function).parameters, name


@pytest.mark.parametrize("command", STANDING)
def test_defaults_are_those_of_the_functions(command: str) -> None:
    made = {p.name: p for p in GROUP.get_command(None, command).params}
    for options in STANDING[command]:
        for option in options:
            path, default = option.path, made[option.name].default
            function = options.function if len(path) == 1 else options.groups[path[0]]
            theirs = inspect.signature(function).parameters[path[-1]].default
            if theirs is MISSING or path[-1] in options.optional:
                # The command has its own default, and passes nothing to the function.
                assert default is None
                continue
            assert understood(option, default, options.axes) == theirs or alike(option, default, theirs), option.name


@pytest.mark.parametrize("command", NAMES)
def test_wrap_has_one_default_in_all_verbs(command: str) -> None:
    """Its help describes the default: newly composed textures are periodic, and others follow their input."""
    for each in (p for p in GROUP.get_command(None, command).params if p.name == "wrap"):
        assert each.default == "default"
        assert re.search(r"[Dd]efault: (both|neither|none of them|none)", each.help)


def understood(option: Option, text: Any, axes: int) -> Any:
    """Return the value that a default's text has for the function."""
    if option.kind is None or text is None or (text == "default" and text in option.kind.words):
        return None if text == "default" else text
    if text in option.kind.words:
        return text
    return option.kind.read(text, About(option.flag, axes=axes))


def alike(option: Option, text: Any, theirs: Any) -> bool:
    """Return whether two defaults agree, where one may be a sequence for all axes."""
    found = understood(option, text, 2)
    return tuple(found) == (tuple(theirs) if not isinstance(theirs, bool) else (theirs,) * len(found))


# --- the mechanism -----------------------------------------------------------------------------------------------------


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"

    @classmethod
    def _missing_(cls, value: object) -> Colour | None:
        return cls.RED if value == "R" else None


@dataclass(frozen=True, kw_only=True)
class Knobs:
    """Knobs.

    Attributes
    ----------
    width : int
        How wide, 1 to 9; see ``mode``. "far" is not near. None of it counts.
    kind : {"near", "far"}, optional
        "near": here. "far": there. Neither is elsewhere.

    """

    width: int
    kind: Literal["near", "far"] | None = None


def paint(
    image: object,
    mode: Literal["plain", "fine"] = "plain",
    *,
    colour: Colour | None = None,
    mirror: bool = True,
    copies: int = 4,
    margin: int | None = None,
    knobs: Knobs | None = None,
    size: int | tuple[int, int] | None = None,
    progress: object = None,
) -> dict[str, Any]:
    """Paint.

    Parameters
    ----------
    image : array
        The picture (`texrs.io`) [1]_, that may be
        of any kind.
    mode : {"plain", "fine"}
        How. See `texrs.paint`. "fine" takes longer than ``size`` says (section 3.2).
    colour, mirror
        Whether False.
    copies : int
        Number of copies. Default: 4.
    margin : int, optional
        Width in pixels. Default: 1.5 times the example.
    size : int
        None leaves it.

    Returns
    -------
    size : dict
        Of another size.

    """
    return {}


OPTIONS = Options(paint, names={"knobs": "knob"}, leave={"image": "it is none"})
GIVEN: dict[str, Any] = {option.name: option.default for option in OPTIONS}


def test_a_docstring_says_what_an_option_is() -> None:
    assert describe(paint)["image"] == "The picture (`texrs.io`) [1]_, that may be of any kind."
    assert describe(paint)["size"] == "None leaves it."
    help_ = {option.name: option.info.help for option in OPTIONS}
    assert help_ == {
        "mode": "How. fine takes longer than --size says.",
        "colour": "Whether False.",
        "mirror": "Whether --no-mirror.",
        # The command itself adds the default 4 to the help text, but not a computed default.
        "copies": "Number of copies.",
        "margin": "Width in pixels. Default: 1.5 times the example.",
        "knobs_width": "How wide, 1 to 9; see --mode. far is not near.",
        "knobs_kind": "near: here. far: there.",
        "size": "The default leaves it.",
    }


def test_types_and_names_say_how_an_option_is_read() -> None:
    flags = {option.flag: (option.default, option.info.metavar) for option in OPTIONS}
    assert flags == {
        "--mode": ("plain", "plain|fine"),
        "--colour": ("default", "default|red|blue"),
        "--mirror": (True, None),
        "--copies": (4, None),
        "--margin": (None, None),
        "--knob-width": (None, None),
        "--knob-kind": ("default", "default|near|far"),
        "--size": (None, "WIDTHxHEIGHT"),
    }
    assert OPTIONS.call(OPTIONS.read(GIVEN)) == {}
    given = GIVEN | {"colour": "R", "size": "4x3", "knobs_width": 3, "knobs_kind": "far", "mirror": False}
    knobs = Knobs(width=3, kind="far")
    expected = {"colour": Colour.RED, "size": (3, 4), "mirror": False, "knobs": knobs}
    assert OPTIONS.call(OPTIONS.read(given)) == expected
    for name, text, message in (
        ("colour", "green", "--colour: must be one of default, red, blue; got 'green'"),
        ("mode", "best", "--mode: must be one of plain, fine; got 'best'"),
        ("knobs_kind", "near", "--knob-kind: must be combined with --knob-width"),
    ):
        with pytest.raises(InvalidInput) as caught:
            OPTIONS.call(OPTIONS.read(GIVEN | {name: text}))
        assert str(caught.value) == message


def test_what_nothing_says_how_to_read_is_refused() -> None:
    def unknown(thing: object) -> None:
        """Take a thing."""

    with pytest.raises(TypeError, match="unknown: the parameter thing has neither a known type nor a kind"):
        Options(unknown)


def test_help_loads_nothing_that_it_does_not_need() -> None:
    for arguments, unneeded in (
        (["--help"], {"numpy", "scipy", "skimage", "tifffile", "texrs.papers.design"}),
        (["tile", "--help"], {"scipy", "skimage", "tifffile", "imageio", "texrs.papers.design"}),
    ):
        code = f"import sys; from texrs.cli import main; main({arguments}); print(*sys.modules, file=sys.stderr)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.startswith("Usage: texrs")
        assert not unneeded & set(done.stderr.split())


def test_growing_a_picture_loads_neither_scipy_nor_scikit_image(tmp_path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 255, (32, 32, 3), dtype=np.uint8)
    io.write(tmp_path / "in.png", picture)
    words = ["synthesize", "in.png", "-o", "out.png", "--size", "48", "--method", "paper-compensated", "--quiet"]
    code = f"import sys; from texrs.cli import main; main({words}); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert io.read(tmp_path / "out.png").shape == (48, 48, 3)
    assert not {"scipy", "skimage"} & set(done.stdout.split())


def test_a_word_means_the_same_in_every_command() -> None:
    forms: dict[str, set[str]] = {}
    for command in COMMANDS:
        for parameter in GROUP.get_command(None, command).params:
            if parameter.param_type_name == "option":
                form = str(parameter.metavar).removeprefix("default|").removeprefix("PLANESx").removesuffix("|auto")
                form = form.replace("xyz|...", "xy|x|y")
                forms.setdefault(max(parameter.opts, key=len), set()).add(form)
    # These options differ on purpose: outputs are folders, entries or images; commands have their own algorithms; an
    # image of a volume is a square; a photograph may show several planes; check reads the source map that other
    # commands write; tiles have two axes.
    several = {flag for flag, found in forms.items() if len(found) > 1}
    assert several == {
        "--out",
        "--method",
        "--size",
        "--slant",
        "--tilt",
        "--fov",
        "--source-map",
        "--chunks",
        "--way",
        "--origin",
    }
    assert not {"--source", "--source-image", "--held", "--rim", "--children"} & set(forms)
    assert forms["--source-map"] == {"OUT.npz", "MAP.npz"}


def test_commands_are_those_of_the_verbs() -> None:
    drawn = {
        "inpaint",
        "design",
        "extend",
        "perspective",
        "rectify",
        "remove",
        "self-splice",
        "solid",
        "splice",
        "synthesize",
        "tile",
    }
    assert drawn == set(VERBS)
    assert all(callable(getattr(texrs, name.replace("-", "_"))) for name in VERBS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_each_default_once(command: str) -> None:
    context = typer.Context(GROUP)
    for parameter in GROUP.get_command(None, command).params:
        text = (parameter.get_help_record(context) or ("", ""))[1]
        assert len(re.findall(r"Default: |\[default: (?!default\])", text)) < 2, text

"""What each public function answers if one argument of a valid call is unsuitable."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import hostile
import texrs
from pins import calls

KINDS = {
    "": "None nan 'no-such' object() [] {}",
    r"\bint\b|float": "-1 0 0.5 2 inf 2**70 True '7' [1] 1j",
    r"Sequence|tuple|Size|Shape|Vector": "3 '' (0,0) (-1,5) (nan,5) (10**9,10**9) ('a','b') (1,)*9 [[1],[1,2]]",
    r"bool": "2 'yes' (True,)*9",
    r"[sS]tr|Literal|Path|Kind|Method|Trend|Interpolation|Quality": "'' 3 b'x' 'absent/x' '\\0' 'x.png'",
    r"Array|object|Floats|Bools|Labels|Marks|Exemplar|Field|Mask": "3 'absent.png' zeros(0) zeros((2,)*6) v[:0] v[None] "
    "v.ravel() v.astype(complex) v.astype(object) v*nan v*inf v*0 -1.0*v v+1e30",
    r"Mapping|dict": "3 {0:1} {'x':None}",
    r"Callable|Progress": "3 len int (lambda:None)",
}
"""Unsuitable values for the annotations that contain a pattern. v is the valid array, or an image."""
SKIPPED = {"self", "options", "scheduler", "function", "make", "each", "maps", "how"}
"""Arguments that start processes or contain other arguments, and functions whose errors belong to the caller."""


class Begun(BaseException):
    """The arguments were accepted, and the work has begun."""


def stop_work() -> Callable[[str, float], None]:
    """Return a progress function that stops a verb after its first stage has begun, which contains checks."""
    stages: list[str] = []

    def report(stage: str, share: float) -> None:
        stages.append(stage)
        if share > 0 or stage != stages[0]:
            raise Begun

    return report


def list_values(parameter: inspect.Parameter, valid: object) -> Iterator[tuple[str, object]]:
    """Yield the unsuitable values of a parameter, each with its text."""
    image = calls.values()["image"]
    v = np.asarray(valid) if isinstance(valid, np.ndarray) and valid.dtype.kind in "buif" else image
    known = {"np": np, "nan": np.nan, "inf": np.inf, "zeros": np.zeros, "v": v}
    # The arguments of a function are not its kind.
    annotation = re.sub(r"Callable\[.*\]", "Callable", str(parameter.annotation))
    kinds = [texts for pattern, texts in KINDS.items() if re.search(pattern, annotation)]
    for text in dict.fromkeys(" ".join(kinds).split()):
        with np.errstate(all="ignore"):
            yield text, eval(text, known)


def answer(call: hostile.Call, name: str, value: object) -> str:
    """Return the class and the message of the error of a call, or "accepted"."""
    given = call.arguments | {name: value}
    progress = inspect.signature(call.function).parameters.get("progress")
    if progress is not None and "bool" in str(progress.annotation) and name != "progress":
        given["progress"] = stop_work()
    try:
        with texrs.limits.context(pixels=2**18, voxels=2**18), np.errstate(all="ignore"):
            call.call(given)
    except Begun:
        return "accepted"
    except texrs.errors.TexrsError as error:
        said = re.sub(rf"\bgot {re.escape(repr(value))}(?!\w)", "got ~", f"{type(error).__name__}: {error}")
        said = re.sub(rf"\bgot {type(value).__name__}(?!\w)", "got TYPE", said)
        for folder in (Path.cwd(), Path.cwd().parent):
            said = said.replace(f"{folder}/", "")
        return re.sub(r" at 0x[0-9a-f]+", "", re.sub(r"\btmp\w{8}\b", "TMP", said)).encode("unicode_escape").decode()
    return "accepted"


def list_answers(name: str, place: Path) -> Iterator[str]:
    """Yield a line for each parameter of a function and each answer, with the values that get this answer."""
    call = calls.read_calls().get(name) or hostile.record(name, place)
    for parameter in inspect.signature(call.function).parameters.values() if call else ():
        if parameter.name in SKIPPED or parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            continue
        answers: dict[str, list[str]] = {}
        for text, value in list_values(parameter, call.arguments.get(parameter.name)):
            answers.setdefault(answer(call, parameter.name, value), []).append(text)
        for said, texts in sorted(answers.items()):
            yield f"{name}({parameter.name}={' '.join(texts)}) {said}"
    # Remove the limits that one of the functions set.
    texrs.limits.set()


def list_refusals(place: Path, *, inner: bool) -> Iterator[str]:
    """Yield the answers of all functions and classes of `texrs`, or of those in its modules."""
    os.chdir(place)
    calls.read_calls()
    for name in sorted(hostile.public_calls()):
        if inner == (name.count(".") > 1 and name.split(".")[1].islower()):
            # Use a folder for each function, so that no answer depends on the files of other functions.
            os.mkdir(place / name)
            os.chdir(place / name)
            yield from list_answers(name, place / name)

"""Requests of verbs: frozen classes whose fields are the parameters of a verb.

A parameter is written once, as a field of the request with its types, its check, its default and its description::

    @request
    class Blur(Request):
        '''Parameters of `texrs.blur`.

        - ``radius`` (int): Radius in pixels, 1 to 9. Default: 2.
        '''

        radius: Word[int, int] = Word(whole(1, 9), default=2)

`texrs._verbs.verb` makes the signature and the documentation of the verb from its request. It checks the arguments of
each call by it, and passes it to the code of the verb. This code does not check again.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from copy import copy
from dataclasses import dataclass
from functools import cached_property, partial
from textwrap import wrap
from typing import Any, ClassVar, Generic, TypeVar, dataclass_transform, get_args, get_type_hints, overload

from texrs._checks import as_bool, as_choice, as_float, as_int, as_method, as_seed, as_wrap
from texrs._progress import answering, listen, stage
from texrs._typing import Progress
from texrs.errors import InvalidInput

__all__ = [
    "PROGRESS",
    "SEED",
    "Request",
    "Word",
    "as_given",
    "as_weight",
    "choice",
    "describe",
    "find_types",
    "instance",
    "make_signature",
    "method",
    "optional",
    "periodic",
    "real",
    "request",
    "tied",
    "truth",
    "whole",
]

MISSING = inspect.Parameter.empty
DESCRIPTIONS = {
    "progress": """(callable or True, optional): Function called as ``progress(stage, share)`` with the finished share of the
stage. If it raises an exception, the work stops. True shows a progress bar. Default: none.""",
}
"""Descriptions of parameters that are the same for all verbs."""
ENTRY = re.compile(r"^ *- ``(\w+)`` (\(.*?\)): (.*?)(?=^ *- ``|^\S|\n\n|\Z)", re.MULTILINE | re.DOTALL)
"""Pattern of a described parameter in the docstring of a request."""

Given = TypeVar("Given")
Kept = TypeVar("Kept")
T = TypeVar("T")


class Word(Generic[Given, Kept]):
    """A parameter: a field that is set to a value of the caller, and contains the checked value.

    Parameters
    ----------
    check : callable
        Function that gets a value and the name of the parameter. It returns the checked value, or raises an error.
    default : object
        Default value for callers, which is checked like all others. Without it, the parameter is required.
    after : str
        Name of the parameter that precedes a field of a subclass in the signature.

    """

    def __init__(self, check: Callable[[Any, str], Kept], *, default: Given = MISSING, after: str = "") -> None:  # type: ignore[assignment]
        self.check, self.default, self.after, self.name = check, default, after, ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, asked: None, owner: type) -> Any: ...

    @overload
    def __get__(self, asked: object, owner: type) -> Kept: ...

    def __get__(self, asked: object | None, owner: type) -> Any:
        if asked is not None:
            return vars(asked)[self.name]
        if self.default is MISSING:
            raise AttributeError(self.name)  # A field without a default is required.
        return self.default

    def __set__(self, asked: object, value: Given) -> None:
        vars(asked)[self.name] = self.check(value, self.name)


class tied(cached_property[T]):
    """Value or check that depends on several parameters. It is computed once, when the request is made."""


class Request:
    """Arguments of a call, checked in the order of the fields, and then in the order of the `tied` methods."""

    stage: ClassVar[str] = ""
    """Name under which the progress of the `tied` methods is reported, if they take long."""

    def __post_init__(self) -> None:
        """Compute all values that depend on several parameters."""
        stage(vars(self)["progress"] if self.stage else None, self.stage)
        with answering(vars(self)["progress"], self.stage, 0.0) if self.stage else nullcontext():
            for owner in reversed(type(self).__mro__):
                for name in (name for name, each in vars(owner).items() if isinstance(each, tied)):
                    getattr(self, name)

    @property
    def watch(self) -> Progress:
        """Progress function, which does nothing if the caller did not give one."""
        return vars(self)["progress"] or (lambda stage, share: None)

    def vary(self: T, **values: Any) -> T:
        """Return a copy with other values, which are not checked."""
        other = copy(self)
        vars(other).update(values)
        return other


@dataclass_transform(field_specifiers=(Word,))
def request(kind: type[T]) -> type[T]:
    """Make a class with fields a request."""
    return dataclass(frozen=True, eq=False, repr=False)(kind)


def make_signature(kind: Any, returned: Any) -> inspect.Signature:
    """Return the signature of a verb: the fields of its request, with the types of values that callers give."""
    several = list(inspect.signature(kind).parameters.values())
    for each in tuple(several):
        after = inspect.getattr_static(kind, each.name).after
        if after:
            several.remove(each)
            several.insert([p.name for p in several].index(after) + 1, each)
    return inspect.Signature(
        [p.replace(annotation=_find_given(p.annotation)) for p in several], return_annotation=returned
    )


def _find_given(annotation: str) -> str:
    """Return the first type in the text ``Word[first, second]``."""
    types: Any = ast.parse(annotation, mode="eval").body
    return str(ast.get_source_segment(annotation, types.slice.elts[0]))


def find_types(kind: Any) -> dict[str, Any]:
    """Return the types of the values that callers give for each field of a request."""
    return {name: get_args(each)[0] for name, each in get_type_hints(kind).items() if get_args(each)}


def describe(kind: Any) -> Iterator[str]:
    """Yield the lines of the section "Parameters" in the docstring of a verb, in the order of its signature."""
    known = dict(DESCRIPTIONS)
    for owner in reversed(kind.__mro__):
        known |= {name: f"{form}: {text}" for name, form, text in ENTRY.findall(inspect.getdoc(owner) or "")}
    for name in make_signature(kind, None).parameters:
        form, _, text = known[name][1:].partition("): ")
        yield f"{name} : {' '.join(form.split())}"
        yield from wrap(" ".join(text.split()), 115, initial_indent="    ", subsequent_indent="    ")


def as_given(value: T, name: str) -> T:
    """Return a value unchanged, because its check depends on other parameters."""
    return value


def whole(low: int, high: int) -> Callable[[Any, str], int]:
    """Return the check of an integer in [low, high]."""
    return partial(as_int, low=low, high=high)


def real(low: float, high: float) -> Callable[[Any, str], float]:
    """Return the check of a number in [low, high]."""
    return partial(as_float, low=low, high=high)


def optional(check: Callable[[Any, str], T]) -> Callable[[Any, str], T | None]:
    """Return a check that also accepts None."""
    return lambda value, name: None if value is None else check(value, name)


def choice(*allowed: str) -> Callable[[Any, str], Any]:
    """Return the check of one of some names."""
    return partial(as_choice, allowed=allowed)


def method(*allowed: str | None) -> Callable[[Any, str], Any]:
    """Return the check of the name of an algorithm."""

    def check(value: Any, name: str) -> Any:
        as_method(value, *allowed)
        return value

    return check


def instance(kind: type[T]) -> Callable[[Any, str], T]:
    """Return the check of options that are an instance of a class."""

    def check(value: Any, name: str) -> T:
        if not isinstance(value, kind):
            raise InvalidInput(f"{name}: must be {kind.__name__}(...), got {value!r}")
        return value

    return check


def as_weight(value: object, name: str) -> float:
    """Check the weight of the original values in a colour correction. None is 0, which corrects nothing."""
    return as_float(0.0 if value is None else value, name, 0, 1e6)


def periodic(usual: bool | None = None, axes: int = 2) -> Callable[[Any, str], Any]:
    """Return the check of the axes that are periodic. None stands for the default."""
    return partial(as_wrap, usual=usual, axes=axes)


truth = optional(as_bool)
"""Check of True, False or None."""
SEED: Word[int, int] = Word(as_seed, default=0)
PROGRESS: Word[Progress | bool | None, Progress | None] = Word(lambda value, name: listen(value), default=None)

"""Generate the options of a command from the signature and the docstring of its function.

Name, default, choices and description of a parameter are only written at the function. The command line adds the
conversion from text, which is the same for all parameters of a kind (`texrs.cli._kinds`).
"""

from __future__ import annotations

import inspect
import re
import types
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass, replace
from enum import Enum
from typing import Annotated, Any, Literal, TypeAlias, Union, get_args, get_origin

import typer

from texrs._masks import Mask
from texrs._requests import find_types
from texrs.cli._console import name_commands
from texrs.cli._kinds import KINDS, Kind
from texrs.cli._texts import About
from texrs.errors import InvalidInput

MISSING = inspect.Parameter.empty
PLACES = re.compile("X,Y|csv|WIDTHx")
"""Pattern of the forms of texts that contain places or sizes."""
LONGEST = 200
"""Maximum length of a help text, in characters."""
AMERICAN = {"color": "colour", "optimize": "optimise"}

Path: TypeAlias = tuple[str, ...]
"""Name of a parameter. If the parameter is a dataclass, the name of a field follows."""


@dataclass(frozen=True, slots=True)
class Option:
    """An option or an argument of a command."""

    path: Path
    """Path of the parameter."""
    flag: str
    """Name for users: ``--seed``, or the name of an argument in capitals."""
    type: Any
    """Type of the parameter for typer."""
    kind: Kind | None
    """Kind that converts the text to the value, or None if typer converts the text."""
    default: Any
    """Default of the function, as text. `MISSING` if the command line must provide a value."""
    required: bool
    """If True, the function does not have a default for the parameter."""
    info: Any
    """Option or argument object of typer."""

    @property
    def name(self) -> str:
        """Name of the parameter in the function of the command."""
        return "_".join(self.path)

    @property
    def argument(self) -> bool:
        """If True, this is a positional argument."""
        return not self.flag.startswith("--")

    @property
    def file(self) -> bool:
        """If True, the value is read from a file that the text names."""
        return self.kind is not None and self.kind.file

    def name_value(self, text: object) -> str:
        """Return the name of the value in errors: the given file, or the option."""
        texts = text if isinstance(text, list) else [text]
        if self.kind is None or not self.kind.file or any(t is None or t in self.kind.words for t in texts):
            return self.flag
        return " ".join(map(str, texts))

    def make_parameter(self) -> inspect.Parameter:
        """Return the parameter that defines this option for typer."""
        # An option that is not required can be None, which typer must accept.
        annotation: Any = Annotated[self.type if self.default is MISSING else self.type | None, self.info]
        return inspect.Parameter(self.name, inspect.Parameter.KEYWORD_ONLY, default=self.default, annotation=annotation)


class Options:
    """All options that a function has on the command line.

    Parameters
    ----------
    function : callable
        Function with type annotations and a numpydoc docstring. A parameter that is a dataclass gives an option for
        each field.
    arguments : mapping
        Names of the positional parameters, and their kinds.
    kinds : mapping
        Kinds of parameters that neither the type nor the name determines.
    names : mapping
        Names of options that differ from the names of their parameters. For a dataclass, the prefix of its fields.
    leave : mapping
        Parameters without an option, each with the reason. Fields are written ``parameter.field``.
    makers : mapping
        Functions that compute a parameter from several options, if calling the dataclass is not sufficient.
    only : collection of str
        Parameters to include. Default: all.
    optional : mapping
        Parameters whose default is chosen by the command, and the text that describes it. If they are not given, the
        function gets no value for them.
    axes : {2, 3}
        Number of axes of the function's result.

    """

    def __init__(
        self,
        function: Callable[..., Any],
        *,
        arguments: Mapping[str, Kind] | None = None,
        kinds: Mapping[str, Kind] | None = None,
        names: Mapping[str, str] | None = None,
        leave: Mapping[str, str] | None = None,
        makers: Mapping[str, Callable[..., Any]] | None = None,
        only: Collection[str] = (),
        optional: Mapping[str, str] | None = None,
        axes: int = 2,
    ) -> None:
        self.function, self.axes = function, axes
        self.leave = {"progress": "the command line shows progress itself", **(leave or {})}
        self._arguments, self._names, self.optional = dict(arguments or {}), dict(names or {}), dict(optional or {})
        self._kinds = self._arguments | dict(kinds or {})
        self.groups: dict[str, Any] = dict(makers or {})
        found = list(self._find(only))
        flags = {path[-1]: self._make_flag(path) for path, _, _ in found}
        self.all = tuple(self._make_option(*each, flags) for each in found)

    def __iter__(self) -> Iterator[Option]:
        return iter(self.all)

    def name_values(self, given: Mapping[str, Any]) -> dict[str, str]:
        """Return the names of parameters in errors: the given file or the option, or all given options of a dataclass."""
        called = {option.path[-1]: option.name_value(given[option.name]) for option in reversed(self.all)}
        for name in self.groups:
            inside = [o for o in self if o.path[0] == name and len(o.path) == 2]
            used = [o for o in inside if given[o.name] not in (None, o.default)]
            there = [o.name_value(given[o.name]) for o in used if o.file or not any(i.file for i in inside)]
            there = there or [o.name_value(given[o.name]) for o in inside if o.argument]
            called |= {name: " and ".join(there)} if there else {}
        return called

    def read(
        self, given: Mapping[str, Any], about: About | None = None, *, which: Callable[[Option], bool] | None = None
    ) -> dict[Path, Any]:
        """Convert the given options to values. Options that are not given are omitted."""
        values = {}
        for option in self:
            text = given[option.name]
            if (which and not which(option)) or text is None or text == [] or text == option.default:
                continue
            if text == "default" and option.kind is not None and "default" in option.kind.words:
                continue
            if option.kind is None or (isinstance(text, str) and text in option.kind.words):
                values[option.path] = text
            else:
                known = about or About(axes=self.axes)
                values[option.path] = option.kind.read(text, replace(known, option=option.flag))
        return values

    def call(self, values: Mapping[Path, Any]) -> dict[str, Any]:
        """Return the arguments of the function for given values. Fields of a dataclass become a single argument."""
        made = {path[0]: value for path, value in values.items() if len(path) == 1}
        for name, group in self.groups.items():
            fields = {path[1]: value for path, value in values.items() if len(path) == 2 and path[0] == name}
            for option in self:
                if fields and option.path[0] == name and option.required and option.path not in values:
                    given = next(o.flag for o in self if o.path == (name, next(iter(fields))))
                    raise InvalidInput(f"{given}: must be combined with {option.flag}")
            if fields:
                # Pass the number of axes, because the user cannot choose it.
                known = {"axes": self.axes} if "axes" in inspect.signature(group).parameters else {}
                made[name] = group(**fields, **known)
        return made

    def _find(self, only: Collection[str]) -> Iterator[tuple[Path, inspect.Parameter, str]]:
        """Yield each parameter, or each field of a dataclass, with its description."""
        texts = describe(self.function)
        known = inspect.signature(self.function, eval_str=True).parameters
        types_ = find_types(self.function.request) if hasattr(self.function, "request") else {}
        for name, each in ((n, p.replace(annotation=types_.get(n, p.annotation))) for n, p in known.items()):
            if each.kind is each.VAR_KEYWORD or name == "self" or name in self.leave or (only and name not in only):
                continue
            group: Any = next((t for t in _split_union(each.annotation) if is_dataclass(t)), self.groups.get(name))
            # A mask that is not a hole is an ordinary option. A hole also gets the options of `Mask`.
            if group is None or name in self._kinds or (group is Mask and f"{name}.marks" not in self._arguments):
                yield (name,), each, texts.get(name, "")
                continue
            self.groups.setdefault(name, group)
            inner = describe(group)
            for part, one in inspect.signature(group, eval_str=True).parameters.items():
                if f"{name}.{part}" not in self.leave and part != "axes":
                    text = texts if f"{name}.{part}" in self._arguments else inner
                    yield (name, part), one, text.get(name if text is texts else part, "")

    def _make_flag(self, path: Path) -> str:
        name = self._names.get(".".join(path))
        if name is None:
            before = self._names.get(path[0], "") if len(path) == 2 else ""
            name = "-".join(part for part in (before, path[-1]) if part)
        return name.upper() if ".".join(path) in self._arguments else "--" + name.replace("_", "-")

    def _make_option(self, path: Path, parameter: inspect.Parameter, text: str, flags: Mapping[str, str]) -> Option:
        default, flag, name = parameter.default, self._make_flag(path), path[-1]
        required = default is MISSING
        kind, type_ = self._find_kind(path, parameter)
        if name in self.optional or (required and len(path) == 2 and flag.startswith("--")):
            default = None
        if kind is not None and default is not None and default is not MISSING:
            default = kind.show(default)
        elif kind is not None and "default" in kind.words and name not in self.optional:
            default = "default"
        shown = self.optional.get(name) or default not in (None, MISSING)
        # Do not show "[default: default]", because it does not describe the value.
        shows = flag.startswith("--") and bool(shown) and default != "default"
        # If the command describes its own default, drop the sentence about the default of the function.
        stated = MISSING if self.optional.get(name) else parameter.default
        words = () if kind is None or kind.file else kind.pick(kind.metavar, self.axes).split("|")
        texts = (
            _shorten(text, flags, flag if type_ is bool else "", stated, words, shown=shows),
            kind.pick(kind.note, self.axes) if kind else "",
        )
        help_ = " ".join(t for t in texts if t)
        if kind is not None and PLACES.search(kind.pick(kind.metavar, self.axes)):
            # Drop the order of coordinates from the description, because x or the width is first on the command line.
            help_ = re.sub(r" \((?:plane, )?row, column\)| \((?:planes, )?rows, columns\)", "", help_)
            help_ = help_.replace("Plane, row and column", "Place")
        if not flag.startswith("--"):
            info: Any = typer.Argument(metavar=flag, help=help_, show_default=False)
        else:
            both = f"{flag}/--no-{flag.removeprefix('--')}" if type_ is bool else flag
            metavar = kind.pick(kind.metavar, self.axes) if kind else None
            panel = path[0].replace("_", " ").capitalize() if len(path) == 2 else None
            # Do not show "[default: default]", because the text of the option describes the default.
            shown = False if default == "default" else shown
            info = typer.Option(both, metavar=metavar, help=help_, show_default=shown, rich_help_panel=panel)
        return Option(path, flag, type_, kind, default, required, info)

    def _find_kind(self, path: Path, parameter: inspect.Parameter) -> tuple[Kind | None, Any]:
        """Return the kind of a value, found by command, type or name, and the type for typer."""
        type_, named = _find_type(parameter.annotation, parameter.default), KINDS.get(path[-1])
        kind = self._kinds.get(".".join(path)) or (type_ if isinstance(type_, Kind) else None)
        if kind is None and named is not None and (named.plain or type_ is None):
            kind = named
        if kind is None and type_ is None:
            raise TypeError(
                f"{self.function.__name__}: the parameter {'.'.join(path)} has neither a known type nor a kind"
            )
        return kind, type_ if kind is None else list[str] if kind.many else str


def make_parameter(name: str, annotation: Any, default: Any = MISSING) -> inspect.Parameter:
    """Return a parameter of a command that its function does not have."""
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def as_command(work: Callable[..., None], parameters: Iterable[inspect.Parameter]) -> Callable[..., None]:
    """Return a function with the given parameters as signature, which typer reads."""

    def command(**given: Any) -> None:
        work(**given)

    several = list(parameters)
    command.__signature__ = inspect.Signature(several)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in several}
    return command


def take_options(*several: Options) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Add the options of functions to a command.

    The command gets the texts of the options as ``given``, for `Options.read`.

    The options replace ``given`` in the signature of the command. Positional arguments come first.
    """
    options: dict[str, list[Option]] = {}
    for option in (o for each in several for o in each):
        options.setdefault(option.name, []).append(option)
    made = []
    for alike in options.values():
        one, defaults = alike[0], list(dict.fromkeys(o.default for o in alike))
        if len(defaults) > 1:
            one.info.show_default = " or ".join(map(str, defaults))
            one = replace(one, default=None)
        made.append((one.argument, one.make_parameter()))

    def wrap(work: Callable[..., None]) -> Callable[..., None]:
        def command(**all_: Any) -> None:
            given = {name: all_.pop(name) for name in options}
            work(**all_, given=given)

        own = list(inspect.signature(work, eval_str=True).parameters.values())
        place = next(i for i, p in enumerate(own) if p.name == "given")
        own[place : place + 1] = [p for argument, p in made if not argument]
        return as_command(
            command, [p for argument, p in made if argument] + [p.replace(kind=p.KEYWORD_ONLY) for p in own]
        )

    return wrap


def check_needed(given: Mapping[str, Any], owners: Mapping[str, Iterable[Option]], used: str) -> None:
    """Raise an error for options that only apply to another choice than the requested one."""
    free = {option.name for option in owners.get(used, ())}
    for option in (o for each in owners.values() for o in each if o.name not in free):
        if given[option.name] not in (None, option.default):
            wanted = " or ".join(flag for flag, each in owners.items() if option.name in {o.name for o in each})
            raise InvalidInput(f"{option.flag}: must be used with {wanted}{f', got {used}' if used else ''}")


# --- types -----------------------------------------------------------------------------------------------------------


def _split_union(annotation: Any) -> tuple[Any, ...]:
    """Return the types of a union, or a tuple of the type itself if it is not a union."""
    return get_args(annotation) if get_origin(annotation) in (Union, types.UnionType) else (annotation,)


def _find_type(annotation: Any, default: Any) -> Any:
    """Return the type that typer can convert, the kind of a choice of words, or None for other types."""
    parts = [part for part in _split_union(annotation) if part is not types.NoneType]
    if all(get_origin(part) is Literal for part in parts):
        return make_choice([word for part in parts for word in get_args(part)], optional=default is None)
    members = next((part for part in parts if isinstance(part, type) and issubclass(part, Enum)), None)
    if members is not None:
        return make_choice([str(member.value) for member in members], members, optional=default is None)
    return parts[0] if len(parts) == 1 and parts[0] in (bool, int, float, str) else None


def make_choice(words: Sequence[str], make: Callable[[str], Any] | None = None, *, optional: bool = False) -> Kind:
    """Return the kind of a choice of words. If there is a ``default`` word, it represents None."""
    allowed = ["default", *words] if optional else list(words)
    chosen = make or {word: word for word in words}.__getitem__

    def read(text: str, about: About) -> Any:
        try:
            return chosen(AMERICAN.get(text, text))
        except (KeyError, ValueError):
            wanted = ", ".join(allowed)
            raise InvalidInput(f"{about.option}: must be one of {wanted}; got {text!r}") from None

    def show(value: Any) -> str:
        return str(getattr(value, "value", value))

    return Kind("|".join(allowed), read, show=show, words=("default",) if optional else ())


# --- docstrings ------------------------------------------------------------------------------------------------------


def describe(function: Callable[..., Any]) -> dict[str, str]:
    """Return the descriptions of parameters, or of the attributes of a class, from a docstring."""
    found: dict[str, str] = {}
    names: list[str] = []
    section = ""
    lines = (inspect.getdoc(function) or "").splitlines()
    for line, after in zip(lines, [*lines[1:], ""], strict=True):
        if after and not after.strip("-"):
            section, names = line, []
        elif section in ("Parameters", "Attributes") and line.strip("-"):
            if line.startswith(" "):
                found |= {name: f"{found[name]} {line.strip()}".strip() for name in names}
            else:
                names = [name.strip() for name in line.partition(" : ")[0].split(",")]
                found |= dict.fromkeys(names, "")
    return found


def _shorten(
    text: str, flags: Mapping[str, str], flag: str, default: Any, words: Collection[str], *, shown: bool
) -> str:
    """Shorten a description to one or two sentences, or one for each word, in the terms of the command line.

    A last sentence "Default: ..." is kept, unless the option shows its default.
    """
    # Drop references and types of arrays, which are only useful in the documentation.
    text = re.sub(r"\s*\((?:see )?(?:`|section|Eq\.)[^)]*\)|\s*\[\d+\]_|[:;,] see `texrs[^`]*`", "", text)
    text = re.sub(r",? of any real dtype(?: and number of channels)?|, any real dtype", "", text)
    # Drop the description of None unless it is the default, because users cannot give None.
    beside = ("See ", "Python ", "`texrs.", "A `texrs.", *(() if default is None else ("None",)))
    first, *further = re.split(r"(?<=[.])\s+(?=[A-Z\"`])", text)
    last = [further.pop()] if further and further[-1].startswith("Default: ") else []
    if "yes" in words:
        further = [re.sub(r"\bFalse\b", "no", re.sub(r"\bTrue\b", "yes", each)) for each in further]
    if len(first) > LONGEST:
        ends = [m.start() for m in re.finditer("[:;] ", first[:LONGEST]) if first[: m.start()].count("``") % 2 == 0]
        first = f"{first[: ends[-1]]}." if ends else first
    of_words = [s for s in further if re.match(r"\W*(\w*)", s)[1] in words]  # type: ignore[index]
    second = next((s for s in further if not s.startswith(beside)), "")
    short = [first, second] if second and len(first + second) < LONGEST else [first]
    chosen = " ".join([*([first, *of_words] if of_words else short), *([] if shown else last)])
    chosen = re.sub(r"``(\w+)``", lambda found: flags.get(found[1], found[1]), chosen)
    chosen = re.sub(r"``(\w+)=\"([\w-]+)\"``", lambda found: f"{flags.get(found[1], found[1])} {found[2]}", chosen)
    if flag:
        chosen = re.sub(r"\bFalse\b", f"--no-{flag[2:]}", re.sub(r"\bTrue\b", flag, chosen))
    chosen = re.sub(r"(?<=[;:] )None\b", "the default", re.sub(r"(^|(?<=[.] ))None\b", "The default", chosen))
    return name_commands(re.sub(r"`|(?<!\w)\"(?=\w)|(?<=\w)\"(?!\w)", "", chosen))

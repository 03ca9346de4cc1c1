"""Decorator with which verbs accept materials in place of images."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, cast

from texrs import _palettes
from texrs._arrays import as_image
from texrs._notices import Notices, collect, repeat
from texrs._progress import listen
from texrs._requests import Request, describe, make_signature
from texrs._typing import Array, Progress
from texrs.errors import InvalidInput, LimitExceeded
from texrs.materials.material import Material, apply_materials, guide_materials
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["takes_materials", "verb"]

if TYPE_CHECKING:
    from texrs.elements import ElementAnalysis

P = ParamSpec("P")
R = TypeVar("R", bound=Request)
T = TypeVar("T")
PARAMETERS = "    {parameters}\n"
"""Line of a docstring that `verb` replaces by the descriptions of the parameters."""


def verb(kind: Callable[P, R], *names: str, **options: Any) -> Callable[[Callable[[R], T]], Callable[P, T]]:
    """Make a public verb from a function of a request.

    Parameters
    ----------
    kind : class
        Class of the request, whose fields are the parameters of the verb (`texrs._requests`).
    *names : str
        Names of the parameters that are exemplars, see `takes_materials`.
    **options
        Options of `takes_materials`.

    Returns
    -------
    callable
        Decorator. The verb has the signature of the request, and its descriptions of the parameters in place of the
        line ``{parameters}`` of the docstring. It checks its arguments, and calls the function with the request.

    """

    def decorate(work: Callable[[R], T]) -> Callable[P, T]:
        @wraps(work)
        def run(*args: P.args, **kwargs: P.kwargs) -> T:
            return work(kind(*args, **kwargs))

        run.__signature__ = make_signature(kind, work.__annotations__["return"])  # type: ignore[attr-defined]
        run.request = kind  # type: ignore[attr-defined]
        # Python removes docstrings with the option -OO.
        if run.__doc__ is not None:
            run.__doc__ = run.__doc__.replace(PARAMETERS, "".join(f"    {line}\n" for line in describe(kind)))
        return takes_materials(*names, **options)(run) if names else run

    return decorate


def takes_materials(
    *names: str,
    beside: tuple[str, ...] = (),
    analysed: bool = False,
    check: Callable[[dict[str, Any]], None] = lambda given: None,
) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Make a verb accept materials as examples. It decides from their guide images, and all maps follow the result.

    Parameters
    ----------
    *names : str
        Names of the parameters that are exemplars of the verb's source map, in the order of their index. One of them
        can be a list.
    beside : tuple of str
        Names of the parameters that are used only as a reference for appearance.
    analysed : bool
        If True, the verb needs the elements of its input, which are found in the material.
    check : callable
        Function that gets the arguments of a call with materials. It raises an error for arguments that are only valid
        for images.

    Returns
    -------
    callable
        Decorator for functions that return a `texrs.Synthesis` or an iterator of them. It sets ``material``, and sets
        ``image`` to the map that represents the material.

    Raises
    ------
    InvalidInput
        Some exemplars are materials and others are not, or their maps differ.

    """

    def decorate(verb: Callable[P, T]) -> Callable[P, T]:
        signature = inspect.signature(verb)
        usual = {name: parameter.default for name, parameter in signature.parameters.items()}

        @wraps(verb)
        def run(*args: P.args, **kwargs: P.kwargs) -> T:
            # Repeat the notices of the inputs, so that the report contains them even if an input was read earlier.
            with collect() as notices:
                for value in (*args, *kwargs.values()):
                    for each in _as_list(value):
                        if isinstance(each, Material):
                            repeat(each.notices)
                made: Any = synthesise(*args, **kwargs)
            return cast(T, _report(made, notices))

        def synthesise(*args: P.args, **kwargs: P.kwargs) -> T:
            given = signature.bind(*args, **kwargs)
            if not any(_holds(value) for value in (*args, *kwargs.values())):
                palette = _palettes.find(given.arguments, names, usual)
                plain: Any = verb(*given.args, **given.kwargs)
                if palette is not None:
                    plain = palette.keep(plain) if isinstance(plain, Synthesis) else map(palette.keep, plain)
                return cast(T, plain)
            watch = given.arguments["progress"] = listen(given.arguments.get("progress"))
            for name in beside:
                if isinstance(given.arguments.get(name), Material):
                    other = given.arguments[name]
                    given.arguments[name] = _analyse(other, other.guide, name, watch) if analysed else other.guide
            # Replace each material by its guide image, which combines all its maps.
            used = [name for name in names if given.arguments.get(name) is not None]
            several = [m for name in used for m in _as_list(given.arguments[name])]
            if not any(isinstance(m, Material) for m in several):
                return verb(*given.args, **given.kwargs)
            materials = _check(several, used)
            check(given.arguments)
            lit = given.arguments.get("flatten_lighting")
            guides = iter(guide_materials([m.flatten_lighting() for m in materials] if lit is True else materials))
            for name in used:
                value = given.arguments[name]
                if analysed:
                    given.arguments[name] = _analyse(value, next(guides), name, watch)
                else:
                    given.arguments[name] = (
                        [next(guides) for _ in value] if isinstance(value, list | tuple) else next(guides)
                    )
            if lit is True:
                # Light is not flattened again, because the guide image already has even light.
                given.arguments["flatten_lighting"] = False
            made: Any = verb(*given.args, **given.kwargs)
            if lit is True:
                made = replace(
                    made, source_map=_flattened(made.source_map), report={**made.report, "flatten_lighting": True}
                )
            # Apply the source map of the guide images to all maps of the materials.
            if isinstance(made, Synthesis):
                return cast(T, finish(made, materials, watch))
            return cast(T, (finish(one, materials, watch) for one in made))

        run.takes = names  # type: ignore[attr-defined]
        return run

    return decorate


def finish(made: Synthesis, materials: list[Material], progress: Progress | None) -> Synthesis:
    """Convert the result of a verb on guide images to the result on their materials."""
    made = _palettes.keep_material(made, materials)
    material = apply_materials(materials, made.source_map, progress)
    stages = {"guide" if name == "before_blending" else name: stage for name, stage in made.stages.items()}
    maps = {name: each.role.value for name, each in material.items()}
    return replace(
        made,
        image=material.base,
        stages={**stages, "before_blending": material.base},
        report={**made.report, "maps": maps},
        material=material,
    )


def _report(made: Any, notices: Notices) -> Any:
    """Add notices to the reports of results."""
    if isinstance(made, Synthesis):
        return replace(made, report=notices.add_to(made.report)) if notices else made
    return _report_each(made, notices)


def _report_each(made: Iterator[Any], notices: Notices) -> Iterator[Any]:
    """Yield results one by one. Each report contains the notices of the call and of the result itself."""
    while True:
        # Close the block before yielding, so that it does not collect notices of the caller.
        with collect() as own:
            one = next(made, None)
        if one is None:
            return
        yield _report(_report(one, notices), own)


def _analyse(material: object, guide: Array, name: str, progress: Progress | None) -> ElementAnalysis:
    """Return the elements of a material, compared by all its maps."""
    # Import elements only here, because most verbs do not need them.
    from texrs.elements import analyse

    try:
        return replace(analyse(material, progress=progress), image=as_image(guide))
    except LimitExceeded:
        raise
    except InvalidInput as error:
        raise InvalidInput(f"{name}: {error}; pass a box, points or a mask to texrs.elements.analyse") from None


def _flattened(source: SourceMap) -> SourceMap:
    """Return a copy of a source map whose finish also removes uneven light."""
    assert source.finish is not None
    return replace(source, finish=replace(source.finish, flatten_lighting=True))


def _as_list(value: object) -> list[object]:
    return list(value) if isinstance(value, list | tuple) else [value]


def _holds(value: object) -> bool:
    """Return True if a value is a material, or a list that contains one."""
    return any(isinstance(each, Material) for each in _as_list(value))


def _check(several: list[object], names: list[str]) -> list[Material]:
    """Check that all exemplars are materials, and return them."""
    materials = [each for each in several if isinstance(each, Material)]
    if len(materials) < len(several):
        raise InvalidInput(
            f"{', '.join(names)}: must either all be materials or all be images, got {len(materials)} materials of "
            f"{len(several)}"
        )
    return materials

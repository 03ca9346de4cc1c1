"""Descriptions of parameters that several functions share."""

from __future__ import annotations

import re
from collections.abc import Callable
from textwrap import indent
from typing import Any, TypeVar

__all__ = ["share_words"]

F = TypeVar("F", bound=Callable[..., Any])
WORDS = {
    "scheduler": """Scheduler of the work. An integer is a number of processes of this machine, which a script must start under
``if __name__ == "__main__":``. An address or a client is a Dask cluster, whose workers need access to the same folders.
Default: this process.""",
    "threads": "Number of threads of each worker. Default: the workers share the cores.",
    "overwrite": "If True, replace existing data of another computation. Default: False.",
    "progress": """Function that is called with the stage and the completed share. If it raises an exception, the work stops.
True shows a bar. Default: no report.""",
    "chunks": "Samples of a chunk along each axis. Default: 512 for images, 128 for volumes.",
    "levels": """Number of resolutions, each half of the previous one. Default: as many as are needed until one chunk holds the
image.""",
    "unit": 'Unit of the spacing, such as "micrometer". Default: none.',
    "map": "Name of a map of a material. Default: the map that shows the texture.",
}


def share_words(function: F) -> F:
    """Insert shared descriptions into a docstring, wherever ``{name}`` is alone on a line.

    Examples
    --------
    >>> @share_words
    ... def store():
    ...     '''Store.
    ...
    ...     threads : int
    ...         {threads}
    ...     '''
    >>> print(store.__doc__.splitlines()[3].strip())
    Number of threads of each worker. Default: the workers share the cores.

    """
    # Python removes docstrings with the option -OO.
    if function.__doc__ is not None:
        function.__doc__ = re.sub(
            r"^( *)\{(\w+)\}$", lambda found: indent(WORDS[found[2]], found[1]), function.__doc__, flags=re.MULTILINE
        )
    return function

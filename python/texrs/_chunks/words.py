"""What parameters that several functions share are for, said once."""

from __future__ import annotations

import re
from collections.abc import Callable
from textwrap import indent
from typing import Any, TypeVar

__all__ = ["share_words"]

F = TypeVar("F", bound=Callable[..., Any])
WORDS = {
    "scheduler": """None: this process. A number: so many processes of this machine, which a script must start under
``if __name__ == "__main__":``. An address, or a client: the workers of that cluster, which see the same folders.""",
    "threads": "Of each worker; by default the cores are shared out.",
    "overwrite": "Whether what is there, and is not of the same, is replaced.",
    "progress": "Called with the stage and the share of it that is done; raising stops the work. True shows a bar.",
    "chunks": "Of a chunk; 512 each in pictures and 128 in volumes by default.",
    "levels": "How many resolutions, each half of the one before; by default until one chunk holds all.",
    "unit": 'Of the spacing, such as "micrometer".',
    "map": "Of a material, the map; by default the one that shows it.",
}


def share_words(function: F) -> F:
    """Put the shared words into a docstring, where the name of a parameter stands in braces on a line of its own.

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
    Of each worker; by default the cores are shared out.

    """
    # Python may have been told to leave docstrings out.
    if function.__doc__ is not None:
        function.__doc__ = re.sub(
            r"^( *)\{(\w+)\}$", lambda found: indent(WORDS[found[2]], found[1]), function.__doc__, flags=re.MULTILINE
        )
    return function

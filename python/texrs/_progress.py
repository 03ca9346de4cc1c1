"""Stages of long work, as kernels report them."""

from __future__ import annotations

from collections.abc import Callable

from texrs._typing import Progress


def stage(progress: Progress | None, name: str) -> Callable[[float], object] | None:
    """Return what a kernel may call with the share that is done of a stage, or none where nobody listens."""
    if progress is None:
        return None
    progress(name, 0.0)  # Short work may be done before it is asked how far it is.
    return lambda share: progress(name, share)

"""Version of the package. It is read from the compiled kernels, so that the two cannot differ."""

from texrs._rust import VERSION as __version__

__all__ = ["__version__"]

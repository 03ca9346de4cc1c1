"""Exemplars in several sizes, packed side by side: what an output takes its texels from.

Where an exemplar's texels have many sizes, little of it has the one that is wanted at a point. Copies of it, enlarged and
reduced, add to that: each has the scale map of its own. They are packed into one sheet and analysed at every resolution;
windows that leave a copy, or touch what must not be copied, are barred.
"""

from texrs.supply._grow import LEAST, Grown, Settings, Supply, levels_of
from texrs.supply._sheet import LARGEST, RADIUS, SMALLEST, Copy, reaching

__all__ = ["LARGEST", "LEAST", "RADIUS", "SMALLEST", "Copy", "Grown", "Settings", "Supply", "levels_of", "reaching"]

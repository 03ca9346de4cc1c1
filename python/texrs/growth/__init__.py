"""Exemplars in several sizes, packed side by side: what an output takes its elements from.

Where an exemplar's elements have many sizes, little of it has the one that is wanted at a point. Copies of it, enlarged and
reduced, add to that: each has the scale map of its own. They are packed into one sheet and analysed at every resolution;
windows that leave a copy, or touch what must not be copied, are barred.
"""

from texrs.exemplar.atlas import LARGEST, RADIUS, SMALLEST, Copy, reaching
from texrs.growth.supply import LEAST, Grown, Settings, Supply, levels_of

__all__ = ["LARGEST", "LEAST", "RADIUS", "SMALLEST", "Copy", "Grown", "Settings", "Supply", "levels_of", "reaching"]

"""The coarse-to-fine engine: textures grown by corrected coordinates, in two and three dimensions.

`texrs.growth.engine` is the loop over the levels, which takes a start, a corrector, and what is asked of the output
beside the texture; `windows` is the engine's own start and corrector; `start` holds the other starts, `constraints`
what may be asked, `sheets` patches of the sizes that a map asks for, `scales` growth from an atlas of scaled copies, and
`settings` the numbers.
"""

from texrs.growth.constraints import Conditions, Constraints, Guide, Surroundings
from texrs.growth.engine import Grown, Patches, Start, grow, keep
from texrs.growth.scales import FROM_ATLAS, grow_from_atlas
from texrs.growth.settings import Settings
from texrs.growth.sheets import FromSheet, stitch_sheet
from texrs.growth.start import from_draft, from_patches, patch_side
from texrs.growth.windows import Windows

__all__ = [
    "FROM_ATLAS",
    "Conditions",
    "Constraints",
    "FromSheet",
    "Grown",
    "Guide",
    "Patches",
    "Settings",
    "Start",
    "Surroundings",
    "Windows",
    "from_draft",
    "from_patches",
    "grow",
    "grow_from_atlas",
    "keep",
    "patch_side",
    "stitch_sheet",
]

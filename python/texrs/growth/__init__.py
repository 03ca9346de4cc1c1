"""The coarse-to-fine engine: synthesis by correcting source coordinates, in two and three dimensions.

`texrs.growth.engine` contains the loop over the levels. Its inputs are a start, a corrector and the constraints of the
output. `windows` contains the engine's own start and corrector, and `start` the other starts. `constraints` contains
the constraints of an output, and `settings` the settings. `sheets` stitches patches whose sizes follow a scale map,
and `scales` synthesises from an atlas of scaled copies.
"""

from texrs.growth.constraints import Conditions, Constraints, Guide, Surroundings
from texrs.growth.engine import Grown, Patches, Start, grow, keep
from texrs.growth.scales import FROM_ATLAS, grow_from_atlas
from texrs.growth.settings import Settings
from texrs.growth.sheets import FromSheet, stitch_sheet
from texrs.growth.start import from_draft, from_patches, patch_side, stitch_image
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
    "stitch_image",
    "stitch_sheet",
]

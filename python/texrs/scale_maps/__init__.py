"""Scale maps: how large the elements are at each place of a picture.

A scale map is a float32 array (rows, columns) that is 1 where elements have their normal size, 2 where they are seen
twice as large. Only ratios count, so maps that are measured have a geometric mean of 1. Everything here takes maps
and gives new ones; nothing is changed in place.

===================  ==========================================================================
`ScaleMap`           an array that says whether it holds widths, or square roots of areas
`from_mask`          the map measured from a mask of features
`auto_mask`          a mask of features, found in the picture
`Measuring`          how a map is measured in such a mask, where nobody gives one
`from_angles`        the map of a plane seen aslant
`slant_for_ratio`    the slant at which near elements are so many times as large as far ones
`resample`           a map for another size: stretched, continued, drawn or by angles
`extend`             a map continued into what is not known
`edit`               a map changed by a list of edits
`jacobians_of_...`   how surfaces are seen, by their normals or by the UV coordinates of a mesh
`encode` `decode`    8-bit pictures of maps, for other programs
`picture`            false colours with a scale bar, to look at
===================  ==========================================================================

What is seen aslant is as wide as it is near, and foreshortened besides: maps of widths (`from_angles`) are linear in the
picture of a plane, and maps of areas (`from_mask`), which hold their square roots, are the power 3/2 of those. What makes maps
gives a `ScaleMap`, which says which of them it is, and PNG and TIFF files keep that; of other arrays it is told by which fits.

Two angles say how a plane lies. `slant` is that between the line of sight and the plane's normal: 0 is seen from the
front, 85 nearly edge on. `tilt` is the direction in the picture in which depth grows, in degrees counter-clockwise from
the right (+x) with y up: a floor that runs away upwards has 90. Dong, Zhou and Paul [1]_ measure it from +y towards +x,
so theirs is 90 - tilt.

References
----------
.. [1] W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24, 2008.
   :doi:`10.1007/s00371-008-0232-1`
"""

from texrs.scale_maps._angles import MAX_SLANT, from_angles, slant_for_ratio
from texrs.scale_maps._auto import auto_mask
from texrs.scale_maps._edit import edit
from texrs.scale_maps._extrapolation import extend
from texrs.scale_maps._false_colours import Encoding, decode, encode, picture
from texrs.scale_maps._jacobians import jacobians_of_coordinates, jacobians_of_normals
from texrs.scale_maps._kinds import ScaleMap
from texrs.scale_maps._maps import MAX_SCALE, MIN_SCALE
from texrs.scale_maps._mask import Measure, from_mask
from texrs.scale_maps._measuring import Measuring
from texrs.scale_maps._resample import resample
from texrs.scale_maps._trend import Trend

__all__ = [
    "MAX_SCALE",
    "MAX_SLANT",
    "MIN_SCALE",
    "Encoding",
    "Measure",
    "Measuring",
    "ScaleMap",
    "Trend",
    "auto_mask",
    "decode",
    "edit",
    "encode",
    "extend",
    "from_angles",
    "from_mask",
    "jacobians_of_coordinates",
    "jacobians_of_normals",
    "picture",
    "resample",
    "slant_for_ratio",
]


def __dir__() -> list[str]:
    return __all__

"""Scale maps: the apparent size of the elements at each pixel of an image.

A scale map is a float32 array (rows, columns). It is 1 where elements have their normal size, and 2 where they appear
twice as large. Only ratios count, so measured maps have a geometric mean of 1. All functions return new maps and leave
their arguments unchanged.

===================  ==========================================================================
`ScaleMap`           a map that records its kind: widths, or square roots of areas
`from_mask`          a map measured from a mask of features
`auto_mask`          a mask of features, detected in the image
`Measuring`          options for detecting a mask and measuring a map in one step
`from_angles`        the map of an oblique plane
`slant_for_ratio`    the slant for a ratio of the largest to the smallest elements
`resample`           a map for another size: stretched, continued, given or from angles
`extend`             a map continued into unknown pixels
`edit`               a map changed by a list of edits
`jacobians_of_...`   Jacobians of a surface, from its normals or from UV coordinates of a mesh
`encode` `decode`    8-bit images of maps, for other programs
`picture`            a false-colour image with a scale bar
===================  ==========================================================================

Elements on an oblique plane become smaller with distance, and they are also foreshortened along the slope. Maps of
widths (`from_angles`) are linear in the image of a plane. Maps of areas (`from_mask`) contain the square roots of
areas, which are the power 3/2 of the widths. Functions that create a map return a `ScaleMap`, which records its kind,
and PNG and TIFF files keep the kind. For other arrays, texrs assumes the kind that fits a plane better.

Two angles describe the orientation of a plane. `slant` is the angle between the line of sight and the plane's normal:
0 is seen from the front, 85 nearly edge-on. `tilt` is the direction of increasing depth in the image, in degrees
counter-clockwise from the right (+x) with y up. A ground plane that recedes upwards has 90. Dong, Zhou and Paul [1]_
measure the tilt from +y towards +x, so their angle is 90 - tilt.

References
----------
.. [1] W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24, 2008.
   :doi:`10.1007/s00371-008-0232-1`
"""

from texrs.scale_maps._angles import MAX_SLANT, from_angles, slant_for_ratio
from texrs.scale_maps._edit import edit
from texrs.scale_maps._extrapolation import extend
from texrs.scale_maps._false_colours import Encoding, decode, encode, picture
from texrs.scale_maps._mask import Measure, from_mask
from texrs.scale_maps._measuring import Measuring
from texrs.scale_maps.auto import auto_mask
from texrs.scale_maps.jacobians import jacobians_of_coordinates, jacobians_of_normals
from texrs.scale_maps.kinds import ScaleMap
from texrs.scale_maps.maps import MAX_SCALE, MIN_SCALE
from texrs.scale_maps.resampling import resample
from texrs.scale_maps.trend import Trend

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

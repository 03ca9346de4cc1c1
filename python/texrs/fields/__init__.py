"""Frame fields: rotation, scale and shear of a texture at each point of the output.

A `Field` gives a matrix F, the frame, for any point of the output. The columns of F are the directions of the
exemplar's axes in the output. A column of length 2 means features twice as large along this axis. The inverse J = F^-1
converts steps in the output to steps in the exemplar, and source maps store J. Points are (row, column) or (plane,
row, column) in voxels of the output, with centres at the integers. The letters x, y and z name the axes of columns,
rows and planes.

===================  ==========================================================================
`identity`           the orientation of the exemplar
`circular`           the texture wound round an axis
`spiral`             `circular`, rotated by an angle
`zigzag`             rotations by an angle and by its opposite, in alternate bands
`rotation`           rotation by an angle in a plane
`rotation_3d`        rotations in two planes
`shear`              shear: one axis leans towards another
`scale_ramp`         features that grow along an axis
`constant`           one matrix everywhere
`from_array`         frames on a grid of any resolution
`from_directions`    a vector at each place, completed to frames
`from_gradient`      the direction in which a map rises
`from_structure`     the grain of an image or a volume
`interpolate`        interpolation of frames that are given at points
`from_function`      a function of the point
`read`               vectors or frames from a file
===================  ==========================================================================

Instead of a field, functions also accept a text, an array of vectors or frames, or a file of such an array
(`as_field`).

A field is stored as a formula instead of a dense array of frames. Its frame at a point depends only on this point.
`parse` creates a field from a text (``zigzag:period=64,angle=30``), `names` lists the texts, and `check` finds
singular frames before a long computation.
"""

from texrs.fields._directions import from_directions, from_gradient, from_structure
from texrs.fields._given import FieldLike, as_field, read
from texrs.fields._parse import names, parse
from texrs.fields._sampled import from_array, from_function, interpolate
from texrs.fields._shapes import circular, constant, identity, rotation, rotation_3d, scale_ramp, shear, spiral, zigzag
from texrs.fields.field import LEAST_DETERMINANT, MAX_CONDITION, Field, check

__all__ = [
    "LEAST_DETERMINANT",
    "MAX_CONDITION",
    "Field",
    "FieldLike",
    "as_field",
    "check",
    "circular",
    "constant",
    "from_array",
    "from_directions",
    "from_function",
    "from_gradient",
    "from_structure",
    "identity",
    "interpolate",
    "names",
    "parse",
    "read",
    "rotation",
    "rotation_3d",
    "scale_ramp",
    "shear",
    "spiral",
    "zigzag",
]


def __dir__() -> list[str]:
    return __all__

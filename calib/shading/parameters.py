"""Places of the values of a view's shading fit in a row: its own, those that views share, those of polished balls."""

# x, y, z, log strength of white, diffuse and glossy bounce, even light, slopes along x and y, reflectance of polished
# balls, log of white patches' light, over their reflectance, over the paper's
LOCAL = 11
STRENGTH = 3  # the logarithm of white's
EVEN = 6  # which of them is light that comes from everywhere
TILTS = slice(7, 9)
THROWN = [4, 5, 9]  # those of light that balls throw
PATCHES = 10
# sample x, y, z and radius, log lamp radius, log of black over white, how narrow the lamp's beam is, how the lens
# darkens pictures aside of their middle (two terms); polished balls' values follow
SHARED = 9
BLACK, NARROW, FALLOFF = LOCAL + 5, LOCAL + 6, LOCAL + 7  # places among all values
BALL = 4  # x, y, z and radius

"""Which channels are red, green and blue."""

from itertools import permutations

import numpy as np

from photogonio.reconstruct.export.rgb import rgb_order


def test_the_three_are_found_in_whatever_order():
    for names in permutations("RGB"):
        order = rgb_order(names)
        assert tuple(np.array(names)[order]) == ("R", "G", "B")


def test_other_channels_are_no_colours():
    for names in (("Y",), ("R", "G"), ("X", "Y", "Z"), ("R", "G", "B", "IR"), ("r", "g", "b"), ()):
        assert rgb_order(names) is None

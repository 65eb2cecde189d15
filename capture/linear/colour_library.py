"""colour-science, loaded without what it changes elsewhere."""

from __future__ import annotations

from types import ModuleType

import numpy as np


def colour_science() -> ModuleType:
    """The package ``colour``, first loaded when it is asked for: that takes a while.

    It has numpy print arrays as long ago, which is the user's own choice: that stays as it is.
    """
    with np.printoptions():
        import colour
    return colour

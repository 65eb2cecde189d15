"""colour-science is loaded, and leaves numpy's printing alone."""

from __future__ import annotations

import subprocess
import sys

SAID = """
import numpy as np
from photogonio.capture.linear.colour_library import colour_science

np.set_printoptions(precision=3)
before = np.get_printoptions()
print(round(float(colour_science().delta_E([50.0, 0.0, 0.0], [51.0, 0.0, 0.0], method="CIE 1976")), 6))
assert np.get_printoptions() == before, np.get_printoptions()
"""


def test_numpy_prints_as_before():
    done = subprocess.run([sys.executable, "-c", SAID], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "1.0\n"), done.stderr

"""Classes without docstrings draw as those with: asked in processes of their own, since classes are made once."""

import subprocess
import sys

DRAW = """
import hashlib, io, sys
from photogonio.system.drawing import without_docstrings
if sys.argv[1] == "without":
    without_docstrings()
from matplotlib.figure import Figure
figure = Figure(figsize=(1, 1))
axes = figure.subplots()
axes.plot([0, 1], [0, 1])
axes.set(xlim=(0, 2))
with io.BytesIO() as stream:
    figure.savefig(stream, metadata={"Software": None})
    print(hashlib.sha256(stream.getvalue()).hexdigest(), len(type(axes).set.__doc__ or ""))
"""


def drawn(how: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", DRAW, how], check=True, capture_output=True, text=True)
    return done.stdout.split()


def test_pictures_need_no_docstrings():
    picture, length = drawn("with")
    assert int(length) > 0
    assert drawn("without") == [picture, "0"]

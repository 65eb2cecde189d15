"""Pictures are the same with docstrings of classes and without, and whatever style a user has: asked in processes of
their own, since classes are made once and styles are read once."""

import os
import subprocess
import sys

import numpy as np
import pytest
from matplotlib import rc_context, rcParams

from photogonio.report.html import image_bytes, picture_bytes
from photogonio.report.plots import scatter_figure
from photogonio.system.drawing import own_style

DRAW = """
import hashlib, io, sys
from photogonio.system.drawing import own_style, without_docstrings
if sys.argv[1] == "without":
    without_docstrings()
from matplotlib import rcParams
from matplotlib.figure import Figure
with own_style():
    figure = Figure(figsize=(1, 1))
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1])
    axes.set(xlim=(0, 2))
    with io.BytesIO() as stream:
        figure.savefig(stream, metadata={"Software": None})
        picture = hashlib.sha256(stream.getvalue()).hexdigest()
print(picture, len(type(axes).set.__doc__ or ""), rcParams["font.size"])
"""
STYLE = {
    "font.size": 30.0,
    "axes.facecolor": "black",
    "image.origin": "lower",
    "savefig.facecolor": "red",
    "savefig.bbox": "tight",
    "lines.linewidth": 9.0,
    "svg.fonttype": "none",
}


def drawn(how: str, style: str = os.devnull) -> list[str]:
    environment = os.environ | {"MATPLOTLIBRC": style}
    done = subprocess.run(
        [sys.executable, "-c", DRAW, how], check=True, capture_output=True, text=True, env=environment
    )
    return done.stdout.split()


def test_pictures_need_no_docstrings_and_heed_no_user_style(tmp_path):
    (tmp_path / "rc").write_text("".join(f"{name}: {value}\n" for name, value in STYLE.items()))
    picture, length, size = drawn("with")
    assert int(length) > 0 and float(size) == 10.0
    assert drawn("without", str(tmp_path / "rc")) == [picture, "0", "30.0"]


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_a_session_with_a_style_of_its_own_writes_the_same_and_keeps_it(kind):
    x = np.linspace(0.1, 1.0, 12)[:, None]

    def written() -> tuple[bytes, bytes]:
        with own_style():
            figure = scatter_figure(x, x**2, ("Y",))
        return picture_bytes(figure, kind=kind), image_bytes(np.linspace(0, 1, 12).reshape(2, 2, 3))

    plain = written()
    with rc_context(STYLE):
        assert written() == plain
        assert rcParams["font.size"] == 30.0

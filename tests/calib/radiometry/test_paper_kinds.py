"""Kinds of paper: a scale as unsure as papers differ, which gives way to whatever is known better."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.outcome import SHARED
from photogonio.calib.radiometry.paper_kinds import KINDS
from photogonio.calib.radiometry.patch import NoStrength
from photogonio.calib.radiometry.scale import tie
from photogonio.calib.remarks import Remarks
from photogonio.calib.rig.gaussian import RigExpected
from photogonio.capture.photoset import PAPERS, Radiometry
from tests.drawn.patches import FAR, PAPER, SET, STRENGTHS, told


def tied(kind, *, patches=False, paper=None):
    readings = told(STRENGTHS)
    if not patches:
        readings = {n: replace(r, patch=NoStrength("no patch")) for n, r in readings.items()}
    given = {n: np.ones_like(np.atleast_1d(STRENGTHS[n])) for n in readings}
    remarks, white = Remarks(), SET.white_patches if patches else ()
    photoset = replace(SET, white_patches=white, radiometry=Radiometry(paper=kind))
    values, scale = tie(photoset, readings, dict.fromkeys(readings, FAR), given, remarks, paper)
    return values, scale, remarks


def test_a_manifest_may_name_each_kind_and_no_other():
    assert tuple(KINDS) == PAPERS and all(kind.name == name for name, kind in KINDS.items())


@pytest.mark.parametrize("kind", PAPERS)
def test_a_kind_of_paper_makes_the_scale_absolute_and_its_doubt_is_common_to_all(kind):
    values, scale, remarks = tied(kind)
    (said,) = [one for one in remarks.diagnoses if one.code == "scale-by-kind-of-paper"]
    assert scale == "absolute" and said.code in SHARED
    assert said.amount == pytest.approx(KINDS[kind].error / KINDS[kind].reflectance) and said.amount >= 0.04
    true = PAPER * np.pi  # the drawn paper's
    for name, strength in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, strength * true / KINDS[kind].reflectance, rtol=1e-6)
        # each view has its own reading's error; what all share is told once, not averaged over the views
        np.testing.assert_allclose(
            values[name].error,
            tied(None)[0][name].error * values[name].value / tied(None)[0][name].value,
            rtol=1e-3,
        )
    assert "paper_reflectance" not in remarks.residuals  # which other sets of the rig would take for measured


def test_what_is_known_better_overrides_it():
    known, plain = tied("recycled", patches=True), tied(None, patches=True)
    assert known[2].codes() == plain[2].codes()
    for name in STRENGTHS:
        np.testing.assert_array_equal(known[0][name].value, plain[0][name].value)
    channels = len(np.atleast_1d(next(iter(STRENGTHS.values()))))
    rig = RigExpected("paper", np.log(np.full(channels, PAPER * np.pi)), 1e-6 * np.eye(channels), 9)
    values, _, remarks = tied("recycled", paper=rig)
    assert "scale-by-kind-of-paper" not in remarks.codes()
    for name, strength in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, strength, rtol=1e-6)


def test_without_a_kind_the_scale_stays_relative():
    assert tied(None)[1] == "relative"

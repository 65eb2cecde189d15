"""Codes that hang on what lies round about are told from codes by one curve."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.response.fit import fit_response
from photogonio.calib.response.paper_codes import PaperCodes
from photogonio.calib.response.tone import tone_local
from photogonio.capture.containers.tone import srgb
from photogonio.synthetic.render.tones import linear_to_srgb
from tests.calib.response.phones import CURVES, photos
from tests.calib.response.test_tone import TONE


def toned(one: PaperCodes, strength: float) -> PaperCodes:
    """Brighter where it is dark round about, as a phone does it on sRGB's codes."""
    place = one.points[:, :2]
    near = np.exp(-0.5 * ((place[:, None] - place) ** 2).sum(-1) / 18.0**2)
    light = srgb(one.code)
    around = near @ light.mean(1) / near.sum(1)
    gain = (around / np.median(around)) ** -strength
    return replace(one, code=linear_to_srgb(light * gain[:, None]))


def clustered(one: PaperCodes) -> PaperCodes:
    """Without black print on one side: no two places are alike in what lies round about."""
    kept = one.white | (one.points[:, 0] < 80)
    names = ("points", "white", "code", "noise", "square", "tone", "aside")
    return replace(one, **{name: getattr(one, name)[kept] for name in names})


@pytest.mark.parametrize("strength", [0.0, 0.3])
def test_white_that_is_dim_beside_white_is_toned_locally(strength):
    seen = [clustered(one) for one in photos(CURVES["srgb"], count=6, channels=1, seed=5)]
    fitted = fit_response([toned(one, strength) for one in seen])
    if strength:
        assert fitted.surround < -0.01 and fitted.misfit > 0.006
    else:
        assert abs(fitted.surround) < 0.003 and fitted.misfit < 0.003


def test_it_is_told_by_name_and_only_where_paper_misses_its_light():
    local = replace(TONE, misfit=0.02, surround=-0.08)
    found = tone_local(local)
    assert found is not None and found.code == "tone-not-global" and found.told and not found.allowed
    assert "RAW" in found.message
    for other in (replace(local, misfit=0.002), replace(local, surround=0.05), TONE):
        assert tone_local(other) is None

"""What is done to codes and light before they are written, and the curves that code them."""

import numpy as np
import pytest

from photogonio.synthetic.render.processing import finished, local_gain
from photogonio.synthetic.render.tones import CURVES, linear_to_srgb, tone_curve
from photogonio.synthetic.scene.phone import SHAPES, Denoise, LocalTone, Sharpen, ToneCurve

RAMP = np.linspace(0.0, 1.0, 2001)


def test_the_scene_names_every_curve():
    assert set(SHAPES) == set(CURVES)


@pytest.mark.parametrize("shape", SHAPES)
def test_curves_rise_from_black_to_white(shape):
    code = tone_curve(ToneCurve(shape))(RAMP)
    assert np.all(np.diff(code) > 0) and 0.0 <= code[0] <= 0.021 and code[-1] == pytest.approx(1.0)
    half = tone_curve(ToneCurve(shape, 0.5))(RAMP)
    assert half == pytest.approx(0.5 * (code + linear_to_srgb(RAMP)))
    assert tone_curve(ToneCurve(shape, 0.0))(RAMP) == pytest.approx(linear_to_srgb(RAMP))


def test_local_tone_lifts_what_is_dark_about_and_no_curve_does_the_same():
    light = np.full((100, 200, 3), 0.1)
    light[:, 100:] = 0.4
    light[40:60, 40:60] = light[40:60, 140:160] = 0.2  # the same light in dark and bright surroundings
    tone = LocalTone(strength=0.5, reach=0.05)
    gain = local_gain(tone, light)
    assert gain[50, 50] > 1.2 * gain[50, 150]
    assert local_gain(tone, np.full((50, 50, 3), 0.3)) == pytest.approx(1.0)
    # far from the step and the squares: brightness round about over its median, to the power
    middle = np.sqrt(0.1 * 0.4)
    assert gain[5, 5] / gain[5, 195] == pytest.approx(2.0, rel=0.02) and gain[5, 5] > middle**0


def test_denoising_takes_noise_and_leaves_edges_and_sharpening_gives_both():
    random = np.random.default_rng(1)
    code = np.full((60, 80, 3), 0.3)
    code[:, 40:] = 0.7
    noisy = np.clip(code + random.normal(0.0, 0.005, code.shape), 0, 1)
    smooth = finished(noisy, Denoise(code=0.03, radius=1.5), None)
    assert smooth[:, :38].std() < 0.6 * noisy[:, :38].std()
    assert np.abs(smooth[:, 39] - 0.3).max() < 0.05 and np.abs(smooth[:, 40] - 0.7).max() < 0.05
    sharp = finished(noisy, None, Sharpen(amount=1.0, radius=1.2))
    assert sharp[:, :30].std() > 1.3 * noisy[:, :30].std()
    assert sharp[:, 39].mean() < 0.25 and sharp[:, 40].mean() > 0.75  # a bright and a dark seam
    assert sharp[10:50, :30].mean() == pytest.approx(noisy[10:50, :30].mean(), abs=1e-3)
    assert np.array_equal(finished(noisy, None, None), noisy)

"""Kinds of material are what they name."""

import pytest

from photogonio.reconstruct.design.materials import MATERIALS, material, of_material, of_result


def test_a_material_has_the_albedo_that_it_names():
    assert material("matte").bihemispherical_albedo()[0] == pytest.approx(MATERIALS["matte"][0], rel=1e-6)


def test_a_result_that_knows_less_leaves_more_open():
    from dataclasses import replace

    brdf = material("satin")
    known = brdf.uncertainty
    sure = replace(brdf, uncertainty=replace(known, standard_errors=0.1 * known.standard_errors))
    plain, better = (of_result(one, turning=False).mean_variance() for one in (brdf, sure))
    assert better == pytest.approx(0.01 * plain, rel=1e-6)
    assert of_material("satin").mean_variance() > plain  # and what no parameter says


def test_a_result_without_errors_is_refused():
    from dataclasses import replace

    with pytest.raises(ValueError, match="no standard errors"):
        of_result(replace(material("satin"), uncertainty=None), turning=False)

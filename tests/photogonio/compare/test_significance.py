"""Whether two BRDFs differ by more than their errors: seldom where they do not, surely where they do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.compare import significance as module
from photogonio.compare.compare import compare
from photogonio.compare.known import Known
from photogonio.compare.significance import Side, pairs_below, significance
from photogonio.reconstruct.brdf.spread import drawn
from tests.drawn.brdfs import uncertain
from tests.drawn.exports import satin

MASK = np.radians(80.0)
AT = pairs_below(MASK, isotropic=True)


def of(brdf, name="a"):
    return Known(name, brdf.channels, True, brdf)


def sided(brdf, name="a", at=AT):
    return Side.of(of(brdf, name), [0, 1, 2], brdf(at.incident, at.exit))


def sure():
    """A satin surface whose numbers are known to some thousandths, and nothing beyond them."""
    brdf = uncertain(satin())
    known = brdf.uncertainty
    return replace(
        brdf, uncertainty=replace(known, scale=0.0, misfit=None, unseen=None, covariance=known.covariance)
    )


def test_draws_of_its_own_errors_seldom_differ(monkeypatch):
    """Of 40 draws 2 are expected at 5 %, fewer since p is bounded; 7 or more have a chance of 0.3 %."""
    monkeypatch.setattr(module, "DRAWS", 300)
    brdf = sure()
    truth = replace(brdf, uncertainty=None, standard_errors=np.full_like(brdf.standard_errors, np.nan))
    found = []
    for one in drawn(brdf, 40, 1):
        judged = replace(one, uncertainty=brdf.uncertainty)
        found.append(significance(sided(judged), sided(truth, "truth"), AT, brdf.channels))
    p = np.array([one.p for one in found])
    assert (p < 0.05).sum() < 7
    assert np.median(p) > 0.2
    assert found[0].exact == ("truth",) and "taken as exact" in str(found[0])


def test_a_difference_somewhere_is_found_there():
    brdf = sure()

    class Brighter(type(brdf)):
        """By a bump about 60 degrees and its mirror direction."""

        def __call__(self, incident, exit):
            f = super().__call__(incident, exit)
            bump = np.exp(-(((incident[:, 2] - 0.5) / 0.1) ** 2 + ((exit[:, 2] - 0.5) / 0.1) ** 2))
            return f + 0.3 * bump[:, None] * (incident[:, 0] * exit[:, 0] < 0)[:, None]

    other = Brighter(**{name: getattr(brdf, name) for name in brdf.__dataclass_fields__})
    found = significance(sided(brdf), sided(other, "b"), AT, brdf.channels)
    assert found.p < 0.02 and found.exact == ()
    theta_i, theta_r, dphi = np.degrees(found.angles)
    assert abs(theta_i - 60.0) < 12.0 and abs(theta_r - 60.0) < 12.0 and dphi > 90.0
    assert found.sigmas < -4.0 and "differ by more" in str(found)


def test_the_same_twice_and_a_free_scale():
    brdf = sure()
    same = significance(sided(brdf), sided(brdf, "b"), AT, brdf.channels)
    assert same.p == 1.0 and (same.beyond == 0.0).all() and "do not differ" in str(same)
    coefficients, lobes = (
        2 * brdf.coefficients,
        tuple(replace(one, weight=2 * one.weight) for one in brdf.lobes),
    )
    twice = replace(brdf, coefficients=coefficients, lobes=lobes)
    both = sided(twice), sided(brdf, "b")
    assert significance(*both, AT, brdf.channels).p < 0.02
    assert significance(*both, AT, brdf.channels, scale=True).p > 0.9


def test_values_told_are_those_that_were_compared():
    """With a free scale too: their difference has the sign of z, where it is greatest."""
    brdf = sure()
    other = replace(brdf, coefficients=brdf.coefficients * 3.0)
    free = significance(sided(brdf), sided(other, "b"), AT, brdf.channels, scale=True)
    assert np.sign(free.values[0] - free.values[1]) == np.sign(free.sigmas) != 0


def test_where_neither_says_there_is_no_p():
    plain = satin()
    bare = replace(plain, standard_errors=np.full_like(plain.standard_errors, np.nan))
    found = compare(of(bare), of(bare, "b"), mask=MASK)
    assert found.significance is None and found.to_dict()["difference"] is None


def test_what_no_parameter_says_counts_too():
    """Errors drawn have the size that the file states."""
    brdf = uncertain(satin())
    drawn_ = module._errors(brdf.only([0]), AT, np.random.default_rng(0))
    where = [*module.spherical_angles(AT.incident), *module.spherical_angles(AT.exit)]
    said = brdf.standard_error(*where)[:, 0]
    # of 2000 draws a deviation is known to 1.6 %
    np.testing.assert_allclose(drawn_.std(axis=1), said, rtol=0.09)


def test_words():
    found = significance(sided(sure()), sided(sure(), "b"), AT, ("R", "G", "B"))
    assert "p < " in str(replace(found, p=0.001)) and "p = 0.5" in str(replace(found, p=0.5))

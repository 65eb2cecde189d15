"""Models that held-out data cannot tell apart share the belief."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.model_averaging import rivals_of
from photogonio.reconstruct.estimate.model_selection import Candidate, Prior
from photogonio.reconstruct.lobes.families import families, retro_lobe

COAT, OTHER = (LobeSet((one,), (np.array([0.3, 0.04]),)) for one in families(absolute=True)[2:])


MORE = LobeSet((*COAT.families, retro_lobe(absolute=True)), (np.array([0.3, 0.04]), np.array([0.1])))
OBSERVED = 100.0


def one(lobes, loss, order=1):
    return Candidate(order, Prior(0.1, 1.0), lobes, np.full(4, loss))


def test_lobes_that_predict_as_well_share_the_belief_and_those_far_off_have_none():
    chosen = one(COAT, 1.0)
    (rival,) = rivals_of(chosen, [chosen, one(COAT, 1.2, 0), one(OTHER, 1.0), one(OTHER, 3.0, 0)], OBSERVED)
    assert rival[0].lobes is OTHER and rival[0].loss.mean() == 1.0
    assert rival[1] == pytest.approx(0.5)
    assert rivals_of(chosen, [chosen, one(OTHER, 2.0)], OBSERVED) == []


def test_more_lobes_are_a_rival_only_if_they_predict_notably_better():
    chosen = one(COAT, 1.0)
    for nearly in (1.0, 0.95):
        assert rivals_of(chosen, [chosen, one(MORE, nearly)], OBSERVED) == []
    ((rival, weight),) = rivals_of(chosen, [chosen, one(MORE, 0.85)], OBSERVED)
    assert rival.lobes is MORE and weight > 0.5

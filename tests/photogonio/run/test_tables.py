"""Tables that nothing went into are refused with the reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from photogonio.capture.errors import InputError
from photogonio.reconstruct.table.facet_table import LEFT_OUT, of_groups

from photogonio.evaluate.hard_tables import one_cell
from photogonio.run.tables import WHY_UNUSED, refuse_empty


def empty(**counts: int):
    """A table without a cell, whose photo lost so many pixels by each reason."""
    left_out = np.array([[counts.get(reason, 0) for reason in LEFT_OUT]])
    nothing = of_groups(one_cell(np.ones(1), np.ones(1)), ())
    return replace(nothing, groups=("s000.png",), left_out=left_out)


def test_a_table_with_a_cell_passes():
    refuse_empty(one_cell(np.ones(1), np.ones(1)))


def test_the_commonest_reason_is_told():
    with pytest.raises(InputError, match="90 % are lit or seen at more than 85 degrees"):
        refuse_empty(empty(grazing=900, outline=60, unlit=40))


def test_a_sample_that_no_photo_shows_is_told():
    with pytest.raises(InputError, match="no pixel shows it"):
        refuse_empty(empty())


def test_every_reason_has_its_words():
    assert set(WHY_UNUSED) == set(LEFT_OUT)

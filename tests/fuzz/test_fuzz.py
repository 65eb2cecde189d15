"""Every reader and the command line take what they are given, or refuse it in one line (tests/fuzz/__main__.py: for
hours)."""

from __future__ import annotations

import random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fuzz.harness import Fuzzed
from tests.fuzz.targets import TARGETS

INPUTS = 25  # of each reader, the same every time
ENDLESS = 300  # seconds: code may have to be compiled, on a machine that does other things
SELDOM = 3  # where one takes seconds


@pytest.mark.parametrize("target", TARGETS, ids=[target.name for target in TARGETS])
def test_what_is_wrong_is_refused_in_one_line(tmp_path, target):
    fuzzed = Fuzzed.of(target, tmp_path / "place", ENDLESS)

    @settings(
        max_examples=INPUTS if target.share else SELDOM,
        derandomize=True,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.integers(0, 2**32))
    def one(seed: int) -> None:
        assert not fuzzed(random.Random(seed))

    one()
    assert fuzzed.accepted + fuzzed.refused

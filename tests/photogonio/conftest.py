"""Fixtures of the front door's tests."""

import pytest

from tests.drawn.tiny_set import TinySet


@pytest.fixture
def tiny_set(tmp_path) -> TinySet:
    return TinySet(tmp_path / "tiny")

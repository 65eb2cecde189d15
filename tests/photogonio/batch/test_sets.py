"""Which sets a batch is of."""

import pytest

from photogonio.batch.sets import find_sets
from photogonio.capture.errors import InputError


@pytest.fixture
def archive(tmp_path):
    for name in ("wood/oak", "wood/ash", "paper"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "photoset.toml").write_text("")
    return tmp_path


def test_folders_patterns_and_sets_lead_to_sets(archive):
    every = ["paper", "wood/ash", "wood/oak"]
    assert [place.name for place in find_sets([str(archive)])] == every
    assert [place.name for place in find_sets([str(archive / "wood"), str(archive / "paper")])] == every
    assert [place.name for place in find_sets([f"{archive}/wood/*"])] == ["ash", "oak"]
    assert [place.name for place in find_sets([str(archive / "paper"), str(archive / "paper") + "/"])] == [
        "paper"
    ]


def test_what_leads_nowhere_is_refused_by_name(archive):
    with pytest.raises(InputError, match="stone"):
        find_sets([str(archive), str(archive / "stone")])

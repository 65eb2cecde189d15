"""Which sets a batch is of."""

import os

import pytest

from photogonio.batch.sets import SetPlace, check_apart, find_sets
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


def test_a_file_is_refused_by_name_and_passed_over_in_a_pattern(archive):
    (archive / "README").write_text("")
    with pytest.raises(InputError, match="README: is a file"):
        find_sets([str(archive), str(archive / "README")])
    told = []
    assert len(find_sets([f"{archive}/*"], told.append)) == 3 and not told


def test_sets_in_sets_and_behind_links_count_once_and_hidden_ones_not(archive, tmp_path_factory):
    disk = tmp_path_factory.mktemp("disk")
    for folder in (archive / "paper" / "torn", archive / ".old" / "stone", disk / "metal"):
        folder.mkdir(parents=True)
        (folder / "photoset.toml").write_text("")
    for name, target in (
        ("a-link", archive / "wood"),
        ("loop", archive),
        ("metals", disk),
        ("gone", disk / "no"),
    ):
        (archive / name).symlink_to(target)
    every = ["metals/metal", "paper", "paper/torn", "wood/ash", "wood/oak"]
    assert [place.name for place in find_sets([str(archive)])] == every
    assert [place.name for place in find_sets([str(archive / "loop" / "wood"), str(archive)])] == every
    assert [place.name for place in find_sets([f"{archive}/**/paper"])] == ["paper", "paper/torn"]


def test_what_cannot_be_read_is_told(archive, monkeypatch):
    walked = os.walk

    def walk(top, onerror, followlinks):
        onerror(PermissionError(13, "Permission denied", f"{top}/lost"))
        return walked(top, followlinks=followlinks)

    monkeypatch.setattr(os, "walk", walk)
    told = []
    assert len(find_sets([str(archive)], told.append)) == 3
    assert told == [f"{archive}/lost: passed over, permission denied"]


def test_results_never_lie_among_photos_nor_under_the_names_of_the_library_s_files(archive):
    places = find_sets([str(archive)])
    for out in (archive, archive / "wood" / ".."):
        with pytest.raises(InputError, match="among photos"):
            check_apart(places, out, ())
    with pytest.raises(InputError, match="one of the photo sets"):
        check_apart(places, archive / "paper", ())
    check_apart(places, archive / "library", ("ledger.jsonl",))
    with pytest.raises(InputError, match="rename"):
        check_apart([SetPlace("ledger.jsonl/a", archive)], archive / "library", ("ledger.jsonl",))

"""Sets of one rig: who is of which, what each is told by the others, and a batch that goes on from a kill alike."""

import json

import numpy as np
import pytest

from photogonio.batch.ledger import SetEntry, read_ledger
from photogonio.batch.rigs import expectations, marks_of, pool_document, rig_words, rigs_of
from photogonio.calib.rig.codes import DIFFERS
from photogonio.capture.manifest.load import load_photoset
from photogonio.cli import main
from photogonio.run.calibrate_photos import differing
from tests.drawn.tiny_set import TinySet

QUICK = ["--quiet", "--order", "0", "--lobes", "none", "--level", "2", "--executor", "local:1", "--pool"]
PAPER, RADIUS = 0.8, 8.0


def entry(name, rng, *, camera="A", paper=0.0):
    """A set whose paper and ball are told to a hundredth and a thousandth."""
    found = np.log(PAPER) + paper + 0.01 * rng.normal()
    told = [
        {
            "name": "paper",
            "value": [found],
            "information": [[1e4]],
            "before": [np.log(0.8)],
            "usual": [[11.0]],
        },
        {
            "name": "ball 0",
            "value": [np.log(RADIUS) + 0.001 * rng.normal()],
            "information": [[1e6]],
            "before": [np.log(RADIUS)],
            "usual": [[1e5]],
        },
    ]
    return SetEntry(name, "k", "done", "", {"marks": {"camera": camera}, "told": told})


def drawn(rng, **odd):
    return [entry(f"s{k:02d}", rng, **(odd if k == 4 else {})) for k in range(12)]


def test_sets_of_another_camera_are_another_rig():
    entries = drawn(np.random.default_rng(1), camera="B")
    rigs = rigs_of(entries)
    assert [len(rig.sets) for rig in rigs] == [11, 1] and rigs[1].sets == ("s04",)
    assert not expectations(rigs[1], entries)["s04"].expected
    assert "nothing is taken over" in rig_words(rigs[1])[0]


def test_a_set_on_other_paper_is_named_and_told_nothing_of_it():
    entries = drawn(np.random.default_rng(2), paper=0.2)
    (rig,) = rigs_of(entries)
    told = expectations(rig, entries)
    assert told["s04"].differs == ("paper",) and [one.name for one in told["s04"].expected] == ["ball 0"]
    assert differing(told["s04"]).code == DIFFERS and "paper" in differing(told["s04"]).message
    paper = told["s00"].get("paper")
    assert paper.sets == 10  # neither itself nor the one that differs
    # 10 sets of a hundredth each, and what they leave open of how alike they are
    assert np.sqrt(paper.covariance[0, 0]) < 0.01 and abs(paper.value[0] - np.log(PAPER)) < 0.01
    assert any("without s04" in line for line in rig_words(rig))
    document = json.loads(json.dumps(pool_document([rig], entries)))
    (learned,) = (one for one in document["rigs"][0]["learned"] if one["of"] == "paper")
    assert learned["left_out"][0]["set"] == "s04" and len(learned["sets"]) == 11


def test_a_set_that_tells_nothing_is_told_what_all_others_say():
    entries = drawn(np.random.default_rng(3))
    entries[4] = SetEntry("s04", "k", "failed", "too few corners", {"marks": {"camera": "A"}})
    (rig,) = rigs_of(entries)
    assert expectations(rig, entries)["s04"].get("paper").sets == 11
    assert pool_document([rig], entries)["sets_that_say_nothing"] == {"s04": "too few corners"}


def test_one_more_set_changes_what_the_others_are_told():
    rng = np.random.default_rng(4)
    entries = drawn(rng)
    before, after = (
        expectations(rigs_of(some)[0], some)["s00"].get("paper")
        for some in (entries, [*entries, entry("s12", rng)])
    )
    assert before.sets == 11 and after.sets == 12 and before.value[0] != after.value[0]


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("archive")
    for name in ("a", "bad"):
        made = TinySet(folder / name)
    made.replace("shape = 'sphere'", "shape = 'cube'")
    return folder


def test_sets_of_one_rig_have_the_same_marks_whatever_they_are_of(archive):
    marks = marks_of(load_photoset(archive / "a"))
    assert marks["picture"] == [160, 120] and marks["board"] == "none" and len(marks["camera matrix"]) == 3


def test_a_pool_of_sets_that_tell_nothing_of_their_rig_is_a_plain_batch(archive, tmp_path):
    out = tmp_path / "library"
    assert main(["batch", str(archive), "-o", str(out), *QUICK]) == 1
    pool = json.loads((out / "pool.json").read_text())
    # its camera and lamps are given, and there is no board: nothing is left to be learned
    assert [rig["sets"] for rig in pool["rigs"]] == [["a"]] and pool["rigs"][0]["learned"] == []
    assert "bad" in pool["sets_that_say_nothing"]
    plain = read_ledger(out / "ledger.jsonl")
    assert plain["a"].finished and "pool" not in plain["a"].numbers
    bytes_of = {name: (out / name).read_bytes() for name in ("rigs.jsonl", "pool.json", "ledger.jsonl")}
    # as a kill leaves it: the ledger of rigs cut short
    (out / "rigs.jsonl").write_bytes(bytes_of["rigs.jsonl"][:-9])
    main(["batch", str(archive), "-o", str(out), *QUICK])
    assert {name: (out / name).read_bytes() for name in bytes_of} == bytes_of

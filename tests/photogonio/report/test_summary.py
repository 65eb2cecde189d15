"""What the result is said in."""

from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import families
from photogonio.reconstruct.symmetry.verdict import Verdict
from photogonio.report.summary import contradicted_photos, fit_choices, physics_warnings


def brushed(roughness, stretch=1.5):
    """A fit of brushed metal, said with modes to order 4."""
    family = families(absolute=True, turning=True)[0]
    lobes = LobeSet((family,), (np.array([roughness, stretch, 1.0]),))
    model = Model(Basis("reciprocal", 0), np.zeros((1, 1)), lobes, np.full((1, 1), 0.8))
    return SimpleNamespace(
        model=model,
        brdf=SimpleNamespace(order=4),
        symmetry=Verdict("reciprocal", "by odds of 10^9 to 1", 20.7, 1e-4),
        diagnostics={"order": 0},
    )


def test_the_symmetry_is_said_first_with_its_reason():
    first, *rest = fit_choices(brushed(0.4))
    assert (first.what, first.value, first.reason) == ("symmetry", "reciprocal", "by odds of 10^9 to 1")
    assert [choice.what for choice in rest] == ["reciprocity", "order"]


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ({"held": False}, []),
        ({"held": False, "contradicted": True}, ["more light out than came in"]),
        (
            {"held": True, "least f": -0.25, "largest albedo": 0.9, "standard errors moved": 1.5},
            ["least f -0.25 1/sr", "largest albedo 0.900", "by 1.5 standard errors"],
        ),
    ],
)
def test_what_physics_took_is_told(found, said):
    warnings = physics_warnings(SimpleNamespace(diagnostics={"physics": found}))
    assert len(warnings) == bool(said)
    assert all(words in warnings[0].message for words in said)


def test_photos_that_the_fit_left_out_are_named_with_the_reason():
    (left,) = contradicted_photos(SimpleNamespace(diagnostics={"views left out": ["sample/s003"]}))
    assert left.name == "sample/s003" and "contradict" in left.reason

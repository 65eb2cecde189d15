"""The evaluation's table: every number under its heading."""

from __future__ import annotations

from photogonio.evaluate.score_table import COLUMNS, score_table


class Row:
    """A score as far as the table goes."""

    def __init__(self, **values: object):
        self.values = values

    def to_dict(self) -> dict[str, object]:
        return self.values


def numbers(**changes: object) -> dict[str, object]:
    """One number a column, each its own, so that one in the wrong place would show."""
    keys = [(key, form) for columns in COLUMNS for _, key, _, form in columns]
    made = {key: k if form.endswith("d") else 0.01 * k for k, (key, form) in enumerate(keys, 1)}
    return {"scene": "ball", **made, "symmetry": "isotropic", **changes}


def test_every_number_stands_under_its_heading():
    row = numbers()
    blocks = score_table([Row(**row)]).split("\n\n")
    assert len(blocks) == len(COLUMNS)
    for block, columns in zip(blocks, COLUMNS, strict=True):
        head, line = block.splitlines()
        assert line.startswith("ball ")
        for name, key, factor, form in columns:
            end = head.index(name) + len(name)
            value = row[key] if key == "symmetry" else factor * row[key]
            assert line[:end].split()[-1] == format(value, form).strip(), name


def test_what_does_not_apply_is_a_dash():
    text = score_table([Row(**numbers(calibration_light_place=float("nan"), delta_e_itp_mean=None))])
    assert sum(word == "-" for word in text.split()) == 2


def test_a_line_for_each_scene_in_each_block():
    text = score_table([Row(**numbers()), Row(**numbers(scene="plane"))])
    assert text.count("\nball ") == text.count("\nplane ") == len(COLUMNS)

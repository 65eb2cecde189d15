"""What numba cannot read of its cache is compiled again."""

import numba

from photogonio.system.compiled import forgive_damage

TEXT = """
import numba

@numba.njit(cache=True)
def twice(x):
    return 2.0 * x
"""


def loaded(path):
    space = {}
    exec(compile(path.read_text(), str(path), "exec"), space)
    return space["twice"]


def test_a_damaged_index_or_code_is_compiled_again(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    path = tmp_path / "kernel.py"
    path.write_text(TEXT)
    forgive_damage()
    forgive_damage()  # once is enough
    assert loaded(path)(3.0) == 6.0
    for suffix in ("nbi", "nbc"):
        kept = list((tmp_path / "cache").rglob(f"*.{suffix}"))
        assert kept
        for one in kept:
            one.write_bytes(one.read_bytes()[:-20])
        assert loaded(path)(3.0) == 6.0

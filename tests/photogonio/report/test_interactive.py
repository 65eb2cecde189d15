"""The page in a browser: no error, no request, something drawn, the same f as in Python, A4 on paper."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.report.html import interactive_text, render_report
from photogonio.report.sections import Report, Table
from photogonio.report.viewer.ball_table import ball_table
from photogonio.report.viewer.set_up_scene import set_up_scene
from tests.drawn.brdfs import uncertain
from tests.drawn.exports import gloss, over_ground, random_pairs, satin
from tests.drawn.small_setup import small_setup

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
)
ASKED = """<script>
window.failed = [];
window.addEventListener("error", (e) => failed.push(e.message));
const wrong = console.error; console.error = (...m) => { failed.push(m.join(" ")); wrong(...m); };
</script>"""
ANSWERED = """<script>
const inked = (canvas) => {
  const gl = canvas.getContext("webgl2"), n = canvas.width * canvas.height * 4, p = new Uint8Array(n);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
  const seen = new Set();
  for (let k = 0; k < n; k += 4) seen.add(p[k] << 16 | p[k + 1] << 8 | p[k + 2]);
  return seen.size;
};
const asked = PAIRS, found = new Table(told.table);
const out = { failed, drawn: [...document.querySelectorAll("canvas")].map((c) => [c.id, inked(c)]),
  f: asked.map(([i, r]) => found.at(i, r)),
  requests: performance.getEntriesByType("resource").map((e) => e.name).filter((name) => !name.startsWith("data:")) };
const pre = document.createElement("pre");
pre.id = "out"; pre.textContent = JSON.stringify(out); document.body.append(pre);
</script>"""


def browser() -> str:
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        pytest.skip(f"no browser here: none of {', '.join(BROWSERS)}")
    return found


def page(brdf: Brdf) -> str:
    told = {"table": ball_table(brdf), "scene": set_up_scene(small_setup())}
    table = Table(("what", "which"), [("a", "b")])
    return render_report(
        Report(
            title="a </script> <b>",
            lead="",
            provenance=table,
            told=interactive_text(told),
            parts=("ball", "set-up"),
            turning=brdf.turning,
        )
    )


def opened(tmp_path: Path, text: str, *flags: str) -> str:
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    command = [browser(), *FLAGS, profile, *flags, (tmp_path / "page.html").as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    if done.returncode:
        pytest.skip(f"the browser does not start here: {done.stderr.strip()[-200:]}")
    return done.stdout


@pytest.mark.parametrize("turning", [False, True])
def test_it_draws_what_python_says_and_asks_for_nothing(tmp_path, turning):
    brdf = over_ground(gloss((0.5, 0.3), azimuth=0.4)) if turning else satin()
    incident, exit = random_pairs(60, below=70.0)
    pairs = json.dumps(np.stack([incident, exit], axis=1).tolist())
    text = page(brdf).replace("<meta charset", f"{ASKED}<meta charset", 1)
    text = text.replace("</body>", f"{ANSWERED.replace('PAIRS', pairs)}</body>")
    dom = opened(tmp_path, text, "--dump-dom", "--window-size=900,900")
    found = re.search(r'<pre id="out">(.*?)</pre>', dom, re.DOTALL)
    assert found is not None, dom[-500:]
    out = json.loads(unescape(found[1]))
    assert out["failed"] == [] and out["requests"] == []
    assert dict(out["drawn"]).keys() == {"ball", "lobe", "set-up"}
    assert all(colours > 20 for _, colours in out["drawn"]), out["drawn"]
    f = brdf(incident, exit)
    off = np.sqrt(np.mean((np.array(out["f"])[:, :3] - f) ** 2) / np.mean(f**2))
    # nodes of the half vector's azimuth are 30 degrees apart where a surface turns
    assert off < (0.06 if turning else 0.005)


@pytest.mark.long
def test_it_prints_on_a4(tmp_path):
    opened(tmp_path, page(satin()), f"--print-to-pdf={tmp_path / 'page.pdf'}", "--no-pdf-header-footer")
    pdf = (tmp_path / "page.pdf").read_bytes()
    boxes = re.findall(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)", pdf)
    assert boxes and all(abs(float(w) - 595) < 2 and abs(float(h) - 842) < 2 for w, h in boxes)


def test_a_table_holds_f_and_its_error():
    """Half floats have eleven bits; errors are read on a coarse grid."""
    brdf = uncertain(satin())
    told = ball_table(brdf)
    shape = (*told["shape"], 4)
    data = np.frombuffer(base64.b64decode(told["data"]), "<f2").reshape(shape).astype(float)
    assert told["folded"] and told["error"]
    for k in (0, 20, 40):  # half vectors at the root's nodes; light and view along them
        theta = 0.5 * np.pi * (k / 63) ** 2
        along = unit_vectors(np.array([theta]), 0.0)
        np.testing.assert_allclose(data[0, k, 0, 0, :3], brdf(along, along)[0], rtol=2e-3)
    error = brdf.standard_error(0.0, 0.0, 0.0, 0.0) / brdf.evaluate(0.0, 0.0, 0.0, 0.0)
    np.testing.assert_allclose(data[0, 0, 0, 0, 3], error.max(), rtol=2e-3)
    known = brdf.uncertainty
    assert known is not None and not ball_table(satin())["error"]


def test_json_may_stand_in_a_page():
    text = interactive_text({"a": "</script><b>"})
    assert "<" not in text and json.loads(text) == {"a": "</script><b>"}

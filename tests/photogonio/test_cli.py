"""The command's manners: help, errors, exit statuses, and streams (docs/cli.md)."""

from __future__ import annotations

import json
import os
import signal
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

import numpy as np
import pytest

from photogonio.arguments import build_parser
from photogonio.capture.errors import InputError
from photogonio.cli import main
from photogonio.commands.synthesize import counted
from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.represent.bounds_anisotropic import TOLERANCE
from photogonio.synthetic.brdf.library import make_brdf
from photogonio.synthetic.scene.plan import plan
from photogonio.synthetic.scene.scene import load_scene
from tests.places import ROOT

COMMANDS = (
    "process",
    "batch",
    "add",
    "calibrate",
    "fit",
    "synthesize",
    "evaluate",
    "compare",
    "show",
    "export",
    "target",
    "init",
)
TABLE = "theta_i,phi_i,theta_r,phi_r,R,G\n" + "".join(
    f"{ti},0,{tr},{phi},0.1,{0.15 + 0.0005 * tr}\n"
    for ti in (-60, -30, 0, 30, 60)
    for tr in (0, 20, 40, 60)
    for phi in (0, 60, 120, 180, 240, 300)
)
QUICK = ("--order", "2", "--lobes", "none")  # where a test is about manners, not about what is chosen


def fails_with_one_line(capsys, arguments) -> str:
    """Status 2, one line on standard error, nothing on standard output; the line."""
    try:
        status = main([str(argument) for argument in arguments])
    except SystemExit as stop:
        status = stop.code
    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    return err


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example(capsys, command):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    example = text.partition("example:")[2].replace("\\\n", " ").split()
    assert example[:2] == ["photogonio", command]
    assert build_parser().parse_args(example[1:]).command == command


def test_version(capsys):
    with pytest.raises(SystemExit):
        main(["--version"])
    assert capsys.readouterr().out.startswith("photogonio ")


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["polish"],
        ["process"],
        ["process", "a", "b"],
        ["process", "a", "--order", "many"],
        ["process", "a", "--order", "-1"],
        ["process", "a", "--symmetry", "round"],
        ["process", "a", "--workers", "0"],
        ["process", "a", "--channels", "R,,B"],
        ["fit", "a", "--columns", "theta_i"],
        ["fit", "a", "--where", "lambda"],
        ["compare", "a", "b", "--mask", "100"],
        *(
            [*words, value]
            for words in (
                ["target", "--square"],
                ["compare", "a", "b", "--mask"],
                ["plan", "--add"],
                ["show", "a", "--draws"],
                ["process", "a", "--workers"],
            )
            for value in ("0", "-1", "nan", "inf", "1e999")
        ),
    ],
)
def test_bad_arguments_end_with_one_line(capsys, arguments):
    assert "photogonio" in fails_with_one_line(capsys, arguments)


def test_a_missing_input_ends_with_one_line_and_leaves_nothing(capsys, tmp_path):
    for command in (["process"], ["calibrate"], ["fit"], ["show"], ["export", "--format", "merl"]):
        line = fails_with_one_line(capsys, [*command, tmp_path / "no-such", "-o", tmp_path / "out.png"])
        assert "no-such" in line
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def table(tmp_path) -> Path:
    path = tmp_path / "table.csv"
    path.write_text(TABLE)
    return path


def run_json(capsys, *arguments, status: int = 0) -> dict:
    assert main([str(argument) for argument in (*arguments, "--json")]) == status
    return json.loads(capsys.readouterr().out)


def test_fit_writes_everything_and_its_numbers_are_one_json_object(capsys, tmp_path, table):
    out = tmp_path / "out"
    numbers = run_json(capsys, "fit", table, "-o", out, "--order", 2, "--lobes", "none", "--channels", "G")
    names = ["coefficients.json", "coverage.png", "fit.png", "lobes.png", "report.html", "table.npz"]
    assert sorted(path.name for path in out.iterdir()) == names
    assert (numbers["order"], numbers["lobes"], numbers["channels"]) == (2, [], ["G"])
    document = json.loads((out / "coefficients.json").read_text())
    assert document["format"] == "surface-scattering-modes"
    assert document["source"]["program"] == "photogonio"
    assert document["source"]["command"] == "photogonio fit table.csv --order 2 --lobes none --channels G"
    assert list(document["source"]["inputs"]) == ["table.csv"]
    budget = numbers["budget"][0]
    assert budget["of"] == "albedo" and sum(one["share"][0] for one in budget["sources"]) == pytest.approx(
        1.0
    )
    assert "<h2>Uncertainty</h2>" in (out / "report.html").read_text(encoding="utf-8")


def test_the_same_command_gives_the_same_bytes(tmp_path, table):
    for name, workers in (("one", 1), ("two", 2)):
        arguments = ["fit", table, "-o", tmp_path / name, "--lobes", "none", "--workers", workers, "--quiet"]
        assert main([str(argument) for argument in arguments]) == 0
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes(), path.name


def test_a_table_that_was_left_can_be_fitted_again(capsys, tmp_path, table):
    first = run_json(capsys, "fit", table, "-o", tmp_path / "a", "--order", 2, "--lobes", "none")
    again = run_json(
        capsys, "fit", tmp_path / "a/table.npz", "-o", tmp_path / "b", "--order", 2, "--lobes", "none"
    )
    assert again["relative_rms"] == first["relative_rms"]
    assert again["scale"] == first["scale"]


def test_quiet_says_nothing_and_plain_says_what_was_chosen(capsys, tmp_path, table):
    assert main(["fit", str(table), "-o", str(tmp_path / "a"), *QUICK, "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert main(["fit", str(table), "-o", str(tmp_path / "a"), *QUICK]) == 0
    out = capsys.readouterr().out
    assert "order" in out
    assert "written to" in out


@pytest.mark.parametrize(
    "options", [["--channels", "B"], ["--level", "3"], ["--where", "R=7"], ["--columns", "value=Z"]]
)
def test_what_cannot_be_done_is_refused_and_nothing_is_written(capsys, tmp_path, table, options):
    fails_with_one_line(capsys, ["fit", table, "-o", tmp_path / "out", *options])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["table.csv"]


@pytest.mark.parametrize(
    "moment", ["photogonio.run.fit_cells.fit_table", "photogonio.report.page.report_html"]
)
def test_ctrl_c_leaves_nothing(capsys, monkeypatch, tmp_path, table, moment):
    def stop(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(moment, stop)
    assert main(["fit", str(table), "-o", str(tmp_path / "out"), *QUICK, "--quiet"]) == 130
    assert sorted(path.name for path in tmp_path.iterdir()) == ["table.csv"]


def test_a_full_disk_is_status_1_in_one_line(capsys, monkeypatch, tmp_path, table):
    def full(*arguments, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("photogonio.report.page.report_html", full)
    assert main(["fit", str(table), "-o", str(tmp_path / "out"), *QUICK, "--quiet"]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["table.csv"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_the_midst_of_writing_leaves_nothing(tmp_path, number):
    command = [
        sys.executable,
        "-m",
        "photogonio",
        "synthesize",
        "example",
        "-o",
        str(tmp_path / "set"),
        "--quiet",
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}

    def heed() -> None:  # a job started in the background inherits that interrupts are ignored
        signal.signal(number, signal.SIG_DFL)

    with subprocess.Popen(
        command, cwd=tmp_path, env=environment, stderr=subprocess.PIPE, text=True, preexec_fn=heed
    ) as process:
        while not any(tmp_path.rglob("*.png")) and process.poll() is None:
            time.sleep(0.05)
        process.send_signal(number)
        _, err = process.communicate(timeout=120)
    assert process.returncode == 130, err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_modules_load_is_one_line(tmp_path, number):
    code = (
        "import signal, sys\n"
        f"signal.signal({int(number)}, signal.default_int_handler)\n"
        "import photogonio.__main__ as start\n"
        "class Loading:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name == 'photogonio.cli': signal.raise_signal({int(number)})\n"
        "sys.meta_path.insert(0, Loading())\n"
        "start.program()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "photogonio: stopped; nothing was written\n"


def test_an_interrupt_before_there_is_a_handler_is_one_line(tmp_path):
    """Python's own handler raises it in whatever is loaded."""
    code = (
        "import sys\n"
        "import photogonio.__main__ as start\n"
        "class Loading:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'signal': raise KeyboardInterrupt\n"
        "sys.modules.pop('signal', None)\n"
        "sys.meta_path.insert(0, Loading())\n"
        "start.program()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "photogonio: stopped; nothing was written\n"


def ran(monkeypatch, work, number):
    """The status of a command that does ``work``, with a signal's own handler in place: the tests may have been started
    with interrupts ignored, as jobs in the background are."""
    monkeypatch.setattr("photogonio.commands.init.run", work)
    former = signal.signal(number, signal.default_int_handler)
    try:
        return main(["init", "folder"])
    finally:
        signal.signal(number, former)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_that_a_library_swallows_is_asked_for_again(capsys, monkeypatch, number):
    """As one that comes while compiled code calls back."""
    swallowed = []

    def work(args, reporter):
        while True:
            try:
                if not swallowed:
                    os.kill(os.getpid(), number)
                time.sleep(30)
                return {}
            except KeyboardInterrupt:
                if swallowed:
                    raise
                swallowed.append(1)

    assert ran(monkeypatch, work, number) == 130
    assert swallowed
    assert "stopped" in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("made", [RuntimeError("no such type"), InputError("a", "b"), OSError(28, "full")])
def test_what_a_library_makes_of_a_stop_is_that_stop_in_one_line(capsys, monkeypatch, number, made):
    """As numba does while it compiles, and who takes its error for one of the input."""

    def work(args, reporter):
        try:
            os.kill(os.getpid(), number)
            time.sleep(30)
        except KeyboardInterrupt as stop:
            raise made from stop

    assert ran(monkeypatch, work, number) == 130
    told = capsys.readouterr().err
    assert "stopped" in told and told.count("\n") == 1
    monkeypatch.setattr("photogonio.commands.init.run", lambda args, reporter: 1 / 0)
    with pytest.raises(ZeroDivisionError):  # of which no stop is made
        main(["init", "folder"])


@pytest.mark.parametrize(
    "words",
    [["fit", "a\0b"], ["fit", "x" * 5000], ["show", "x/" * 3000], ["fit", "a.csv", "--order", "1" * 400]],
)
def test_words_that_can_name_no_file_are_bad_input(capsys, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    fails_with_one_line(capsys, words)


def test_orders_that_nothing_can_hold_are_refused(capsys, tmp_path, table):
    for symmetry in ("isotropic", "reciprocal"):
        asked = ["--order", "100000", "--symmetry", symmetry, "--lobes", "none"]
        line = fails_with_one_line(capsys, ["fit", table, "-o", tmp_path / "out", "--quiet", *asked])
        assert "--order" in line


def test_show_and_export_open_again(capsys, tmp_path, table):
    assert main(["fit", str(table), "-o", str(tmp_path / "out"), *QUICK, "--quiet"]) == 0
    coefficients = tmp_path / "out/coefficients.json"
    for name, start in (("a.png", b"\x89PNG"), ("a.svg", b"<?xml")):
        numbers = run_json(capsys, "show", coefficients, "-o", tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(start)
        assert len(numbers["albedo"]) == 2
    run_json(capsys, "export", coefficients, "--format", "csv", "-o", tmp_path / "again.csv")
    found = run_json(capsys, "compare", tmp_path / "again.csv", coefficients)
    assert max(found["relative_l2"]) < 1e-8  # nine digits are written
    before = coefficients.read_bytes()
    fails_with_one_line(capsys, ["export", coefficients, "--format", "modes", "-o", coefficients])
    assert coefficients.read_bytes() == before
    # MERL has three channels, this BRDF two
    fails_with_one_line(capsys, ["export", coefficients, "--format", "merl", "-o", tmp_path / "m.binary"])
    fails_with_one_line(capsys, ["export", coefficients, "--format", "obj"])
    assert not (tmp_path / "m.binary").exists()


def test_a_brushed_surface_is_held_to_physics_unless_told_not_to(capsys, tmp_path):
    """Modes to order 4 ring about a ridge of roughness 0.2: far below zero, by more than their errors."""
    rng = np.random.default_rng(0)
    theta, phi = np.arccos(rng.uniform(np.cos(1.2), 1.0, (2, 400))), rng.uniform(0.0, 2.0 * np.pi, (2, 400))
    surface = make_brdf("anisotropic-ggx", {"f0": (0.8,), "roughness_x": 0.3, "roughness_y": 0.2})
    value = surface(unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1]))
    rows = np.column_stack([*np.degrees([theta[0], phi[0], theta[1], phi[1]]), value])
    path = tmp_path / "brushed.csv"
    np.savetxt(path, rows, delimiter=",", header="theta_i,phi_i,theta_r,phi_r,Y", comments="")
    asked = ("--symmetry", "reciprocal", "--lobes", "none", "--order", 4)
    least, warnings = {}, {}
    for physics in ("off", "auto", "on"):
        out = tmp_path / physics
        # modes to order 4 have no ridge: what was asked for is done, and told to miss the rows
        numbers = run_json(capsys, "fit", path, "-o", out, *asked, "--physics", physics, status=3)
        assert "misfit" in numbers["trust"]["codes"]
        brdf = load_brdf(out / "coefficients.json")
        assert brdf.fit["physics"]["held"] == numbers["physics"]["held"] == (physics != "off")
        warnings[physics] = numbers["diagnoses"].get("physics-held", [])
        seen = rng.uniform(0.0, np.radians(85.0), (2, 20_000)), rng.uniform(0.0, 2.0 * np.pi, (2, 20_000))
        f = brdf.evaluate(seen[0][0], seen[1][0], seen[0][1], seen[1][1])
        least[physics] = f.min() / np.abs(f).mean()
    assert least["off"] < -0.1
    assert min(least["auto"], least["on"]) >= -TOLERANCE
    assert (len(warnings["off"]), len(warnings["auto"]), len(warnings["on"])) == (0, 1, 1)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["evaluate", "--suite", "--hard"], "--hard --suite"),
        (["evaluate", "--tables", "--hard"], "--hard --tables"),
        (["evaluate", "--suite", "--quick"], "--quick"),
        (["evaluate", "--hard", "--against", "old.json"], "--against"),
        (["plan", "--add", "1" + "0" * 400], "--add"),
    ],
)
def test_flags_that_exclude_one_another_are_refused(words, named, capsys):
    assert main(words) == 2
    said = capsys.readouterr().err.strip()
    assert said.startswith(f"photogonio: {named}: ") and "\n" not in said


def test_photos_that_are_rendered_are_counted_by_what_they_are_for():
    """Of 18 photos of the example 12 are of the sample, which is what ``process`` then counts."""
    shots = plan(load_scene("example"))
    assert counted(shot.role for shot in shots) == "photos (12 sample, 6 calibration)"


def test_libraries_lines_do_not_show(tmp_path):
    """A PNG whose checksums hold and whose pixels do not unpack: libpng has a line of its own for it."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return (
            struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        )

    damaged = (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 8, 6, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", b"\x78\x9c" + bytes(40)) + chunk(b"IEND", b"")
    )  # fmt: skip
    (tmp_path / "a.png").write_bytes(damaged)
    (tmp_path / "photoset.toml").write_text(
        'format = 1\n[sample]\nshape = "sphere"\ncenter = [0, 0, 0]\nradius = 25\n[camera]\n'
        "matrix = [[400, 0, 4], [0, 400, 3], [0, 0, 1]]\nrotation = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]\n"
        'translation = [0, 0, 200]\n[[light]]\nid = "L"\nkind = "directional"\ndirection = [0, 0, 1]\n'
        '[[photo]]\nfile = "a.png"\nrole = "sample"\nlight = "L"\n'
    )
    done = subprocess.run(
        [sys.executable, "-m", "photogonio", "calibrate", str(tmp_path)],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2 and done.stdout == ""
    assert [line[:12] for line in done.stderr.splitlines()] == ["photogonio: "], done.stderr

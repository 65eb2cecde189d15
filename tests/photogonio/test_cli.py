"""The command's manners: help, errors, exit statuses, and streams (docs/cli.md)."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from photogonio.arguments import build_parser
from photogonio.cli import main

ROOT = Path(__file__).parents[2]
COMMANDS = ("process", "calibrate", "fit", "synthesize", "evaluate", "compare", "show", "export", "target", "init")
TABLE = "theta_i,phi_i,theta_r,phi_r,R,G\n" + "".join(
    f"{ti},0,{tr},{phi},0.2,{0.3 + 0.001 * tr}\n"
    for ti in (-60, -30, 0, 30, 60)
    for tr in (0, 20, 40, 60)
    for phi in (0, 60, 120, 180, 240, 300)
)


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
    ],
)
def test_bad_arguments_end_with_one_line(capsys, arguments):
    assert "photogonio" in fails_with_one_line(capsys, arguments)


def test_a_missing_input_ends_with_one_line_and_leaves_nothing(capsys, tmp_path):
    for command in (["process"], ["calibrate"], ["fit"], ["show"], ["export", "--format", "merl"]):
        line = fails_with_one_line(capsys, [*command, tmp_path / "no-such", "-o", tmp_path / "out"])
        assert "no-such" in line
    assert list(tmp_path.iterdir()) == []

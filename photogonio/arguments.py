"""The grammar of the command line. Imports nothing heavy, so that ``--help`` answers at once."""

from __future__ import annotations

import argparse
import sys
from typing import NoReturn

from photogonio.argument_values import length, mask, positive, whole
from photogonio.option_groups import executor_option, fit_options, table_options, workers_option

_KINDS = "a result's folder, coefficients.json, truth.json, or what export writes"
# as photogonio.reconstruct.design.materials has them, which would import numpy
_MATERIALS = ("matte", "satin", "plastic", "gloss", "metal")
_PAPERS = ("a4", "a3", "letter")


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        sys.stderr.write(f"{self.prog}: {' '.join(message.split())} (see {self.prog} --help)\n")
        sys.exit(2)


class _Version(argparse.Action):
    """Asks for the version when it is wanted, which takes longer than all of this module."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from photogonio import __version__

        print(f"photogonio {__version__}")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """The parser of the command and its subcommands; the namespace names the handler in ``command``."""
    parser = _Parser(
        prog="photogonio",
        description="Ordinary photos in, a measured BRDF out.",
        epilog="photogonio COMMAND --help tells more of each command, with an example.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=_Parser)
    for add in (
        _process,
        _batch,
        _check,
        _plan,
        _calibrate,
        _fit,
        _add,
        _synthesize,
        _evaluate,
        _compare,
        _show,
        _export,
        _target,
        _init,
    ):
        add(commands)
    return parser


def _command(commands: argparse._SubParsersAction, name: str, text: str, example: str) -> _Parser:
    parser = commands.add_parser(
        name,
        help=text,
        description=text[0].upper() + text[1:] + ".",
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quiet", action="store_true", help="say nothing but errors")
    parser.add_argument("--json", action="store_true", help="the result's numbers as one JSON object")
    return parser


def _process(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "process",
        "the main job: photo set to coefficients, setup, facet table and report",
        "photogonio process my-set -o my-set-brdf",
    )
    parser.add_argument("set", metavar="SET", help="folder with photoset.toml")
    parser.add_argument("-o", "--out", metavar="OUT", help="folder to write (default: SET's name + -brdf)")
    fit_options(parser)
    executor_option(parser)


def _batch(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "batch",
        "many photo sets, each as process does, with one table and one page of all",
        "photogonio batch archive -o library",
    )
    parser.add_argument("sets", metavar="FOLDER", nargs="+", help="photo sets, folders of such, or patterns")
    parser.add_argument(
        "-o", "--out", metavar="OUT", default="library", help="folder to write (default: library)"
    )
    parser.add_argument(
        "--pool",
        action="store_true",
        help="learn camera, lens, lamps and paper of each rig from all of its sets, and calibrate each with that",
    )
    fit_options(parser, workers=False)
    executor_option(parser)


def _check(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "check",
        "a line a photo, seconds each: exposure, clipping, sharpness, board, lamp, and what it adds",
        "photogonio check my-set --watch",
    )
    parser.add_argument("set", metavar="SET", help="folder of photos, with photoset.toml or without")
    parser.add_argument("--watch", action="store_true", help="go on as photos arrive, until Ctrl-C")


def _plan(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "plan",
        "where camera and lamp should be in the next photos, and what each would lower",
        "photogonio plan my-set-brdf --add 3 -o plan.html",
    )
    parser.add_argument(
        "source",
        metavar="SET or RESULT",
        nargs="?",
        help="photos or a result that are there; none: before any photo",
    )
    parser.add_argument("--add", metavar="N", type=positive, default=5, help="photos (default: 5)")
    parser.add_argument(
        "-o", "--out", metavar="FILE", help="a page with a picture from above, to print (.html)"
    )
    parser.add_argument(
        "--material", choices=_MATERIALS, help="before a result: what the sample is like (default: satin)"
    )
    parser.add_argument(
        "--shape", choices=("ball", "plane"), help="of the sample, before any photo (default: plane)"
    )
    parser.add_argument(
        "--lamp",
        choices=("any", "flash", "lamp"),
        default="any",
        help="flash: on the camera alone; lamp: never there (default: any)",
    )
    parser.add_argument(
        "--still", action="store_true", help="the camera stays where it stood in the last photo"
    )


def _calibrate(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "calibrate",
        "camera, poses, lights and irradiance scale of a photo set, with residuals",
        "photogonio calibrate my-set -o setup.json",
    )
    parser.add_argument("set", metavar="SET", help="folder with photoset.toml")
    parser.add_argument("-o", "--out", metavar="FILE", default="setup.json", help="default: setup.json")
    workers_option(parser)


def _fit(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "fit",
        "coefficients from tabulated measurements, or from the table.npz that process leaves",
        "photogonio fit PTFE.csv -o ptfe --where lambda=0.532 \\\n"
        "      --columns theta_i=thetai,phi_i=phi,theta_r=thetar,phi_r=phir,value=f_r11",
    )
    parser.add_argument(
        "table",
        metavar="TABLE",
        help="text table (CSV): theta_i, phi_i, theta_r, phi_r in degrees, and values; MERL .binary, BSDF .xml, "
        "pab-opto files or a folder of them; or table.npz",
    )
    parser.add_argument("-o", "--out", metavar="OUT", help="folder to write (default: TABLE's name + -brdf)")
    table_options(parser)
    fit_options(parser)


def _add(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "add",
        "sessions of photos of one sample, each with its own set-up, in one fit",
        "photogonio add monday-brdf tuesday-brdf -o wood",
    )
    parser.add_argument(
        "tables",
        metavar="RESULT",
        nargs="+",
        help="what process left of each session: its folder or table.npz",
    )
    parser.add_argument("-o", "--out", metavar="OUT", default="added-brdf", help="default: added-brdf")
    fit_options(parser)


def _synthesize(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "synthesize",
        "a photo set of a known BRDF, with its truth",
        "photogonio synthesize matte-ball -o matte-ball",
    )
    parser.add_argument("scene", metavar="SCENE", nargs="?", help="a built-in name or a scene file (TOML)")
    parser.add_argument("-o", "--out", metavar="SET", help="folder to write (default: the scene's name)")
    parser.add_argument("--list", action="store_true", help="list the built-in scenes")
    workers_option(parser)


def _evaluate(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "evaluate",
        "synthesize, process and compare with the truth: speed against error",
        "photogonio evaluate --quick -o evaluation",
    )
    parser.add_argument(
        "scenes",
        metavar="SCENE",
        nargs="*",
        help="scenes, or with --hard cases, with --suite words of it (default: all); with --tables measured tables, or "
        "folders of them",
    )
    parser.add_argument(
        "-o", "--out", metavar="OUT", default="evaluation", help="folder (default: evaluation)"
    )
    parser.add_argument("--quick", action="store_true", help="few scenes, small photos")
    parser.add_argument("--hard", action="store_true", help="the battery of hard cases")
    parser.add_argument(
        "--tables", action="store_true", help="measured tables: how well rows left out are predicted"
    )
    parser.add_argument(
        "--suite",
        action="store_true",
        help="24 materials as ball and flat piece, by lamps and kits: 288 sets",
    )
    parser.add_argument("--against", metavar="OLD.json", help="compare with an earlier evaluate.json")
    parser.add_argument(
        "--cache", metavar="FOLDER", help="where synthesized sets are kept (default: OUT/sets)"
    )
    table_options(parser)
    workers_option(parser)


def _compare(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "compare",
        "two BRDFs: the field's error metrics and a scatter plot",
        "photogonio compare my-set-brdf/coefficients.json my-set/truth.json -o comparison",
    )
    kinds = f"{_KINDS}, pab-opto, or a table (.csv, table.npz, .truth.npz)"
    parser.add_argument("a", metavar="A", help=f"the BRDF to judge: {kinds}")
    parser.add_argument("b", metavar="B", help="the reference, likewise")
    parser.add_argument("-o", "--out", metavar="OUT", help="folder for the numbers and pictures")
    parser.add_argument(
        "--mask", metavar="DEGREES", type=mask, default=80.0, help="largest angle (default: 80)"
    )
    parser.add_argument("--scale", action="store_true", help="scale A to B first, one factor a channel")
    table_options(parser)


def _show(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "show",
        "lobes, polar cuts and a shaded sphere of a BRDF",
        "photogonio show my-set-brdf/coefficients.json -o brdf.svg",
    )
    parser.add_argument("coefficients", metavar="COEFFICIENTS", help=_KINDS)
    parser.add_argument(
        "-o", "--out", metavar="FILE", default="brdf.png", help=".png or .svg (default: brdf.png)"
    )
    parser.add_argument(
        "--draws", metavar="N", type=positive, help="N balls instead, each of a BRDF drawn from the errors"
    )


def _export(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "export",
        "write a BRDF for renderers and other tools",
        "photogonio export my-set-brdf/coefficients.json --format merl -o material.binary",
    )
    parser.add_argument("coefficients", metavar="COEFFICIENTS", help=_KINDS)
    parser.add_argument("--channel", metavar="NAME", help="only this one")
    parser.add_argument(
        "--format",
        metavar="F",
        required=True,
        help="csv, gltf, merl, mitsuba, modes, openpbr, pabopto, radiance or scatmech",
    )
    parser.add_argument(
        "--basis",
        choices=("tree", "klems"),
        help="of radiance: a tensor tree (default), or the full Klems matrix",
    )
    parser.add_argument(
        "--order", metavar="N", type=whole, help="of modes and scatmech; default: as many as say it closely"
    )
    parser.add_argument(
        "-o", "--out", metavar="FILE", help="default: COEFFICIENTS' name with the format's suffix"
    )


def _target(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "target",
        "a printable board at true scale, with a stub photoset.toml beside it",
        "photogonio target --paper a4 -o target.pdf",
    )
    parser.add_argument("--paper", choices=_PAPERS, default="a4")
    parser.add_argument("--kind", choices=("charuco", "aruco-grid"), default="charuco")
    parser.add_argument("--square", metavar="MM", type=length, default=20.0, help="default: 20")
    parser.add_argument("--dictionary", metavar="NAME", help="of OpenCV's markers; default: one that suits")
    parser.add_argument("-o", "--out", metavar="FILE", default="target.pdf", help="default: target.pdf")


def _init(commands: argparse._SubParsersAction) -> None:
    parser = _command(
        commands,
        "init",
        "write photoset.toml for a folder of photos, from their EXIF",
        "photogonio init my-set",
    )
    parser.add_argument("folder", metavar="FOLDER")

"""Options that several commands share. Imports nothing heavy."""

from __future__ import annotations

import argparse

from photogonio.argument_values import auto_or_whole, executor, lobes, names, pairs, positive

_SYMMETRIES = ("auto", "isotropic", "reciprocal", "general")
# as photogonio.reconstruct.goniometer.told has them, which would import numpy
_QUANTITIES = ("brdf", "brdf-cos", "brdf-cos-cos", "brdf-cos-incident", "reflectance-factor", "percent")
_ANGLES = ("degrees", "radians", "gradians")
_AZIMUTHS = ("lamp", "mirror")


def table_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--columns",
        metavar="NAME=HEADER,...",
        type=pairs,
        default={},
        help="other headers: theta_i=...,phi_i=...,theta_r=...,phi_r=...,value=R+G+B,sigma=...",
    )
    parser.add_argument(
        "--where",
        metavar="HEADER=VALUE",
        type=pairs,
        action="append",
        default=[],
        help="take only rows with this value; may be given again",
    )
    parser.add_argument(
        "--channel-by", metavar="HEADER", help="each value of this column, such as a wavelength, is a channel"
    )
    parser.add_argument(
        "--quantity",
        choices=_QUANTITIES,
        help="what the values are; cos: of the exit angle; percent: of a perfect white diffuser (default: brdf)",
    )
    parser.add_argument(
        "--angles",
        metavar="UNIT",
        help=f"{', '.join(_ANGLES)}, or where they differ theta=UNIT,phi=UNIT (default: degrees; asked where they look "
        "like another)",
    )
    parser.add_argument(
        "--azimuth",
        choices=_AZIMUTHS,
        help="side on which phi_r - phi_i is 0; without azimuths, that of exit angles with the sign of theta_i "
        "(default: lamp)",
    )


def fit_options(parser: argparse.ArgumentParser, *, workers: bool = True) -> None:
    parser.add_argument("--order", type=auto_or_whole, default="auto", help="largest radial order, or auto")
    parser.add_argument(
        "--level", type=auto_or_whole, default="auto", help="of the icosahedral facets, or auto"
    )
    parser.add_argument("--symmetry", choices=_SYMMETRIES, default="auto")
    parser.add_argument("--lobes", type=lobes, default="auto", help="auto, none, or how many")
    parser.add_argument(
        "--physics",
        choices=("auto", "on", "off"),
        default="auto",
        help="hold the result to f >= 0 and albedos up to 1; auto: where the plain fit is off by more than its error",
    )
    parser.add_argument(
        "--prior",
        choices=("auto", "none"),
        default="auto",
        help="of smooth modes, its strength by what is left out; none: least squares alone",
    )
    parser.add_argument(
        "--robust",
        choices=("on", "off"),
        default="on",
        help="off: single values that contradict their neighbours count like all others",
    )
    parser.add_argument("--channels", metavar="A,B,...", type=names, help="only these, by name")
    if workers:
        workers_option(parser)
    else:
        parser.set_defaults(workers=None)


def workers_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--workers", metavar="N", type=positive, help="default: one a core")


def executor_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--executor",
        metavar="E",
        type=executor,
        help="who reduces photos: local:N, so many workers here in all (default: one a core), or dask://HOST:PORT, "
        "the workers of a dask scheduler",
    )

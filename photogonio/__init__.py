"""photogonio: ordinary photos in, a measured BRDF out.

The public API; everything is imported on first use, so that the command line answers at once::

    import photogonio as pg
    b = pg.process("my-set", "my-set-brdf").brdf  # or pg.load("my-set-brdf")
    b(incident, exit)  # unit vectors (..., 3) in the tangent frame

docs/api.md shows it all.
"""

import os
from importlib import import_module

# In a checkout capture, calib, reconstruct and synthetic stand beside this folder; a wheel has them in it.
_here = os.path.dirname(os.path.abspath(__file__))
if not os.path.isdir(os.path.join(_here, "capture")):
    __path__.append(os.path.dirname(_here))

from photogonio import one_thread as _one_thread  # noqa: E402, F401  before numpy

_HOMES = {
    "InputError": "photogonio.capture.errors",
    "PhotoSet": "photogonio.capture.photoset",
    "load_photoset": "photogonio.capture.manifest.load",
    "Setup": "photogonio.calib.setup",
    "load_setup": "photogonio.calib.setup_file",
    "save_setup": "photogonio.calib.setup_file",
    "load": "photogonio.face.files",
    "MeasuredBrdf": "photogonio.face.measured",
    "KnownBrdf": "photogonio.face.known",
    "Brdf": "photogonio.reconstruct.brdf.brdf",
    "load_brdf": "photogonio.reconstruct.brdf.brdf",
    "FacetTable": "photogonio.reconstruct.table.facet_table",
    "Options": "photogonio.options",
    "calibrate": "photogonio.pipeline",
    "fit": "photogonio.face.jobs",
    "process": "photogonio.face.jobs",
    "Told": "photogonio.reconstruct.goniometer.told",
    "synthesize": "photogonio.synthetic.write.photoset",
}
__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> object:
    if name == "__version__":
        return _version()
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def _version() -> str:
    """As installed, which git's tags tell; of a folder that nobody installed, that there is none."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("photogonio")
    except PackageNotFoundError:
        return "0+not.installed"


def __dir__() -> list[str]:
    return sorted(__all__)

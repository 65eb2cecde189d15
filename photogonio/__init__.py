"""photogonio: ordinary photos in, a measured BRDF out.

The public API; everything is imported on first use, so that the command line answers at once::

    import photogonio
    result = photogonio.process("my-set", "my-set-brdf")
    result.brdf(incident, exit)  # unit vectors (..., 3) in the tangent frame
"""

from importlib import import_module

from photogonio import one_thread as _one_thread  # noqa: F401  before numpy

__version__ = "0.1.0"

_HOMES = {
    "InputError": "capture.errors",
    "PhotoSet": "capture.photoset",
    "load_photoset": "capture.manifest.load",
    "Setup": "calib.setup",
    "load_setup": "calib.setup",
    "save_setup": "calib.setup",
    "Brdf": "reconstruct.brdf.brdf",
    "load_brdf": "reconstruct.brdf.brdf",
    "FacetTable": "reconstruct.table.facet_table",
    "Options": "photogonio.pipeline",
    "calibrate": "photogonio.pipeline",
    "fit": "photogonio.pipeline",
    "process": "photogonio.pipeline",
    "synthesize": "synthetic.write.photoset",
}
__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)

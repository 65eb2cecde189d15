"""``photogonio calibrate``."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from photogonio.capture.diagnosis import by_code
from photogonio.pipeline import calibrate
from photogonio.report.calibration_text import calibration_lines
from photogonio.report.marked_photos import pictures_folder
from photogonio.report.trust import setup_faults, trust_numbers, verdict_lines
from photogonio.system.progress import Reporter


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    setup = calibrate(args.set, args.out, reporter, workers=args.workers)
    faults = setup_faults(setup)
    reporter.distrust(verdict_lines(faults))
    reporter.say("\n".join([*verdict_lines(faults), calibration_lines(setup)]))
    page = Path(args.out).with_suffix(".html")
    reporter.say(f"written to {args.out} and {page}, pictures to {pictures_folder(Path(args.out))}")
    lights = {view.light.id: view.light for view in setup.views}
    return {
        "camera": {
            "matrix": setup.camera.matrix,
            "distortion": setup.camera.distortion,
            "size": setup.camera.size,
        },
        "scale": setup.scale,
        "views": [
            {
                "name": view.name,
                "light": view.light.id,
                "pose_rms": view.pose_rms,
                "strength": view.strength,
                "strength_error": view.strength_error,
                "strength_source": view.strength_source,
            }
            for view in setup.views
        ],
        "lights": {
            light.id: {
                "kind": light.kind,
                "place": light.place,
                "standard_errors": np.sqrt(np.maximum(np.diag(light.covariance), 0.0)),
                "source": light.source,
                "residual": light.residual,
            }
            for light in lights.values()
        },
        "residuals": setup.residuals,
        "left_out": [{"photo": photo.name, "reason": photo.reason} for photo in setup.left_out],
        "warnings": setup.warnings,
        "diagnoses": by_code(setup.diagnoses),
        "trust": trust_numbers(faults),
        "out": args.out,
    }

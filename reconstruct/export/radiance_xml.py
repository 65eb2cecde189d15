"""Radiance's BSDF XML: the frame that tensor trees and Klems matrices share.

WINDOW's "front" is the side of the room's outside, so that what is lit and seen from the surface's own front is named
"Reflection Back" (Ward, "Tensor tree representation of BSDF", Radiance workshop 2011; LBNL BSDF-v1.4).
"""

from __future__ import annotations

from xml.sax.saxutils import escape

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.rgb import rgb_order

LUMINANCE = np.array([0.2126390, 0.7151687, 0.0721923])  # of linear sRGB (IEC 61966-2-1)
_FRAME = """<?xml version="1.0" encoding="UTF-8"?>
<WindowElement xmlns="http://windows.lbl.gov" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="http://windows.lbl.gov/BSDF-v1.4.xsd">
<!-- {remark} -->
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
	<Material>
		<Name>{name}</Name>
		<Manufacturer>photogonio</Manufacturer>
		<DeviceType>Other</DeviceType>
	</Material>
	<DataDefinition>
{definition}
	</DataDefinition>
	<WavelengthData>
		<LayerNumber>System</LayerNumber>
		<Wavelength unit="Integral">Visible</Wavelength>
		<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>
		<DetectorSpectrum>ASTM E308 1931 Y.dsp</DetectorSpectrum>
		<WavelengthDataBlock>
			<WavelengthDataDirection>Reflection Back</WavelengthDataDirection>
{basis}
			<ScatteringDataType>BRDF</ScatteringDataType>
			<ScatteringData>
{data}
			</ScatteringData>
		</WavelengthDataBlock>
	</WavelengthData>
</Layer>
</Optical>
</WindowElement>
"""


def document(*, name: str, remark: str, definition: str, basis: str, data: str) -> str:
    """The file's text."""
    return _FRAME.format(
        name=escape(name),
        remark=escape(remark.replace("--", "- -")),  # two hyphens would end the remark
        definition=definition,
        basis=basis,
        data=data,
    )


def gray(brdf: Brdf, value: np.ndarray) -> np.ndarray:
    """(...) CIE Y of values (..., c) whose channels are R, G and B, taken as linear sRGB; else their mean."""
    order = rgb_order(brdf.channels)
    return value.mean(axis=-1) if order is None else value[..., order] @ LUMINANCE

from photogonio.calib.setup import Setup as Setup
from photogonio.calib.setup_file import load_setup as load_setup
from photogonio.calib.setup_file import save_setup as save_setup
from photogonio.capture.errors import InputError as InputError
from photogonio.capture.manifest.load import load_photoset as load_photoset
from photogonio.capture.photoset import PhotoSet as PhotoSet
from photogonio.face.files import load as load
from photogonio.face.jobs import fit as fit
from photogonio.face.jobs import process as process
from photogonio.face.known import KnownBrdf as KnownBrdf
from photogonio.face.measured import MeasuredBrdf as MeasuredBrdf
from photogonio.options import Options as Options
from photogonio.pipeline import calibrate as calibrate
from photogonio.reconstruct.brdf.brdf import Brdf as Brdf
from photogonio.reconstruct.brdf.brdf import load_brdf as load_brdf
from photogonio.reconstruct.goniometer.told import Told as Told
from photogonio.reconstruct.table.facet_table import FacetTable as FacetTable
from photogonio.synthetic.write.photoset import synthesize as synthesize

__version__: str
__all__: list[str]

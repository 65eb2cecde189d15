"""photogonio: ordinary photos in, a measured BRDF out."""

__version__ = "0.1.0"

"""Is the surface isotropic, is it reciprocal?

Takes Cells; gives a verdict, with the chance that it is wrong.
"""

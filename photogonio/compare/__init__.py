"""How far are two BRDFs apart?

Takes two reflectances; gives error measures, differences for the eye.
"""

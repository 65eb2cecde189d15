"""How do other programs read the result?

Takes Brdf; gives files of renderers and tables.
"""

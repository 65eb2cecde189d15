"""What surfaces are known exactly?

Takes a name and parameters, or a file; gives a BRDF to render.
"""

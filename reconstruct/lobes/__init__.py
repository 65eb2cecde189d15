"""How does a rough interface reflect?

Takes directions, roughness, reflectance; gives a lobe in 1/sr, with derivatives.
"""

"""Which camera, poses, lamps and sample fit all photos together?

Takes observations; gives the settled model with covariance.
"""

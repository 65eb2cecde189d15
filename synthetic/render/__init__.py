"""What would the camera see?

Takes Scene, plan; gives pictures with noise.
"""

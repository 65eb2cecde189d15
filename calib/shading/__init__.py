"""Where must a lamp be to light the board as it does?

Takes readings of paper; gives lamp places with covariance, unevenness that remains.
"""

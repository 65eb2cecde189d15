"""How sure is the result, and where is it known at all?

Takes fit, misfit, alternatives; gives covariance, stated error, validity.
"""

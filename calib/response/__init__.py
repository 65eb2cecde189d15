"""What tone curve do photos have that nobody names, as their print and paper tell it?

Takes codes of white and black print, the settled cameras and lamps; gives the curve with its covariance.
"""

"""What is to be told and drawn of a calibration?

Takes the settled model; gives residuals, warnings, marked photos.
"""

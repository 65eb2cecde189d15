"""What a file of measured values says, and which of its rows are no measurements.

Takes a file and what is told of it; gives GoniometerSamples.
"""

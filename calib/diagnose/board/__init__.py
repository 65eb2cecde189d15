"""Is the board what the manifest says?

Takes corners and markers; gives departures of print and manifest.
"""

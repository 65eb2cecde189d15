"""Does everything stand where the manifest says?

Takes the settled model; gives departures of sample, mirror balls and lamps from their places.
"""

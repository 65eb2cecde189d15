"""What do lamps and lens do besides what is taken for granted of them?

Takes the settled model; gives departures to be allowed for, the surest first.
"""

"""How is the chosen model written in the terms of the file, within physics?

Takes a Model; gives modes and lobes that are positive and lose energy.
"""

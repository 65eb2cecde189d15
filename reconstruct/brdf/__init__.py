"""What is the result, and how is it kept?

Takes modes, lobes, errors; gives Brdf and its file.
"""

"""What does photoset.toml say, and is it fit to be used?

Takes photoset.toml, or photos without one; gives PhotoSet, or a manifest to be filled in.
"""

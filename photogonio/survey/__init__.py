"""Are these photos good, and what would more of them add?

Takes a folder of photos, with a manifest or without; gives what each shows by itself, and where camera and lamp stood.
"""

"""What do the bytes of a photo say?

Takes an image file; gives pixels as stored, exposure, orientation.
"""

"""Where does a point of the world fall, and what does it see?

Takes poses, lenses, shapes; gives pixels, rays, visibility; no picture is looked at.
"""

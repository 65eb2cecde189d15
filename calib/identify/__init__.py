"""What board and what sample do photos show of which nothing is known?

Takes gray levels; gives a board with its layout, the sharpness of a photo, and where a sample stands.
"""

"""What stands where in a world that is to be photographed?

Takes a scene file or name; gives Scene, and the plan of each photo.
"""

"""What does a browser turn and light?

Takes a BRDF, a Setup, photos; gives tables, places and small pictures for the page's script.
"""

"""How much light did each pixel get?

Takes pixels as stored; gives RadianceImage with variance, clipped pixels marked.
"""

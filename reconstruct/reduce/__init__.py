"""Which pairs of directions did each pixel see?

Takes a RadianceImage and its ViewSetup; gives FacetTable.
"""

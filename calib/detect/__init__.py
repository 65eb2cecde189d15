"""What does one photo show of board, lamp, sample and paper?

Takes RadianceImage; gives corners, highlights, limbs, edges, readings of paper.
"""

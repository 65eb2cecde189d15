"""What does the printed sheet hold, and where?

Takes a paper size; gives Layout of board and marks, its PDF.
"""

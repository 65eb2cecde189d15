"""What do measured rows say, each a reading of its own?

Takes rows of a goniometer; gives their noise, and an average of models that predicts rows left out.
"""

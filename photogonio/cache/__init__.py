"""What is kept between runs, and when may it be used again?

Takes a key of everything that a result depends on; gives the result.
"""

"""What is amiss in single photos?

Takes what each photo shows; gives departures that are put right, or photos that are left out.
"""

"""Which further photos would make the result surer, and by how much?

Takes what is believed of f and where lamp and camera may stand; gives the variance of f, and places that lower it most.
"""

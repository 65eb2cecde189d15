"""What are the modes, and what are their sums and integrals?

Takes directions, coefficients; gives values, integrals, transforms.
"""

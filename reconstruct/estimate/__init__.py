"""Which model predicts the cells, and with what coefficients?

Takes Cells; gives the chosen Model with coefficients and residuals.
"""

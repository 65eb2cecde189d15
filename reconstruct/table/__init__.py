"""Into which cells are direction pairs sorted, and what is in them?

Takes pairs with values, or a goniometer table; gives FacetTable, Cells.
"""

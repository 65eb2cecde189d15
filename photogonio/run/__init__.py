"""How do many photos become one table?

Takes PhotoSet, Setup; gives FacetTable, several photos at a time.
"""

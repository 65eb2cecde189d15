"""How do many photo sets become a library of materials?

Takes folders of photo sets; gives a folder of results, a ledger that resumes, one summary table and page.
"""

"""How is the program used from Python?

Takes files and folders; gives BRDFs that can be evaluated, drawn, compared and exported.
"""

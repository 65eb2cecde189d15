"""What is said and shown of a result?

Takes Result; gives words, pictures, report.html.
"""

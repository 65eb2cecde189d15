"""What does each word of the command line do?

Takes parsed arguments; gives an exit status.
"""

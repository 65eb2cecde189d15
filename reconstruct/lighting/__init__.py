"""What light reached the sample beside the lamp, and where did the lamp stand by it?

Takes views, their cells; gives stray light, its limits, refined lamp directions.
"""

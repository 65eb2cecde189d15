"""What light reached the sample beside the lamp, and where did lamp and ball stand by it?

Takes views, their cells; gives stray light, its limits, refined lamp directions, the ball's place.
"""

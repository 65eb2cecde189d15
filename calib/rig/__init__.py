"""What belongs to the rig and not to the sample, and what do many sets of one rig say of it together?

Takes what each set says by its own photos; gives what is to be expected of another set, and which sets contradict.
"""

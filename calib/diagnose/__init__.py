"""What is not as the manifest says or the model has it?

Takes observations, the settled model; gives evidence, remedy and words for each departure.
"""

"""How strong is the light on the sample, and what lies around it?

Takes patch, paper, lamp strengths; gives irradiance a view, radiance of the surroundings.
"""

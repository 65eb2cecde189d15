"""How is a rendered world handed over as a photo set?

Takes Scene; gives photoset.toml, photos, truth.json.
"""

"""What the surface does: from (incident, exit) pairs to surface scattering modes and lobes."""

"""Where things were: camera, poses, sample, lights and the irradiance that they throw."""

"""What was photographed: the photo set's manifest, its images, and the linear radiance in them."""

"""A simulation of a scene, its runs, and what is measured of joints and bodies in them."""

"""A small multibody library: rigid bodies, joints and forces given as data, and pantographs made of them."""

"""Methods on strands and grooms: densify, decimate, weights, collision."""

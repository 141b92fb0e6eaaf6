"""Methods on volumes: from 2D orientations to a 3D direction field.

What field and tracking plugins share: fusing views, priors, diffusion, and sampling of volumes.

* `cell_shells`: cells grown or shrunk over their faces
* `diffusion`: screened diffusion on masked cells, by conjugate gradients
* `find_parting`: where the parting is, as the user says or the views show
* `find_ties`: where hair is tied, and the tube of the tail
* `growth_prior`: geodesic distances from scalp and tips, and a direction prior
* `hair_depth`: how far away the hair in one photo is, told by a network
* `hanging_hair`: the field of tight curls
* `isosurface`: the smooth surface of a volume of cells
* `parting`: how hair on the crown is combed from its parting
* `relaxed_signs`: signs of directions measured without one
* `sampling_kernels`: compiled look-ups in volumes
* `scalp_comb`: which way the hair on the crown is combed, as all views see it
* `scalp_sight`: directions of the hair on the scalp, as all views see them
* `smooth_volume`: Gaussian smoothing of volumes
* `symmetric_eigen`: eigenvectors of symmetric 3x3 tensors, in closed form
* `unseen`: directions of hair that photos see from one side, or not at all
* `view_fusion`: 2D orientations of all views fused into 3D tensors
* `wisps`: single locks off the rest of the hair, thinner than the opened masks hold
"""

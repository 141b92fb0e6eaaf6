"""Methods on images: masked filters, segmentation, matting, measured waves.

What segmenters and orienters share. Nothing here knows cameras or 3D, except that waves are
measured over all views.

* `alpha_matting`: mask edges refined at full size
* `corrections`: a user's strokes on an automatic mask
* `framing`: where the head is in each photo, and which way is up
* `geodesic`: geodesic distance from seeds; contours are expensive to cross
* `hair_colours`: photos of one person labelled by their common colours
* `hair_features`: what the hair network sees of a photo
* `hair_network`: probability of hair, person and background by a small network
* `masked_filters`: filters that respect a mask, means of undirected angles
* `picture_file`: PNG and JPEG files
* `person_outline`: the silhouette of a head, in head widths
* `seeded_segmentation`: hair, person and background from seeds
* `relief`: bump and normal maps, pictures of differences
* `skin_colour`: blood and melanin in an albedo
* `unet`: a small U-Net in NumPy
* `waves`: radius and pitch of waves in the orientation maps
"""

"""Frozen types that travel between stages, and nothing else.

Each checks its arrays when it is made and saves itself to an `.npz` file. Methods on them are in
the packages named after the subject.

* `camera`: pinhole and orthographic cameras
* `capture`: the photos and what is known about each
* `carried`: what a file held beyond a groom
* `chosen`: what a user chooses instead of what is measured
* `edits`: what an artist changed by hand
* `evidence`: what field and strands are made from
* `face`: landmarks and direction of a face
* `finding`: what a check of a file found
* `framing`: how photos are turned and cropped to the head
* `groom`: strands on a head with material and physics
* `hairline`: density of the hair on a head
* `head`: the head mesh, roots, capsules
* `mask`: labels: hair, person, background
* `node_options`: settings of simulators whose guides are chains of nodes
* `orientation`: 2D strand angle and confidence
* `parting`: the parting on the crown
* `person`: probability of the person
* `point_cache`: simulated frames of the guides
* `preview`: the pictures of these types that a notebook shows
* `scene`: cameras and fitted head
* `skin`: texture maps and blendshapes of a head
* `skin_look`: how skin reflects and scatters light
* `strand_blocks`: strands in blocks of little memory, and values along them
* `strands`: packed polylines
* `texture_example`: what a texture is to become
* `tie`: ties, and the tails that hang from them
* `torso_shape`: how a torso differs from an average one
* `turnaround`: from where each photo was taken
* `volume`: grid, hull, orientation field, distance from the scalp
* `waves`: radius, pitch and slant of wavy hair
"""

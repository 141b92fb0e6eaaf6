"""The head: procedural template, scalp, distances, skin weights, torso.

Geometry of the head mesh on which hair grows; the mesh type itself is `hairkit.types.head.Head`.

* `bare_head`: where a photo shows face, ears and neck
* `bust`: a clothed bust under a head, for pictures and exports
* `bvh`: nearest points and ray crossings on triangle meshes
* `carry_scalp`: a scalp carried to a head of another mesh
* `cranium`: the cranium's rim and where outlines are bare
* `delighting`: the light of photos taken out of colours
* `eye_colours`: the colours of a person's eyes, from photos
* `exposures`: exposures of photos evened where they overlap
* `eyes`: eyeballs in open lids, and the picture of them
* `free_points`: points that keep a distance from each other, taken in turn
* `gradient_blend`: pictures joined in their gradients
* `hairline`: where the photos show that hair grows
* `identity`: shapes by which heads differ, two adults and a child
* `photo_skin`: the skin of a head taken from the photos
* `placement`: a head placed under given strands
* `reach`: how far hair grows from its guides
* `register_head`: a head brought onto another of any mesh
* `scalp`: roots: sampling, binding to faces, growth mesh
* `signed_distance`: signed distance to a head, on a grid or at points
* `skin_tones`: smooth colours of the skin, extended to where none are seen
* `skinning`: skin weights of the three joints
* `spread_vertices`: vertices chosen evenly over a part of a head
* `template`: the default head
* `template_shape`: its profile curves and displacements
* `template_skin`: the painted skin of the default head
* `thin_plate_spline`: smooth maps through given points, in 2D and 3D
* `torso`: a torso by nine numbers, below a head
"""

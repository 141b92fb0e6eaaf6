"""Methods on strands and grooms after tracking.

Make a groom of tracked or imported strands, thin it out or fill it up, and prepare it for export.

* `adopt_strands`: a groom from bare strands of a file
* `assemble`: strands, head and photo colours put together as a groom
* `brushed_hair`: hair under a brush, and strokes over it
* `brushes`: strands combed, cut and curled by strokes over them
* `cover_hair`: strands led through hair that no other reaches
* `curve_sets`: curves of files as strands, with values of points and strands
* `decimate`: guides chosen from full hair
* `densify`: full hair interpolated between guides
* `density`: guides added between others, hair planted on the face, and guides removed
* `engine_files`: what an engine takes of a groom
* `fringe`: strands that hang loose beside tied hair
* `guide_weights`: the nearest guides of each hair, and hair that follows them
* `head_collision`: strand points pushed out of the head
* `lead_to_ties`: strands led to their tie and down the tail
* `locks`: how hair lies in locks, and strays from them
* `photo_colours`: colours of hair from the photos, of dyed streaks and tips too
* `postprocess`: ties, waves and head collision after tracking
* `prepare_export`: choice of strands and defaults for exporters
* `smooth_curves`: curves without sudden bends
* `target_rules`: what engines demand of a hair file
* `wind_waves`: measured waves put onto strands
* `wrap`: a groom carried to another head
"""

"""Files: readers and writers, and what file formats share.

Captures, photos, heads and meshes, and the parts that format plugins are built from. Readers check
every size before they ask for memory. Grooms and caches save and load themselves.

* `byte_reader`: binary files with every size checked
* `byte_writer`: arrays as bytes of binary files
* `capture_reader`: a folder of photos with masks, strokes and landmarks
* `capture_toml`: `capture.toml`
* `card_file`: what files of hair cards hold
* `coordinate_space`: axes and unit of a file
* `exif`: EXIF tags of photos
* `file_format`: what a format carries, as its plugin declares it
* `framed_photos`: photos cropped to the head, at the resolution of the files
* `glb_document`: glTF documents under construction
* `glb_file`: glTF documents
* `glb_mesh`: the triangle mesh of a glTF file
* `glb_motion`: the motion of a head in a glTF file
* `glb_skin`: texture maps and morph targets of glTF meshes
* `head_landmarks`: landmarks beside a mesh of a head
* `head_reader`: heads from OBJ, PLY and GLB
* `heic`: HEIC photos, by an optional library
* `mesh_text`: triangle meshes of OBJ and PLY files
* `number_text`: numbers in text files, fast
* `photos`: photos, with their headers checked first
* `plain_settings`: settings of a groom as numbers, texts and lists
* `ply_elements`: elements of PLY files, and strands from them
* `png_chunks`: the chunks of PNG files
* `polylines`: strands from loose edges
* `spline_curves`: points on spline curves from control points
* `streamed`: arrays made while they are written
* `strokes`: strokes on photos, labelme's JSON
* `textures`: texture maps of mesh files
* `video`: a video of a turn as a capture
* `video_child`: the process that decodes videos
"""

"""Cameras: the turntable model, fast projection, and consistency of silhouettes.

Methods on `hairkit.types.camera.Camera`s that scene, hull and field plugins share; the camera type
itself is in `hairkit.types`.

* `depth_raster`: depth maps of meshes and points, drawn without a GPU
* `outlines`: silhouettes as signed distances and contour points
* `projection_kernels`: compiled projection of points: the packed form of a camera
* `silhouette_coherence`: agreement of viewing rays with the silhouettes of other views
* `similarity`: similarity fit between point sets, triangulation
* `turntable`: parameters of a turn of cameras around a head
"""

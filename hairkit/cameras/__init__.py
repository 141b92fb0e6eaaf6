"""Cameras: the turntable model, fast projection, and consistency of silhouettes.

Methods on `hairkit.types.camera.Camera`s that scene, hull and field plugins share; the camera type
itself is in `hairkit.types`.

* `camera_search`: Levenberg-Marquardt from coarse outlines to fine ones, and other starts
* `depth_raster`: depth maps of meshes and points, drawn without a GPU
* `landmark_equations`: landmark residuals, marginalised over the shape of the head
* `outlines`: silhouettes as signed distances and contour points
* `projection_kernels`: compiled projection of points: the packed form of a camera
* `silhouette_coherence`: agreement of viewing rays with the silhouettes of other views
* `similarity`: similarity fit between point sets, triangulation
* `turn_fit`: the cameras of a turn as a least-squares problem
* `turntable`: parameters of a turn of cameras around a head
"""

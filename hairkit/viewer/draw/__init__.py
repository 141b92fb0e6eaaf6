"""Drawing of the viewer: render passes for hair, light, meshes and lines.

Hair, its light volume and meshes exist twice, as shaders and as compiled loops for machines without
a graphics card (`*_cpu`); tests compare both.

* `backdrop`: wall and floor behind the head
* `colouring`: colour maps of guides: length, stretch, curvature or confidence
* `frame_budget`: quality that keeps the frame time
* `frame`: one frame of a session
* `hair_cpu`: hair drawn by compiled loops
* `hair_data`: hair at rest, and the guides that it follows
* `hair_gpu`: hair drawn by compute shaders
* `interface`: inputs and interfaces of the renderers
* `light_cpu`: the light volume on the CPU
* `light_gpu`: the light volume on the GPU
* `lines`: coloured polylines and billboards
* `mesh_cpu`: studio and meshes drawn by compiled loops
* `mesh_edges`: smooth outlines of meshes that compiled loops drew
* `mesh_kernels`: compiled placing and lighting of meshes
* `mesh_layer`: studio and meshes behind the hair, kept while they stay, and drawn on the GPU
* `mesh_raster`: compiled rasteriser of meshes
* `meshes`: shaded meshes: where they are, and on the GPU
* `place_kernels`: compiled interpolation of hair from guides
* `raster_kernels`: compiled rasteriser of hair
* `records`: what the compiled loops share: camera, lights and hair
* `region`: a part of a picture that has changed
* `shade_kernels`: compiled fibre shading
* `still`: samples of a still picture: antialiasing and depth of field
"""

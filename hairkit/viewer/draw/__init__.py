"""Drawing of the viewer: render passes for hair, light, meshes and lines.

Hair and its light volume exist twice, as compute shaders (`*_gpu`) and as compiled loops for
machines without a graphics card (`*_cpu`); tests compare both.

* `colouring`: colour maps of guides: length, stretch, curvature or confidence
* `frame`: one frame of a session
* `frame_budget`: quality that keeps the frame time
* `hair_cpu`: hair drawn by compiled loops
* `hair_data`: hair at rest as offsets from guides
* `hair_gpu`: hair drawn by compute shaders
* `interface`: inputs and interface of the hair renderers
* `light_cpu`: the light volume on the CPU
* `light_gpu`: the light volume on the GPU
* `lines`: coloured polylines and billboards
* `meshes`: shaded meshes on the GPU
* `place_kernels`: compiled interpolation of hair from guides
* `raster_kernels`: compiled rasteriser of hair
* `shade_kernels`: compiled fibre shading
* `still`: samples of a still picture: antialiasing and depth of field
* `studio`: wall and floor behind the head
"""

"""Drawing of the viewer: one frame on the GPU, or by compiled loops on the processor.

`*_gpu` and `*_cpu` modules do the same; tests compare them.

* `colouring`: colours of guides by length, stretch, curvature or confidence
* `frame`: one frame of a session
* `frame_budget`: lower quality where frames take too long
* `hair_cpu`: hair drawn on the processor
* `hair_data`: hair at rest, as the drawing code reads it
* `hair_gpu`: hair drawn by compute shaders
* `interface`: inputs and interface of the hair renderers
* `light_cpu`: the light volume on the processor
* `light_gpu`: the light volume on the GPU
* `lines`: coloured lines, camera frusta, photos in space
* `meshes`: head and hull
* `place_kernels`: compiled placement of hair that follows guides
* `raster_kernels`: compiled rasteriser of hair
* `shade_kernels`: compiled fibre shading
"""

// Camera-facing ribbons, shaped once a strand point by a compute shader, drawn as triangle strips of
// two vertices a point. Pixels as in hairkit.types.camera: x right, y down, (0, 0) the outer corner.

struct RibbonPoint {
    vec4 clip;      // the strand's middle in clip space
    vec2 across;    // from the middle to the ribbon's edge in clip space
    float depth;    // along the optical axis, metres
    uint colour;    // packed sRGB
};

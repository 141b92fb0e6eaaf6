// Camera-facing ribbons: a compute shader shapes each strand point once, then they are drawn as
// triangle strips of two vertices per point. Pixels as in hairkit.types.camera: x right, y down,
// (0, 0) the outer corner.

struct RibbonPoint {
    vec4 clip;      // the strand's centre line in clip space
    vec2 across;    // from the centre line to the ribbon's edge in clip space
    float depth;    // along the optical axis, metres
    uint colour;    // packed sRGB
};

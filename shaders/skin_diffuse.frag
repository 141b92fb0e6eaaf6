#version 430
// One of the two passes of the separable kernel (Jimenez et al. 2015), in metres on the surface.

#constants hairkit.rendering.skin_lobe TAPS

uniform sampler2D u_diffuse;    // light, and the depth in metres
uniform sampler2D u_surface;    // in alpha whether it scatters
uniform vec4 u_taps[TAPS];      // weights of red, green, blue, and the offset in metres; the middle first
uniform vec2 u_way;             // along the rows or the columns, pixels
uniform float u_focal_px;
uniform float u_perspective;
out vec4 out_diffuse;

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    vec4 middle = texelFetch(u_diffuse, here, 0);
    out_diffuse = middle;
    if (texelFetch(u_surface, here, 0).a < 0.5) return;
    float pixels = u_perspective > 0.5 ? u_focal_px / middle.a : u_focal_px;   // a metre
    vec2 size = vec2(textureSize(u_diffuse, 0));
    vec3 sum = middle.rgb * u_taps[0].rgb;
    for (int i = 1; i < TAPS; i++) {
        vec2 at = (gl_FragCoord.xy + u_way * u_taps[i].a * pixels) / size;
        vec4 there = texture(u_diffuse, at);
        // what lies farther away in depth than on the surface is another surface
        float off = abs(there.a - middle.a) / (2.0 * abs(u_taps[i].a) + 1e-4);
        float same = (1.0 - smoothstep(0.5, 1.0, off)) * step(0.99, texture(u_surface, at).a);
        sum += mix(middle.rgb, there.rgb, same) * u_taps[i].rgb;
    }
    out_diffuse.rgb = sum;
}

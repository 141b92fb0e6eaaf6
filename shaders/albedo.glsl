// The picture of a mesh's colour; meshes without one are white.

uniform sampler2D u_albedo;
uniform float u_textured;

vec3 picture(vec2 uv) {
    vec3 srgb = texture(u_albedo, uv).rgb;
    vec3 linear_rgb = mix(srgb / 12.92, pow((srgb + 0.055) / 1.055, vec3(2.4)), step(0.04045, srgb));
    return mix(vec3(1.0), linear_rgb, u_textured);
}
